"""The input of identification: proprioception over a run, and where the ground was rough."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.lab.log import Log
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistics import Watched, watch

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

    def values(self, statistic: Watched) -> Float[np.ndarray, "T N M"]:
        """A statistic's values, computed step by step with the code that runs on a robot."""
        memory = statistic.start(self.robots)
        values = np.empty((len(self.rough), self.robots, statistic.width))
        for t, sensed in enumerate(self):
            memory, values[t] = watch(statistic, memory, sensed, self.rough[t])
        return values

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
