"""A recording seen by what is to be noticed: rough ground, or that it has ended."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from gaitshift.lab.identification.labelled_run import LabelledRun, Way


def facing(
    recording: LabelledRun, values: Float[np.ndarray, "T N M"], way: Way
) -> tuple[LabelledRun, Float[np.ndarray, "T N M"]]:
    """The recording with what is to be noticed as its rough ground, and the values beside it.

    Each robot begins where it first comes to the other ground: smooth, on the way to rough ground,
    and rough, on the way back. What it walked on before that it has not come to, and a firing on it
    would be no detection. What the statistic remembers is what it has seen by then. A robot that
    never comes to the other ground counts from the start on the way to rough ground, since a log of
    rough ground alone tells how soon it is noticed; on the way back it counts as fallen from the
    start. Rows that are missing at the end are filled up with fallen robots.
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
