"""Small bumps strewn over level ground."""

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.height_field import Terrain
from gaitshift.sim.terrain.kind import FINE_CELL, Grid, Kind, Quantity, spell

_HEIGHT = Quantity(name="height", unit="m", low=0.0, high=1.0)
"""Of the highest pebble."""

_DENSITY = Quantity(name="density", unit="pebbles per m²", low=0.01, high=100.0)
_DIAMETER = Quantity(name="diameter", unit="m", low=0.02, high=2.0)

_LOWEST_SHARE = 0.3
"""Ours: pebbles are between this and 1 of the greatest height, evenly drawn."""


def pebbles(
    height: float,
    *,
    seed: int | np.random.Generator,
    length: float,
    width: float,
    density: float = 4.0,
    diameter: tuple[float, float] = (0.10, 0.20),
    cell: float = FINE_CELL,
    origin: tuple[float, float] | None = None,
) -> Terrain:
    """Round bumps on level ground at z = 0, the highest sample exactly `height` [m].

    Their number is `density` [1/m²] times the area, rounded, but at least one. Their places are
    uniform over the field, their diameters uniform between the two of `diameter` [m]. A bump of
    radius R has the profile (1 − r²/R²)²; where two overlap the higher counts. The defaults are
    ours: flat stones a little wider than a foot, on 7 % of the ground.

    `GaitshiftError` where a number is out of range, or `cell` is longer than half of the smallest
    diameter, because a bump between the samples would be lost.
    """
    _HEIGHT.check(height)
    _DENSITY.check(density)
    smallest, largest = (_DIAMETER.check(value) for value in diameter)
    if smallest > largest:
        raise GaitshiftError(f"diameter must be (smallest, largest) [m], got {diameter}")
    if cell > smallest / 2:
        raise GaitshiftError(
            f"cell must be at most {smallest / 2:g} m, half of the smallest pebble, got {cell:g}"
        )
    grid = Grid(length=length, width=width, cell=cell)
    generator = np.random.default_rng(seed)
    count = max(1, round(density * length * width))
    place = generator.uniform((0.0, 0.0), (length, width), size=(count, 2))
    radius = generator.uniform(smallest, largest, size=count) / 2
    share = generator.uniform(_LOWEST_SHARE, 1.0, size=count)
    bumps = _strewn(grid, place, radius, share)
    return grid.terrain(bumps / bumps.max() * height, name=spell("pebbles", height), origin=origin)


def _strewn(
    grid: Grid,
    place: Float[np.ndarray, "n 2"],
    radius: Float[np.ndarray, " n"],
    share: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "rows cols"]:
    """Height of the highest bump at every sample; `share` is each bump's height at its middle."""
    x, y = grid.x, grid.y
    height = np.zeros(grid.shape)
    left, right = (np.searchsorted(x, place[:, 0] + side * radius) for side in (-1, 1))
    lower, upper = (np.searchsorted(y, place[:, 1] + side * radius) for side in (-1, 1))
    for n, (px, py) in enumerate(place):
        rows, cols = slice(lower[n], upper[n]), slice(left[n], right[n])
        squared = (x[cols] - px) ** 2 + (y[rows, None] - py) ** 2
        bump = share[n] * np.maximum(1.0 - squared / radius[n] ** 2, 0.0) ** 2
        height[rows, cols] = np.maximum(height[rows, cols], bump)
    return height


KINDS = (
    Kind(
        name="pebbles",
        number=_HEIGHT,
        cell=FINE_CELL,
        meaning="round bumps 0.1 to 0.2 m wide, 4 a square metre, the highest this high",
        make=lambda number, seed, length, width, cell: pebbles(
            number, seed=seed, length=length, width=width, cell=cell
        ),
    ),
)
