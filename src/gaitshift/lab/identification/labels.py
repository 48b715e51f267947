"""Where the ground is rough: the truth that conditions are judged by."""

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import sections_of

ROUGH = ("perlin",)
"""Kinds of ground that are rough; a slope, a stair, a step or a pebble is not."""

LEAST_AMPLITUDE = 0.05
"""Noise of a smaller amplitude counts as flat [m]; ours: 5 cm is what a trot steps over."""


def rough_ground(log: Log) -> Bool[np.ndarray, "T N"]:
    """Whether each robot's base is over rough ground, by the pieces of the log's track.

    Raises:
        GaitshiftError: the name of the ground cannot be read.
    """
    x0, length = float(log.terrain_origin[0]), float(log.terrain_size[0])
    return is_rough(log.truth.base_position_w[..., 0], log.terrain, x0, length)


def is_rough(
    x: Float[np.ndarray, "*shape"], terrain: str, x0: float, length: float
) -> Bool[np.ndarray, "*shape"]:
    """Whether the ground is rough at x [m]: a ground of this name from `x0`, `length` metres long.

    Raises:
        GaitshiftError: the name cannot be read.
    """
    rough = np.zeros(x.shape, dtype=bool)
    for section in sections_of(terrain, x0, length):
        kind, _, number = section.name.partition(":")
        if kind not in ROUGH:
            continue
        try:
            counts = float(number) >= LEAST_AMPLITUDE
        except ValueError:
            raise GaitshiftError(
                f"terrain '{section.name}': the part after ':' must be a number, got '{number}'"
            ) from None
        if counts:
            rough |= (x >= section.x0) & (x < section.x1)
    return rough
