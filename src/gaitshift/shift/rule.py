"""The paper's counter k over any statistic: how it grows, and when it fires."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD

WHENS = ("above", "below")
"""What a rule counts: numbers above α, as on rough ground, or steps with all of them below."""

_ROUNDING = 1e-9
"""Times are multiples of a control step, give or take this [s]."""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """k grows by ε, falls by a leak, and fires above β (paper III-E, Algorithm 1).

    "above": k grows by ε for each of the statistic's numbers above α, the paper's rule. "below": it
    grows by ε once at each step at which all of them are below α, the way back (IV-C). The paper
    prints that one "∀ i,j" and no pseudocode; it is read as one statement about the step. Counted
    number by number, k would climb on rough ground too, where some two feet nearly always agree.
    A number that is NaN is neither above nor below.
    """

    when: Literal["above", "below"] = "above"
    """What it counts."""
    alpha: float
    """α, in the unit of the statistic."""
    beta: float
    """β [counts], fire when k exceeds it."""
    epsilon: float = 1.0
    """ε [counts], increment of k (III-E: one, or in general some small number)."""
    leak: float = 0.0
    """What k loses in each step, not below 0 [counts]; ours: the paper's k never shrinks."""
    hold: float = 0.0
    """Least time in a gait before the rule fires [s]; ours."""

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "epsilon", "leak", "hold"):
            value: float = getattr(self, name)
            lowest = "0 or more" if name in ("beta", "leak", "hold") else "above 0"
            good = value >= 0.0 if lowest == "0 or more" else value > 0.0
            if not (math.isfinite(value) and good):
                raise GaitshiftError(f"{name} must be {lowest} and finite, got {value}")
        if self.when not in WHENS:
            raise GaitshiftError(f"when must be {' or '.join(WHENS)}, got {self.when!r}")

    def count(
        self, values: Float[np.ndarray, "N M"], factor: Float[np.ndarray, " N"] | float = 1.0
    ) -> Int[np.ndarray, " N"]:
        """How many times ε k grows; `factor` is a factor on α, by which it is modified online."""
        alpha = np.asarray(self.alpha * factor).reshape(-1, 1)
        if self.when == "above":
            return np.count_nonzero(values > alpha, axis=1)
        return np.all(values < alpha, axis=1).astype(np.int64)

    def step(
        self,
        k: Float[np.ndarray, " N"],
        values: Float[np.ndarray, "N M"],
        factor: Float[np.ndarray, " N"] | float = 1.0,
    ) -> Float[np.ndarray, " N"]:
        """Counter k after one control step."""
        return np.maximum(k + (self.epsilon * self.count(values, factor) - self.leak), 0.0)

    def fires(
        self, k: Float[np.ndarray, " N"], time_in_gait: Float[np.ndarray, " N"]
    ) -> Bool[np.ndarray, " N"]:
        """Whether each robot is to shift: k is above β, and it is in its gait [s] long enough."""
        return (k > self.beta) & (time_in_gait > self.hold - _ROUNDING)

    def delay(self, counts: float, period: float = CONTROL_PERIOD) -> float:
        """Time from k = 0 to firing [s] where each step, of `period` [s], has this many counts.

        Infinite where k does not rise.
        """
        rise = self.epsilon * counts - self.leak
        return math.inf if rise <= 0.0 else period * (math.floor(self.beta / rise) + 1)

    def soonest(self, width: int, period: float = CONTROL_PERIOD) -> float:
        """What β is in time [s]: `delay` where all of a statistic's `width` values count."""
        return self.delay(width if self.when == "above" else 1, period)
