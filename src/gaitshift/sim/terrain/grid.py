"""The sample points of a field."""

from dataclasses import dataclass
from math import ceil

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.height_field import Terrain
from gaitshift.sim.terrain.kind import Quantity

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
