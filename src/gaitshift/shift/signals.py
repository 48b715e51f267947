"""What a shift condition is fed in one control step: nothing that a real robot lacks."""

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.robot.motion import Motion


@dataclass(frozen=True, kw_only=True, eq=False)
class Signals:
    """N robots in one control step. The first three are asked for by all conditions.

    The others may be left out where the condition at hand does not look at them.
    """

    contact: Bool[np.ndarray, "N 4"]
    """Whether each foot touches."""
    foot_position_b: Float[np.ndarray, "N 4 3"]
    """Each foot from the base origin, body frame [m]: from joint angles alone."""
    gravity_b: Float[np.ndarray, "N 3"]
    """Unit vector along gravity, body frame: roll and pitch of the base."""
    time: float = 0.0
    """From the start [s]."""
    period: float = CONTROL_PERIOD
    """From the step before to this one [s]."""
    yaw: Float[np.ndarray, " N"] | None = None
    """Heading of the base [rad]; from any origin, and it may drift slowly."""
    velocity_b: Float[np.ndarray, "N 3"] | None = None
    """Velocity of the base origin, body frame [m/s]."""
    angular_velocity_b: Float[np.ndarray, "N 3"] | None = None
    """Angular velocity of the base, body frame [rad/s]."""
    power: Float[np.ndarray, " N"] | None = None
    """Σ|τ q̇| over the joints [W]."""
    speed_command: Float[np.ndarray, " N"] | None = None
    """Commanded forward speed [m/s]."""
    stride: Float[np.ndarray, " N"] | None = None
    """Commanded time of a stride [s]."""
    value: Float[np.ndarray, " N"] | None = None
    """What the policy's critic expects of here."""
    rough: Bool[np.ndarray, " N"] | None = None
    """Whether the ground under the robot is rough: known to an oracle alone."""

    @property
    def robots(self) -> int:
        """N."""
        return len(self.contact)

    def need(self, name: str, by: str) -> np.ndarray:
        """The optional signal `name`.

        Raises:
            GaitshiftError: it was left out, and the condition `by` looks at it.
        """
        value = getattr(self, name)
        if value is None:
            raise GaitshiftError(f"'{by}' needs the signal '{name}', which is missing")
        return value

    def of(self, ids: Int[np.ndarray, " K"]) -> "Signals":
        """Those of some of the robots, in the order of `ids`."""
        arrays: dict[str, Any] = {
            f.name: value[ids]
            for f in fields(self)
            if isinstance(value := getattr(self, f.name), np.ndarray)
        }
        return replace(self, **arrays)

    @classmethod
    def from_motion(
        cls,
        motion: Motion,
        *,
        time: float = 0.0,
        command: Command | None = None,
        value: Float[np.ndarray, " N"] | None = None,
        rough: Bool[np.ndarray, " N"] | None = None,
    ) -> "Signals":
        """Signals of robots in simulation, or of any `Motion`."""
        return cls(
            contact=motion.contact,
            foot_position_b=motion.foot_position_b,
            gravity_b=motion.gravity_b,
            time=time,
            yaw=motion.yaw,
            velocity_b=motion.base_linear_velocity_b,
            angular_velocity_b=motion.base_angular_velocity_b,
            power=np.abs(motion.joint_torque * motion.joint_velocity).sum(axis=1),
            speed_command=None if command is None else command.forward_speed,
            stride=None if command is None else 1.0 / command.stride_frequency,
            value=value,
            rough=rough,
        )
