"""Deviation of the body from its heading, which is large when the robot stumbles."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception


@dataclass(frozen=True, kw_only=True, eq=False)
class HeadingState:
    """State of `HeadingWatch` for N robots."""

    yaw: Float[np.ndarray, " N"]
    """Filtered heading [rad]; NaN before the first step."""
    rate: Float[np.ndarray, " N"]
    """Filtered yaw rate [rad/s]."""


@dataclass(frozen=True, kw_only=True)
class HeadingWatch:
    """Filters the heading, and measures how far robots deviate from it.

    It is a critically damped second-order filter (an α-β filter), without error in steady turns.
    """

    limit: float = 0.08
    """A robot with a larger deviation stumbles [rad]; ours: on `perlin:0.20` the trot deviates by
    less than 0.05 in all but one step of a thousand; one that stumbles at a step, by at least
    0.12."""
    frequency: float = 2.0
    """Natural frequency of the filter [rad/s]."""

    def __post_init__(self) -> None:
        if not self.limit > 0.0 or not self.frequency > 0.0:
            raise GaitshiftError(
                f"limit and frequency must be above 0, got {self.limit:g} and {self.frequency:g}"
            )

    def start(self, n: int) -> HeadingState:
        """State of n robots with unknown headings."""
        return HeadingState(yaw=np.full(n, np.nan), rate=np.zeros(n))

    def step(
        self, state: HeadingState, sensed: Proprioception
    ) -> tuple[HeadingState, Float[np.ndarray, " N"]]:
        """State after this step, and the deviation of each robot [rad]; 0 without a heading."""
        if not sensed.has_heading:
            return state, np.zeros(len(state.yaw))
        period = sensed.period
        decay = np.exp(-self.frequency * period)
        expected = np.where(np.isnan(state.yaw), sensed.yaw, state.yaw + state.rate * period)
        off = np.remainder(sensed.yaw - expected + np.pi, 2.0 * np.pi) - np.pi
        after = HeadingState(
            yaw=expected + (1.0 - decay * decay) * off,
            rate=state.rate + (1.0 - decay) ** 2 / period * off,
        )
        return after, off
