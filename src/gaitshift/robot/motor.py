"""A joint's motor: how much torque it gives at which speed, and what that costs.

The model is that of a DC motor behind a gear, seen from the joint: V = R I + K ω and τ = K I. Two
figures describe it, the torque at rest and the speed without load at full voltage. Between them the
greatest torque falls in a straight line, and the drive cuts it off at its own limit.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.data import check_ranges
from gaitshift.errors import GaitshiftError

if TYPE_CHECKING:
    import mujoco

AT_LIMIT = 0.99
"""Share of its greatest torque from which a motor counts as saturated; ours: the torque of a log is
that of the last physics step, up to 2.5 ms before its speed."""


@dataclass(frozen=True, kw_only=True)
class Motor:
    """The motors of a robot, all twelve alike, with their gears."""

    torque_limit: float
    """Largest torque, cut off by the drive [N·m]."""
    no_load_speed: float
    """Speed at which full voltage gives no torque [rad/s]."""
    stall_torque: float
    """Torque that full voltage would give at rest, at least `torque_limit` [N·m]."""
    friction: float = 0.0
    """Dry friction of the joint, in addition to that of the robot's model [N·m]."""
    armature: float = 0.0
    """Inertia of the rotor times the gear ratio squared, in addition to that of the robot's model
    [kg·m²]."""
    thermal_resistance: float = 0.0
    """From the windings to the air [K/W]; 0: unknown."""

    def __post_init__(self) -> None:
        # Ours: far beyond any robot that walks.
        check_ranges(
            self,
            torque_limit=(0.01, 10_000.0),
            no_load_speed=(0.1, 1000.0),
            stall_torque=(0.01, 100_000.0),
            friction=(0.0, 1000.0),
            armature=(0.0, 100.0),
            thermal_resistance=(0.0, 1000.0),
        )
        if self.stall_torque < self.torque_limit:
            raise GaitshiftError(
                f"stall_torque must be at least torque_limit ({self.torque_limit:g} N·m), got "
                f"{self.stall_torque:g}"
            )

    @cached_property
    def heat(self) -> float:
        """Power lost as heat per torque squared, R/K² [W/(N·m)²].

        With full voltage V, the torque at rest is K V/R and the speed without load V/K, so that
        R/K² is their ratio.
        """
        return self.no_load_speed / self.stall_torque

    def torque_range(
        self, speed: Float[np.ndarray, "*batch"]
    ) -> tuple[Float[np.ndarray, "*batch"], Float[np.ndarray, "*batch"]]:
        """Least and greatest torque [N·m] at joint speeds [rad/s].

        Beyond the speed without load the motor brakes, at full voltage, by the same line.
        """
        share = speed / self.no_load_speed
        low, high = (self.stall_torque * (sign - share) for sign in (-1.0, 1.0))
        limit = self.torque_limit
        return np.clip(low, -limit, limit), np.clip(high, -limit, limit)

    def is_saturated(
        self, torque: Float[np.ndarray, "*batch"], speed: Float[np.ndarray, "*batch"]
    ) -> Bool[np.ndarray, "*batch"]:
        """Whether a torque [N·m] is the greatest or least that the motor gives at a speed [rad/s].

        Torques within a hundredth of the limit count as well (`AT_LIMIT`).
        """
        low, high = self.torque_range(speed)
        slack = (1.0 - AT_LIMIT) * self.torque_limit
        return (torque >= high - slack) | (torque <= low + slack)

    def electrical_power(
        self, torque: Float[np.ndarray, "*batch 12"], speed: Float[np.ndarray, "*batch 12"]
    ) -> Float[np.ndarray, "*batch"]:
        """Electrical power Σ max(τ q̇ + R/K² τ², 0) over the joints [W].

        It is V I of each motor. Power that a braking motor returns is lost, as the drives do not
        store it.
        """
        return np.maximum(torque * speed + self.heat * torque * torque, 0.0).sum(axis=-1)

    def winding_rise(self, torque: Float[np.ndarray, "*batch 12"]) -> float | None:
        """Temperature of the hottest windings over that of the air, in the long run [K].

        It is that at which the mean heat of these torques [N·m] flows off; None: not known.
        """
        if self.thermal_resistance == 0:
            return None
        heat = self.heat * np.square(torque).reshape(-1, torque.shape[-1]).mean(axis=0, dtype=float)
        return float(self.thermal_resistance * heat.max())

    def drive(self, actuator: "mujoco.MjsActuator", *, kp: float, kd: float) -> None:
        """Makes an actuator of a model this motor, with a position controller.

        The torque is kp · (target - q) - kd · q̇ within `torque_range`, by MuJoCo's own DC motor: K
        is 1 N·m/A, so that the full voltage is the speed without load.
        """
        import mujoco

        actuator.set_to_dcmotor(
            motorconst=(1.0, 1.0),
            resistance=self.heat,
            saturation=(self.torque_limit, 0.0, 0.0),
            controller=(kp, 0.0, kd, 0.0, 0.0, self.no_load_speed),
            ctrlspec=int(mujoco.mjtCtrlInput.mjINPUT_POS),
        )
