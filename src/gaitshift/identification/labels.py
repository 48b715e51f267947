"""Where the ground is rough: the truth that conditions are judged by."""

import numpy as np
from jaxtyping import Bool

from gaitshift.errors import GaitshiftError
from gaitshift.log import Log
from gaitshift.terrain import sections_of

ROUGH = ("perlin",)
"""Kinds of ground that are rough; a slope, a stair, a step or a pebble is not."""

LEAST_AMPLITUDE = 0.05
"""Noise of a smaller amplitude counts as flat [m]; ours: 5 cm is what a trot steps over."""


def rough_ground(log: Log) -> Bool[np.ndarray, "T N"]:
    """Whether each robot's base is over rough ground, by the pieces of the log's track.

    Raises:
        GaitshiftError: the name of the ground cannot be read.
    """
    x = log.qpos[..., 0]
    rough = np.zeros(x.shape, dtype=bool)
    for section in sections_of(
        log.terrain, float(log.terrain_origin[0]), float(log.terrain_size[0])
    ):
        kind, _, number = section.name.partition(":")
        if kind not in ROUGH:
            continue
        try:
            counts = float(number) >= LEAST_AMPLITUDE
        except ValueError:
            raise GaitshiftError(f"ground '{section.name}': its number cannot be read") from None
        if counts:
            rough |= (x >= section.x0) & (x < section.x1)
    return rough
