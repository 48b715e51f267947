"""A rival statistic: the variation of roll and pitch."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SearchRange, check_positive


@dataclass(frozen=True, kw_only=True)
class AttitudeVariance:
    """Standard deviation of roll and pitch together about their running means [rad].

    NaN for the first window.
    """

    window: float = 1.0
    """Time constant of the means [s]."""

    unit = "rad"
    width = 1
    needs = ()
    search = SearchRange(low=0.003, high=0.3, note="deviation of roll and pitch")

    def __post_init__(self) -> None:
        check_positive(self, "window")

    def start(self, n: int) -> Float[np.ndarray, "N 5"]:
        """Sum of weights, means of roll and pitch, and of their squared distances from them."""
        return np.zeros((n, 5))

    def step(
        self, state: Float[np.ndarray, "N 5"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 5"], Float[np.ndarray, "N 1"]]:
        """Means after this step, and the deviation."""
        x, y, z = sensed.gravity_b.T
        angle = np.stack([np.arctan2(-y, -z), np.arctan2(x, np.hypot(y, z))], axis=1)
        share = sensed.period / self.window
        weight = state[:, :1] + share * (1.0 - state[:, :1])
        gain = share / weight  # a plain mean at first, then an exponential one
        off = angle - state[:, 1:3]
        mean = state[:, 1:3] + gain * off
        square = (1.0 - gain) * (state[:, 3:] + gain * off * off)
        value = np.sqrt(square.sum(axis=1, keepdims=True))
        after = np.concatenate([weight, mean, square], axis=1)
        return after, np.where(weight < 1.0 - np.exp(-1.0), np.nan, value)
