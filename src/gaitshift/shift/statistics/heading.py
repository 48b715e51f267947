"""Whether the body keeps to its heading: a robot that stumbles is thrown off it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception


@dataclass(frozen=True, kw_only=True, eq=False)
class HeadingState:
    """What `HeadingWatch` remembers of N robots."""

    yaw: Float[np.ndarray, " N"]
    """Heading that is followed [rad]; NaN before the first step."""
    rate: Float[np.ndarray, " N"]
    """Yaw rate that is followed [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class HeadingWatch:
    """Follows heading and yaw rate, and says how far robots are off them.

    A critically damped follower of second order (an α-β filter): steady turns leave no error.
    """

    limit: float = 0.08
    """Who is further off than this is thrown off [rad]; ours: on `perlin:0.20` the trot is off by
    less than 0.05 in all but one step of a thousand, who stumbles at a step by 0.12 and more."""
    frequency: float = 2.0
    """How fast it follows [rad/s]."""

    def __post_init__(self) -> None:
        if not self.limit > 0.0 or not self.frequency > 0.0:
            raise GaitshiftError(
                f"limit and frequency must be above 0, got {self.limit:g} and {self.frequency:g}"
            )

    def start(self, n: int) -> HeadingState:
        """State of n robots whose heading is not known yet."""
        return HeadingState(yaw=np.full(n, np.nan), rate=np.zeros(n))

    def step(
        self, state: HeadingState, sensed: Proprioception
    ) -> tuple[HeadingState, Float[np.ndarray, " N"]]:
        """The heading after this step, and how far off each is [rad]; 0 without a heading."""
        if not sensed.has_heading:
            return state, np.zeros(len(state.yaw))
        period = sensed.period
        kept = np.exp(-self.frequency * period)
        expected = np.where(np.isnan(state.yaw), sensed.yaw, state.yaw + state.rate * period)
        off = np.remainder(sensed.yaw - expected + np.pi, 2.0 * np.pi) - np.pi
        after = HeadingState(
            yaw=expected + (1.0 - kept * kept) * off,
            rate=state.rate + (1.0 - kept) ** 2 / period * off,
        )
        return after, off
