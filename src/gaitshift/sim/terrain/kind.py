"""A kind of ground: its word in specs, its number, its maker, when it is rough, and its samples."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil

import numpy as np
from jaxtyping import Float

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


CELL = 0.10
"""Default for smooth ground [m]. Ours: 3.75 samples on the shortest lattice of Perlin's noise."""

FINE_CELL = 0.025
"""Default for ground with edges or small bumps [m].

Ours: a vertical face leans over one cell, so that a step of 5 cm is 63° steep and one of 10 cm 76°;
the smallest pebble is four cells wide.
"""

LENGTH = Quantity(name="length", unit="m", low=0.5, high=1000.0)
"""Of a field or piece along x. Ours: no shorter than a robot's stance."""

WIDTH = Quantity(name="width", unit="m", low=0.5, high=1000.0)
"""Of a field along y."""

CELL_RANGE = Quantity(name="cell", unit="m", low=0.005, high=0.5)
"""Of the distance between samples. Ours: the longest fits the shortest field."""

MAX_SAMPLES = 4_000_000
"""Most samples of one field: 16 MB in MuJoCo, and 2500 m² at the fine cell."""


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Samples that span `length` × `width` exactly, at most `cell` apart.

    `GaitshiftError` where a measure is out of range or the samples are more than `MAX_SAMPLES`.
    """

    length: float
    """Along x [m]."""
    width: float
    """Along y [m]."""
    cell: float
    """Largest distance between neighbouring samples [m]; it shrinks to fit."""

    def __post_init__(self) -> None:
        LENGTH.check(self.length)
        WIDTH.check(self.width)
        CELL_RANGE.check(self.cell)
        rows, cols = self.shape
        if rows * cols > MAX_SAMPLES:
            raise GaitshiftError(
                f"a terrain must have at most {MAX_SAMPLES} samples, got {rows * cols} for "
                f"{self.length:g} × {self.width:g} m with a cell of {self.cell:g} m; give a larger "
                "cell"
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return _cells(self.width, self.cell) + 1, _cells(self.length, self.cell) + 1

    @property
    def x(self) -> Float[np.ndarray, " cols"]:
        """Distance of each column from the first [m]."""
        return np.linspace(0.0, self.length, self.shape[1])

    @property
    def y(self) -> Float[np.ndarray, " rows"]:
        """Distance of each row from the first [m]."""
        return np.linspace(0.0, self.width, self.shape[0])

    def terrain(
        self,
        height: Float[np.ndarray, "..."],
        *,
        name: str,
        origin: tuple[float, float] | None,
    ) -> Terrain:
        """Field of these heights [m]: whole (rows, cols), one profile along x (cols,), or one ().

        Without `origin` it begins at x = 0 and has y = 0 in its middle.
        """
        return Terrain(
            height=np.broadcast_to(height, self.shape),
            size=(self.length, self.width),
            origin=(0.0, -self.width / 2) if origin is None else origin,
            name=name,
        )


def _cells(span: float, cell: float) -> int:
    """Count of the cells that fill the span; a span of whole cells but for rounding is whole."""
    return ceil(span / cell - 1e-9)
