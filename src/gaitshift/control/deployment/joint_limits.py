"""Joint targets within a robot's joint ranges and the torque limit of its motors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.control.deployment.layout import MOST_TARGET
from gaitshift.robot.description import Robot


@dataclass(frozen=True, kw_only=True, eq=False)
class JointLimits:
    """The limits of one robot's joints."""

    low: Float[np.ndarray, " 12"]
    """Least angles [rad]."""
    high: Float[np.ndarray, " 12"]
    """Greatest angles [rad]."""
    effort: float
    """Largest torque [N·m]."""

    @classmethod
    def of(cls, robot: Robot) -> "JointLimits":
        """Those of a robot's description."""
        low, high = np.array(robot.joint_range).T
        return cls(low=low, high=high, effort=robot.motor.torque_limit)

    def clipped(
        self,
        target: Float[np.ndarray, " 12"],
        position: Float[np.ndarray, " 12"],
        velocity: Float[np.ndarray, " 12"],
        kp: float,
        kd: float,
    ) -> Float[np.ndarray, " 12"]:
        """Targets nearest to these for which |kp (target - q) - kd q̇| is within the torque limit.

        They are within the joint ranges too, but where a joint is so far outside of its range, or
        so fast, that only a target outside keeps the torque. Targets within both limits keep their
        bits. `position` [rad] and `velocity` [rad/s] are the newest that are known.
        """
        kept = np.clip(target, self.low, self.high)
        if kp > 0.0:
            centre, reach = position + kd / kp * velocity, self.effort / kp
            kept = np.clip(kept, centre - reach, centre + reach)
        return np.clip(kept, -MOST_TARGET, MOST_TARGET)
