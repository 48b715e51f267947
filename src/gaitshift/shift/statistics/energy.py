"""A rival statistic: the cost of transport."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.state import GRAVITY, Proprioception
from gaitshift.shift.statistic import SearchRange, check_positive


@dataclass(frozen=True, kw_only=True)
class CostOfTransport:
    """Σ|τ q̇| / (m g v) over a running window; NaN for the first window."""

    window: float = 1.0
    """Time constant of the means of power and speed [s]."""
    mass: float = ANYMAL_B.mass
    """Mass of the robot [kg]; for another robot its `Robot.mass`."""
    least_speed: float = 0.1
    """Lower bound of the speed v [m/s]."""

    unit = ""
    width = 1
    needs = ("joint_torque", "joint_velocity", "velocity_b")
    search = SearchRange(low=0.1, high=10.0, note="power over weight and speed")

    def __post_init__(self) -> None:
        check_positive(self, "window", "mass", "least_speed")

    def start(self, n: int) -> Float[np.ndarray, "N 3"]:
        """Sum of weights, mean power [W] and mean forward speed [m/s] before the first step."""
        return np.zeros((n, 3))

    def step(
        self, state: Float[np.ndarray, "N 3"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 1"]]:
        """Means after this step, and the cost."""
        power = sensed.power
        speed = sensed.forward_speed
        now = np.stack([np.ones(len(power)), power, speed], axis=1)
        after = state + sensed.period / self.window * (now - state)
        weight, mean_power, mean_speed = after.T
        mean_speed = np.maximum(mean_speed / weight, self.least_speed)
        cost = mean_power / weight / (self.mass * GRAVITY * mean_speed)
        return after, np.where(weight < 1.0 - np.exp(-1.0), np.nan, cost)[:, None]
