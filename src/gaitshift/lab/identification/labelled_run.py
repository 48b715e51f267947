"""The input of identification: what robots sense over a run, and where the ground is rough."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistics import Watched, watch
from gaitshift.sim.terrain import KINDS, sections_of

Way = Literal["rough", "flat"]
"""What a condition detects: the start of rough ground, or, on the way back, its end."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LabelledRun:
    """T steps of N robots, and the true labels by which conditions are judged."""

    name: str
    """Of the file, or of the course."""
    sensed: Proprioception
    """Input of the conditions (T, N, …)."""
    rough: Bool[np.ndarray, "T N"]
    """Whether the ground under the robot is rough: the truth."""
    alive: Bool[np.ndarray, "T N"]
    """Whether the robot is on its feet; steps after a fall do not count."""
    distance: Float[np.ndarray, "T N"]
    """Distance that each robot has walked since the start [m]."""
    _values: dict[Watched, Float[np.ndarray, "T N M"]] = field(default_factory=dict, init=False)
    """Values of the statistics that were computed before."""

    @property
    def time(self) -> Float[np.ndarray, " T"]:
        """Since the start [s]."""
        time: Any = self.sensed.time
        return np.atleast_1d(time)

    @property
    def period(self) -> float:
        """One control step [s]."""
        return self.sensed.period

    @property
    def robots(self) -> int:
        """N."""
        return self.rough.shape[1]

    def __iter__(self) -> Iterator[Proprioception]:
        """Proprioception step by step, as on the robots."""
        return (self.sensed[t] for t in range(len(self.rough)))

    def compute(self, statistics: Iterable[Watched]) -> None:
        """Computes several statistics in one pass over the steps; `values` then returns them."""
        new = [one for one in dict.fromkeys(statistics) if one not in self._values]
        memory = [one.start(self.robots) for one in new]
        values = [np.empty((*self.rough.shape, one.width)) for one in new]
        for t, sensed in enumerate(self if new else ()):
            for i, one in enumerate(new):
                memory[i], values[i][t] = watch(one, memory[i], sensed, self.rough[t])
        self._values.update(zip(new, values, strict=True))

    def values(self, statistic: Watched) -> Float[np.ndarray, "T N M"]:
        """A statistic's values, computed step by step with the code that runs on a robot."""
        self.compute((statistic,))
        return self._values[statistic]

    @classmethod
    def from_log(cls, log: Log, name: str, rough: Bool[np.ndarray, "T N"]) -> "LabelledRun":
        """A log of this package, with its labels."""
        place = log.truth.base_position_w[..., :2].astype(float)
        step = np.diff(place, axis=0, prepend=place[:1])
        return cls(
            name=name,
            sensed=log.sensed.as_type(np.float64),
            rough=rough,
            alive=~log.fallen,
            distance=np.linalg.norm(step, axis=2).cumsum(axis=0),
        )


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
