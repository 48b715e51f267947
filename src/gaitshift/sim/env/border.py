"""Where on a terrain episodes begin, and where they end at its border."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.sim.terrain import Terrain


def has_border(terrains: Sequence[Terrain]) -> bool:
    """Whether any of the grounds is not level; level ground has no border."""
    return not all(terrain.is_flat for terrain in terrains)


def starting_points(
    terrains: Sequence[Terrain], margin: float, count: int, rng: np.random.Generator
) -> Float[np.ndarray, "K 2"]:
    """Where robots begin [m]: uniformly, at twice the margin [m] from the border; else at 0, 0."""
    if not has_border(terrains):
        return np.zeros((count, 2))
    x0, x1, y0, y1 = terrains[0].extent
    inset = 2 * margin
    low = (min(x0 + inset, (x0 + x1) / 2), min(y0 + inset, (y0 + y1) / 2))
    high = (max(x1 - inset, (x0 + x1) / 2), max(y1 - inset, (y0 + y1) / 2))
    return rng.uniform(low, high, (count, 2))


def has_left(
    terrains: Sequence[Terrain], margin: float, xy: Float[np.ndarray, "N 2"]
) -> Bool[np.ndarray, " N"]:
    """Which robots at these places [m] are nearer to the border than the margin [m]."""
    if not has_border(terrains):
        return np.zeros(len(xy), dtype=bool)
    return ~terrains[0].contains(xy, margin)
