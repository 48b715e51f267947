"""A rival statistic: the sliding speed of feet in contact."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SIX_LEAKS, SearchRange, check_positive


@dataclass(frozen=True, kw_only=True, eq=False)
class SlipState:
    """State of `Slip`."""

    position_b: Float[np.ndarray, "N 4 3"]
    """Feet a step ago [m]."""
    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""
    speed: Float[np.ndarray, "N 4"]
    """Running mean of the speed of each foot in contact [m/s]; NaN before any contact."""


@dataclass(frozen=True, kw_only=True)
class Slip:
    """Running mean of the speed of each foot in contact over the ground [m/s].

    v + ω × p + ṗ in the body frame: v is the estimated base velocity, ṗ the foot's velocity from
    two steps in contact.
    """

    window: float = 0.2
    """Time constant of the mean [s of contact]."""

    unit = "m/s"
    width = 4
    needs = ("velocity_b", "angular_velocity_b")
    search = SearchRange(
        low=0.02, high=2.0, leaks=SIX_LEAKS, note="speed of feet that ought to stand"
    )

    def __post_init__(self) -> None:
        check_positive(self, "window")

    def start(self, n: int) -> SlipState:
        """State of n robots before their first step."""
        return SlipState(
            position_b=np.zeros((n, 4, 3)),
            contact=np.zeros((n, 4), dtype=bool),
            speed=np.full((n, 4), np.nan),
        )

    def step(
        self, state: SlipState, sensed: Proprioception
    ) -> tuple[SlipState, Float[np.ndarray, "N 4"]]:
        """Mean speeds after this step."""
        velocity: np.ndarray = sensed.need("velocity_b", "slip")[:, None]
        angular: np.ndarray = sensed.need("angular_velocity_b", "slip")[:, None]
        position = sensed.foot_position_b
        own = (position - state.position_b) / sensed.period
        speed: np.ndarray = np.linalg.norm(velocity + np.cross(angular, position) + own, axis=2)
        share = min(1.0, sensed.period / self.window)
        mean = state.speed + share * (speed - state.speed)
        mean = np.where(np.isnan(state.speed), speed, mean)
        mean = np.where(sensed.contact & state.contact, mean, state.speed)
        return SlipState(position_b=position, contact=sensed.contact, speed=mean), mean
