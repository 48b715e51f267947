"""A kind of ground: its word in specs, the number behind it, its maker, and whether it is rough."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.height_field import Terrain

Seed = int | np.random.Generator
"""Seed of a random ground."""


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A named number in a closed range, with an error message for values outside."""

    name: str
    """Its name in error messages."""
    unit: str
    """Its unit in error messages; empty for a count or a ratio."""
    low: float
    """The smallest allowed value, in `unit`."""
    high: float
    """The largest allowed value, in `unit`."""

    def check(self, value: float) -> float:
        """The value; `GaitshiftError` where it is outside the range or not a number."""
        if not self.low <= value <= self.high:
            raise GaitshiftError(f"{self.name} must be {self.range}, got {value:g}")
        return value

    @property
    def range(self) -> str:
        """The range in words: `0 to 1 m`."""
        return f"{self.low:g} to {self.high:g} {self.unit}".rstrip()


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of ground, as `from_spec` reads it.

    A file of grounds holds its kinds in `KINDS`, and `spec` names the file.
    """

    name: str
    """Its word in specs."""
    number: Quantity | None
    """The number behind the colon; None where there is none."""
    cell: float
    """Distance between samples where none is asked for [m]."""
    meaning: str
    """One line for `--help`."""
    make: Callable[[float, Seed, float, float, float], Terrain]
    """Makes it from number, seed, length, width and cell [m]; some need no number or no seed."""
    rough_from: float | None = None
    """Least number at which it counts as rough ground, the label by which shift conditions are
    judged; None: it never does."""

    @property
    def usage(self) -> str:
        """How it is written: `perlin:AMPLITUDE [0 to 1 m]`."""
        if self.number is None:
            return self.name
        return f"{self.name}:{self.number.name.upper()} [{self.number.range}]"


def spell(kind: str, number: float) -> str:
    """Spec of a kind of ground with its number, the shortest that reads back exactly."""
    return f"{kind}:{np.format_float_positional(number, trim='-')}"
