"""Where the ground is rough: the truth that conditions are judged by."""

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import KINDS, sections_of

_ROUGH_FROM = {kind.name: kind.rough_from for kind in KINDS if kind.rough_from is not None}
"""Least number from which a kind of ground counts as rough; other kinds never do."""


def rough_ground(log: Log) -> Bool[np.ndarray, "T N"]:
    """Whether each robot's base is over rough ground, by the pieces of the log's track.

    Raises:
        GaitshiftError: the name of the ground cannot be read.
    """
    x0, length = float(log.terrain_origin[0]), float(log.terrain_size[0])
    return is_rough(log.qpos[..., 0], log.terrain, x0, length)


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
        if kind not in _ROUGH_FROM:
            continue
        try:
            counts = float(number or 0.0) >= _ROUGH_FROM[kind]
        except ValueError:
            raise GaitshiftError(f"ground '{section.name}': its number cannot be read") from None
        if counts:
            rough |= (x >= section.x0) & (x < section.x1)
    return rough
