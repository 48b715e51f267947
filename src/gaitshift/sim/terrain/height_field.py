"""The ground: heights on a regular grid, and the surface that MuJoCo spans over them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Float32, Int

from gaitshift.errors import GaitshiftError

_FLAT_ELEVATION = 0.01
"""Scale of a field whose samples are all 0 [m]: without effect, but MuJoCo needs it positive."""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A stretch of ground along x made of one piece."""

    name: str
    """The spec of the piece, such as `perlin:0.1`."""
    x0: float
    """Where it begins, world frame [m]."""
    x1: float
    """Where it ends, world frame [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Terrain:
    """Heights on a regular grid, in metres of the world frame, and the surface between them.

    Rows run along +y and columns along +x, as in MuJoCo's height fields. The surface is MuJoCo's:
    each cell is cut along the diagonal from sample [i, j] to sample [i+1, j+1], and each half is
    flat. Heights are kept as a read-only float64 copy. `GaitshiftError` where a height or a
    measure is not finite, where there are fewer than 2 × 2 samples, or where the size is not
    positive.
    """

    height: Float[np.ndarray, "rows cols"]
    """Height of each sample above the world's z = 0 [m]."""
    size: tuple[float, float]
    """Length along x and width along y, from first sample to last [m]."""
    origin: tuple[float, float]
    """World x and y of sample [0, 0], the corner of smallest x and y [m]."""
    name: str
    """The spec it was made from, for logs; it lacks arguments that differ from their defaults."""
    sections: tuple[Section, ...] = ()
    """The pieces along x, in order and without gaps; left empty: one, the whole field."""

    def __post_init__(self) -> None:
        if self.height.ndim != 2 or min(self.height.shape) < 2:
            shape = self.height.shape
            raise GaitshiftError(
                f"terrain '{self.name}': samples must be 2 × 2 or more, got {shape}"
            )
        if not np.isfinite(self.height).all():
            raise GaitshiftError(
                f"terrain '{self.name}': heights must be finite, got NaN or infinity"
            )
        if not (np.isfinite([*self.size, *self.origin]).all() and min(self.size) > 0.0):
            raise GaitshiftError(
                f"terrain '{self.name}': size must be above 0 and origin finite [m], "
                f"got size {self.size}, origin {self.origin}"
            )
        height = np.array(self.height, dtype=np.float64, order="C")
        height.flags.writeable = False
        object.__setattr__(self, "height", height)
        if not self.sections:
            x0, x1, _, _ = self.extent
            object.__setattr__(self, "sections", (Section(name=self.name, x0=x0, x1=x1),))

    @property
    def cell(self) -> tuple[float, float]:
        """Distance between neighbouring samples along x and along y [m]."""
        rows, cols = self.height.shape
        return self.size[0] / (cols - 1), self.size[1] / (rows - 1)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """The rectangle it covers in the world frame: x0, x1, y0, y1 [m]."""
        (x0, y0), (length, width) = self.origin, self.size
        return x0, x0 + length, y0, y0 + width

    @cached_property
    def is_flat(self) -> bool:
        """Whether all heights are the same."""
        return bool(self.height.min() == self.height.max())

    def height_at(self, xy: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch"]:
        """Height below points `xy` [m], world frame, of the surface that MuJoCo collides with.

        Outside the field, where MuJoCo has no ground, it is the height of the nearest point of the
        border. The height of a NaN point is NaN.
        """
        return _height_at(xy, self.grid)

    def contains(
        self, xy: Float[np.ndarray, "*batch 2"], margin: float = 0.0
    ) -> Bool[np.ndarray, "*batch"]:
        """Whether points `xy` [m], world frame, lie on the field, `margin` [m] from its rim."""
        x0, x1, y0, y1 = self.extent
        x, y = xy[..., 0], xy[..., 1]
        inside_x = (x >= x0 + margin) & (x <= x1 - margin)
        return np.asarray(inside_x & (y >= y0 + margin) & (y <= y1 - margin))

    def moved(self, dx: float, dy: float) -> "Terrain":
        """Ground of the same shape, shifted by `dx`, `dy` [m]."""
        return replace(
            self,
            origin=(self.origin[0] + dx, self.origin[1] + dy),
            sections=tuple(replace(s, x0=s.x0 + dx, x1=s.x1 + dx) for s in self.sections),
        )

    @property
    def grid(self) -> "Grid":
        """Where its heights are looked up."""
        (rows, cols), (dx, dy) = self.height.shape, self.cell
        return Grid(self.height.reshape(-1), 0, rows, cols, *self.origin, dx, dy)


class Grid(NamedTuple):
    """Where heights are looked up: a field, or for each robot its own (arrays of N × 1)."""

    samples: Float[np.ndarray, " S"]
    """Heights of all fields, row by row [m]."""
    first: Int[np.ndarray, "N 1"] | int
    """Number of a field's first sample."""
    rows: Int[np.ndarray, "N 1"] | int
    cols: Int[np.ndarray, "N 1"] | int
    x: Float[np.ndarray, "N 1"] | float
    y: Float[np.ndarray, "N 1"] | float
    """Place of the first sample [m]."""
    dx: Float[np.ndarray, "N 1"] | float
    dy: Float[np.ndarray, "N 1"] | float
    """Distance between neighbouring samples [m]."""


class Fields:
    """The ground under N robots: robot i stands on field i mod K of K fields."""

    def __init__(self, fields: Sequence[Terrain], n: int) -> None:
        grids = [field.grid for field in fields]
        which = np.arange(n) % len(fields)
        self._samples = np.concatenate([grid.samples for grid in grids])
        first = np.cumsum([0, *(grid.samples.size for grid in grids[:-1])])
        sizes = np.array([(grid.rows, grid.cols) for grid in grids])
        self._whole = np.column_stack((first, sizes))[which]
        self._places = np.array([(grid.x, grid.y, grid.dx, grid.dy) for grid in grids])[which]
        self._is_flat = all(field.is_flat for field in fields)

    def height_at(
        self, xy: Float[np.ndarray, "K M 2"], ids: Int[np.ndarray, " K"] | slice = slice(None)
    ) -> Float[np.ndarray, "K M"]:
        """Height below M points of each of these robots [m], as `Terrain.height_at` gives it."""
        first, rows, cols = self._whole[ids].T[..., None]
        if self._is_flat:
            return np.where(np.isnan(xy).any(axis=-1), np.nan, self._samples[first])
        x, y, dx, dy = self._places[ids].T[..., None]
        return _height_at(xy, Grid(self._samples, first, rows, cols, x, y, dx, dy))


def _height_at(xy: Float[np.ndarray, "*batch 2"], grid: Grid) -> Float[np.ndarray, "*batch"]:
    samples, first, rows, cols, x, y, dx, dy = grid
    u = np.minimum(np.maximum((xy[..., 0] - x) / dx, 0.0), cols - 1)
    v = np.minimum(np.maximum((xy[..., 1] - y) / dy, 0.0), rows - 1)
    # fmin, unlike minimum, gives points that are NaN some cell; their u, v stay NaN.
    j = np.asarray(np.fmin(u, cols - 2)).astype(np.intp)
    i = np.asarray(np.fmin(v, rows - 2)).astype(np.intp)
    u, v = u - j, v - i  # place in the cell, in [0, 1]
    # The triangle has corner [i, j], then [i, j+1] where u ≥ v or [i+1, j], then [i+1, j+1].
    corner = first + i * cols + j
    near = samples.take(corner)
    middle = samples.take(corner + np.where(u < v, cols, 1))
    far = samples.take(corner + cols + 1)
    # From the corner along the grid as far as the larger of u, v, then along the other axis.
    height = near + np.maximum(u, v) * (middle - near) + np.minimum(u, v) * (far - middle)
    return np.asarray(height)


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitField:
    """The numbers of MuJoCo's `<hfield>` and of its geom."""

    data: Float32[np.ndarray, "rows cols"]
    """Samples from 0 (lowest) to 1 (highest), as `hfield_data` holds them; all 0 when flat.

    They span [0, 1] whole, so that the compiler's own normalisation leaves them as they are.
    """
    size: tuple[float, float, float, float]
    """The asset's `size`: half length, half width, height of a sample of 1, base thickness [m]."""
    position: tuple[float, float, float]
    """The geom's `pos`, world frame: the middle of the field, at the lowest sample's height [m]."""


def to_unit_interval(terrain: Terrain, *, base: float = 0.5) -> UnitField:
    """Terrain as MuJoCo's height field; `base` [m] is the solid ground below its lowest sample.

    float32 rounds samples to within 3e-8 of the relief (highest minus lowest sample), so that
    MuJoCo's surface and `Terrain.height_at` agree to 1e-6 m on any relief up to 30 m.

    The default of `base` is ours: much thicker than the few millimetres by which a foot sinks in,
    so that a contact never pushes a foot downwards.
    """
    lowest = float(terrain.height.min())
    relief = float(terrain.height.max()) - lowest
    elevation = relief if relief > 0.0 else _FLAT_ELEVATION
    (x0, y0), (length, width) = terrain.origin, terrain.size
    return UnitField(
        data=((terrain.height - lowest) / elevation).astype(np.float32),
        size=(length / 2, width / 2, elevation, base),
        position=(x0 + length / 2, y0 + width / 2, lowest),
    )
