"""Labels of rough ground, and recordings aligned to the start of what is detected."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.labelled_run import LabelledRun, Way
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import KINDS, sections_of

_ROUGH_FROM = {kind.name: kind.rough_from for kind in KINDS if kind.rough_from is not None}
"""Least number at which a kind of ground counts as rough; other kinds never do."""


def rough_ground(log: Log) -> Bool[np.ndarray, "T N"]:
    """Whether each robot's base is over rough ground, from the pieces of the log's track.

    Raises:
        GaitshiftError: the name of the ground cannot be read.
    """
    x0, length = float(log.terrain_origin[0]), float(log.terrain_size[0])
    return is_rough(log.qpos[..., 0], log.terrain, x0, length)


def is_rough(
    x: Float[np.ndarray, "*shape"], terrain: str, x0: float, length: float
) -> Bool[np.ndarray, "*shape"]:
    """Whether a ground of this name, from `x0` on and `length` [m] long, is rough at x [m].

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
            raise GaitshiftError(
                f"terrain '{section.name}': the part after ':' must be a number, got '{number}'"
            ) from None
        if counts:
            rough |= (x >= section.x0) & (x < section.x1)
    return rough


def align_to_entry(
    recording: LabelledRun, values: Float[np.ndarray, "T N M"], way: Way
) -> tuple[LabelledRun, Float[np.ndarray, "T N M"]]:
    """The recording with the ground to detect as its rough ground, and the values beside it.

    Each robot starts where it first reaches the ground before the one to detect: smooth ground for
    the way to rough ground, and rough ground for the way back. Steps before that are dropped,
    because a firing there is not a detection; the statistic has seen them. A robot that never
    reaches that ground counts from the start for the way to rough ground, since a log of rough
    ground alone still shows the delay; for the way back it counts as fallen from the start. Rows
    missing at the end are filled with fallen robots.
    """
    back = way == "flat"
    other = (recording.rough == back) & recording.alive
    steps = len(other)
    start = np.where(other.any(axis=0), other.argmax(axis=0), steps if back else 0)
    if not start.any():
        return (replace(recording, rough=~recording.rough) if back else recording), values
    row = np.arange(steps)[:, None] + start
    at, robots = np.minimum(row, steps - 1), np.arange(recording.robots)
    way_before = recording.distance[at[0], robots]
    turned = replace(
        recording,
        rough=recording.rough[at, robots] ^ back,
        alive=recording.alive[at, robots] & (row < steps),
        distance=recording.distance[at, robots] - way_before,
    )
    return turned, values[at, robots]
