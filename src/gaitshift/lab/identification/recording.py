"""What identification reads: signals of N robots over T steps, and where the ground was rough."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.lab.log import Log
from gaitshift.robot.motion import rotation_of
from gaitshift.shift import AnyStatistic, Signals

Way = Literal["rough", "flat"]
"""What is to be noticed: rough ground ahead, or, on the way back, that it has ended."""

_PER_STEP = (
    "yaw",
    "velocity_b",
    "angular_velocity_b",
    "power",
    "speed_command",
    "stride",
    "value",
    "rough",
)
"""Optional signals, each with a row a step."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recording:
    """T steps of N robots, as conditions are fed with, and the truth that they are judged by."""

    name: str
    """Of the file, or of the course."""
    time: Float[np.ndarray, " T"]
    """[s]"""
    contact: Bool[np.ndarray, "T N 4"]
    """Whether each foot touches."""
    foot_position_b: Float[np.ndarray, "T N 4 3"]
    """Each foot from the base origin, body frame [m]."""
    gravity_b: Float[np.ndarray, "T N 3"]
    """Unit vector along gravity, body frame."""
    rough: Bool[np.ndarray, "T N"]
    """Whether the ground under the robot is rough: the truth."""
    alive: Bool[np.ndarray, "T N"]
    """Whether the robot is on its feet; what comes after a fall does not count."""
    distance: Float[np.ndarray, "T N"]
    """Way that each robot has come since the start [m]."""
    yaw: Float[np.ndarray, "T N"] | None = None
    """Heading of the base [rad]."""
    velocity_b: Float[np.ndarray, "T N 3"] | None = None
    """Velocity of the base origin, body frame [m/s]."""
    angular_velocity_b: Float[np.ndarray, "T N 3"] | None = None
    """Angular velocity of the base, body frame [rad/s]."""
    power: Float[np.ndarray, "T N"] | None = None
    """Σ|τ q̇| over the joints [W]."""
    speed_command: Float[np.ndarray, "T N"] | None = None
    """Commanded forward speed [m/s]."""
    stride: Float[np.ndarray, "T N"] | None = None
    """Commanded time of a stride [s]."""
    value: Float[np.ndarray, "T N"] | None = None
    """What the policy's critic expects."""

    @property
    def period(self) -> float:
        """One control step [s]."""
        return float(self.time[1] - self.time[0]) if len(self.time) > 1 else 0.01

    @property
    def robots(self) -> int:
        """N."""
        return self.contact.shape[1]

    def __iter__(self) -> Iterator[Signals]:
        """The signals, step by step, as a robot would have had them."""
        optional: dict[str, Any] = {name: getattr(self, name) for name in _PER_STEP}
        given = {name: rows for name, rows in optional.items() if rows is not None}
        for t in range(len(self.time)):
            yield Signals(
                contact=self.contact[t],
                foot_position_b=self.foot_position_b[t],
                gravity_b=self.gravity_b[t],
                time=float(self.time[t]),
                period=self.period,
                **{name: rows[t] for name, rows in given.items()},
            )

    def values(self, statistic: AnyStatistic) -> Float[np.ndarray, "T N M"]:
        """What a statistic makes of it: the very code that runs on a robot, step by step."""
        state = statistic.start(self.robots)
        seen = np.empty((len(self.time), self.robots, statistic.width))
        for t, signals in enumerate(self):
            state, seen[t] = statistic.step(state, signals)
        return seen

    @classmethod
    def from_log(cls, log: Log, name: str, rough: Bool[np.ndarray, "T N"]) -> "Recording":
        """A recording of one of our logs."""
        qpos, qvel = log.qpos.astype(np.float64), log.qvel.astype(np.float64)
        quaternion = qpos[..., 3:7]  # single precision: not quite of length 1
        rotation = rotation_of(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True))
        feet = log.foot_position_w.astype(np.float64) - qpos[:, :, None, :3]
        step = np.diff(qpos[..., :2], axis=0, prepend=qpos[:1, :, :2])
        return cls(
            name=name,
            time=log.time,
            contact=log.contact,
            foot_position_b=np.einsum("tnij,tnli->tnlj", rotation, feet),
            gravity_b=-rotation[..., 2, :],
            rough=rough,
            alive=~log.fallen,
            distance=np.linalg.norm(step, axis=2).cumsum(axis=0),
            yaw=np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0]),
            velocity_b=np.einsum("tnij,tni->tnj", rotation, qvel[..., :3]),
            angular_velocity_b=qvel[..., 3:6],
            power=np.abs(log.torque * qvel[..., 6:]).sum(axis=2),
            speed_command=log.command[..., 0],
            stride=1.0 / log.command[..., 2],
            value=None if log.value is None else log.value.astype(np.float64),
        )
