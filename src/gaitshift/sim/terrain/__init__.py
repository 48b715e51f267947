"""The ground in metres: height fields, makers of terrains and tracks, and their specs as text."""

from gaitshift.sim.terrain.height_field import Fields, Section, Terrain, UnitField, to_unit_interval
from gaitshift.sim.terrain.kind import Kind
from gaitshift.sim.terrain.pebbles import pebbles
from gaitshift.sim.terrain.perlin import perlin
from gaitshift.sim.terrain.shapes import bank, flat, slope, stairs, step
from gaitshift.sim.terrain.spec import KINDS, from_spec, sections_of, spec_help, track

__all__ = [
    "KINDS",
    "Fields",
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
