"""Points on a ground."""

import numpy as np


def points_over(terrain, count=300, seed=1):
    """Points drawn uniformly over a terrain [m], (count, 2)."""
    x0, x1, y0, y1 = terrain.extent
    return np.random.default_rng(seed).uniform((x0, y0), (x1, y1), (count, 2))
