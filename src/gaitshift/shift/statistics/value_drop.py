"""A rival statistic: the drop of the value of the policy's critic."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SearchRange, check_positive


@dataclass(frozen=True, kw_only=True)
class ValueDrop:
    """Slow running mean of the critic's value less the fast one; NaN for the first slow window."""

    fast: float = 0.5
    """Window of the fast mean [s]: a stride, over which values oscillate."""
    slow: float = 4.0
    """Window of the slow mean [s]."""

    unit = ""
    width = 1
    needs = ("value",)
    search = SearchRange(low=0.01, high=100.0, note="the critic expects less than it did")

    def __post_init__(self) -> None:
        check_positive(self, "fast", "slow")

    def start(self, n: int) -> Float[np.ndarray, "N 3"]:
        """Fast mean, slow mean, and number of steps."""
        return np.zeros((n, 3))

    def step(
        self, state: Float[np.ndarray, "N 3"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 1"]]:
        """Means after this step, and the drop."""
        value = sensed.need("value", "value_drop")
        fast, slow, seen = state.T
        seen = seen + 1.0
        fast = fast + np.maximum(1.0 / seen, sensed.period / self.fast) * (value - fast)
        slow = slow + np.maximum(1.0 / seen, sensed.period / self.slow) * (value - slow)
        drop = np.where(seen * sensed.period < self.slow, np.nan, slow - fast)
        return np.stack([fast, slow, seen], axis=1), drop[:, None]
