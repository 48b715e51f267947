"""The ground in metres: height fields, makers of terrains and tracks, and their specs as text."""

from gaitshift.sim.terrain.height_field import Section, Terrain
from gaitshift.sim.terrain.pebbles import pebbles
from gaitshift.sim.terrain.perlin import perlin
from gaitshift.sim.terrain.shapes import bank, flat, slope, stairs, step
from gaitshift.sim.terrain.spec import KINDS, Kind, from_spec, spec_help
from gaitshift.sim.terrain.track import sections_of, track
from gaitshift.sim.terrain.unit_interval import UnitField, to_unit_interval

__all__ = [
    "KINDS",
    "Kind",
    "Section",
    "Terrain",
    "UnitField",
    "bank",
    "flat",
    "from_spec",
    "pebbles",
    "perlin",
    "sections_of",
    "slope",
    "spec_help",
    "stairs",
    "step",
    "to_unit_interval",
    "track",
]
