"""A rival statistic: how fast feet slide that ought to stand."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SIX_LEAKS, SearchRange, check_positive


@dataclass(frozen=True, kw_only=True, eq=False)
class SlipState:
    """What `Slip` remembers."""

    position_b: Float[np.ndarray, "N 4 3"]
    """Feet a step ago [m]."""
    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""
    speed: Float[np.ndarray, "N 4"]
    """Running mean of the speed of each foot while it touches [m/s]; NaN before that."""


@dataclass(frozen=True, kw_only=True)
class Slip:
    """Speed of each foot over the ground while it touches [m/s], a running mean.

    v + ω × p + ṗ in the body frame: base velocity from the robot's state estimation, the foot's own
    from two steps in which it touched. The mean forgets by e in `window` of contact.
    """

    window: float = 0.2
    """[s of contact]"""

    unit = "m/s"
    width = 4
    needs = ("velocity_b", "angular_velocity_b")
    search = SearchRange(
        low=0.02, high=2.0, leaks=SIX_LEAKS, note="speed of feet that ought to stand"
    )

    def __post_init__(self) -> None:
        check_positive(self, "window")

    def start(self, n: int) -> SlipState:
        """State of n robots that have not been seen."""
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
