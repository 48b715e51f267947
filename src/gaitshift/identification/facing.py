"""A recording seen by what is to be noticed: rough ground, or that it has ended."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from gaitshift.identification.recording import Recording, Way


def facing(
    recording: Recording, values: Float[np.ndarray, "T N M"], way: Way
) -> tuple[Recording, Float[np.ndarray, "T N M"]]:
    """The recording with what is to be noticed as its rough ground, and the values beside it.

    On the way to flat ground each robot begins where it first comes to rough ground: flat ground
    before that has not been come to, and a firing on it would be no detection. What the statistic
    remembers is what it has seen by then. A robot that never comes to rough ground counts as fallen
    from the start. Rows that are missing at the end are filled up with such ones.
    """
    if way == "rough":
        return recording, values
    rough = recording.rough & recording.alive
    steps = len(rough)
    start = np.where(rough.any(axis=0), rough.argmax(axis=0), steps)
    if not start.any():
        return replace(recording, rough=~recording.rough), values
    row = np.arange(steps)[:, None] + start
    at, robots = np.minimum(row, steps - 1), np.arange(recording.robots)
    way_before = recording.distance[at[0], robots]
    turned = replace(
        recording,
        rough=~recording.rough[at, robots],
        alive=recording.alive[at, robots] & (row < steps),
        distance=recording.distance[at, robots] - way_before,
    )
    return turned, values[at, robots]
