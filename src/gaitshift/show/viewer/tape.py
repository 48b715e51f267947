"""The last seconds of a robot, for charts."""

from collections import deque
from collections.abc import Callable

import numpy as np

from gaitshift.show.geometry import Frame

_QUANTITIES: dict[str, Callable[[Frame], np.ndarray]] = {
    "contact": lambda frame: frame.step.sensed.contact,
    "touch_height": lambda frame: frame.touch_height,
    "speed": lambda frame: frame.step.truth.forward_speed,
    "k": lambda frame: frame.step.k,
    "threshold": lambda frame: frame.step.threshold,
    "gait": lambda frame: frame.step.gait,
    "machine_state": lambda frame: frame.step.machine_state,
}
"""What charts show, by name."""

WINDOW = 8.0
"""Charts show this much of the past [s]."""


class Tape:
    """The last seconds of one robot, for charts."""

    def __init__(self, robot: int = 0) -> None:
        self.robot = robot
        self._frames: deque[Frame] = deque()

    def add(self, frame: Frame) -> None:
        """Takes in a frame; what is older than the window, or comes later, is let go."""
        while self._frames and self._frames[-1].time >= frame.time:
            self._frames.pop()  # the run began anew, or the slider was moved back
        self._frames.append(frame)
        while self._frames[0].time < frame.time - WINDOW:
            self._frames.popleft()

    def clear(self) -> None:
        """Lets all of it go."""
        self._frames.clear()

    @property
    def last(self) -> Frame | None:
        """The newest frame."""
        return self._frames[-1] if self._frames else None

    def of(self, name: str) -> np.ndarray:
        """A quantity of the robot over the window, time first; of `time` itself: [s]."""
        if name == "time":
            return np.array([frame.time for frame in self._frames])
        return np.array([_QUANTITIES[name](frame)[self.robot] for frame in self._frames])
