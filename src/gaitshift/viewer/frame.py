"""What a page shows at one instant, and over the last seconds."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.log import Log
from gaitshift.motion import rotation_of

WINDOW = 8.0
"""Charts show this much of the past [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """N robots at one instant."""

    time: float
    """Since the start [s]."""
    qpos: Float[np.ndarray, "N 19"]
    """MuJoCo's positions."""
    contact: Bool[np.ndarray, "N 4"]
    """Whether each foot touches."""
    touch_w: Float[np.ndarray, "N 4 3"]
    """Where each foot touched last, world frame [m]; NaN before."""
    foot_position_w: Float[np.ndarray, "N 4 3"]
    """Lowest point of each foot [m]."""
    foot_height: Float[np.ndarray, "N 4"]
    """The condition's h_i [m]."""
    k: Float[np.ndarray, " N"]
    """The counter of the edge that is nearest to firing."""
    threshold: Float[np.ndarray, " N"]
    """The β that it is held against; 0 where nothing counts."""
    gait: Int[np.ndarray, " N"]
    """Index of the gait."""
    machine_state: Int[np.ndarray, " N"]
    """State of its machine."""
    speed: Float[np.ndarray, " N"]
    """Velocity along the base's x axis [m/s]."""
    fallen: Bool[np.ndarray, " N"]
    """Whether the robot has fallen."""


def last_touches(
    before: Float[np.ndarray, "N 4 3"],
    contact: Bool[np.ndarray, "N 4"],
    foot_position_w: Float[np.ndarray, "N 4 3"],
) -> Float[np.ndarray, "N 4 3"]:
    """Where each foot touched last, after a step with these contacts."""
    return np.where(contact[..., None], foot_position_w, before)


def frames_of(log: Log, every: int) -> list[Frame]:
    """The entries of a log, one of `every`."""
    n = log.k.shape[1]
    quaternion = log.qpos[..., 3:7].astype(float)
    rotation = rotation_of(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True))
    speed = np.einsum("tni,tni->tn", rotation[..., 0], log.qvel[..., :3].astype(float))
    touch, frames = np.full((n, 4, 3), np.nan), list[Frame]()
    for t in range(len(log.time)):
        feet = log.foot_position_w[t].astype(float)
        touch = last_touches(touch, log.contact[t], feet)
        if t % every:
            continue
        frames.append(
            Frame(
                time=float(log.time[t]),
                qpos=log.qpos[t].astype(float),
                contact=log.contact[t],
                touch_w=touch,
                foot_position_w=feet,
                foot_height=log.foot_height[t].astype(float),
                k=log.k[t],
                threshold=log.threshold[t],
                gait=log.gait[t].astype(int),
                machine_state=log.machine_state[t].astype(int),
                speed=speed[t],
                fallen=log.fallen[t],
            )
        )
    return frames


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
        return np.array([getattr(frame, name)[self.robot] for frame in self._frames])
