"""The paper's counter k over any statistic: how it grows, when it fires, and α modified online."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.state import Proprioception

WHENS = ("above", "below")
"""What a rule counts: values above α, as on rough ground, or steps with all values below α."""

_ROUNDING = 1e-9
"""Times are multiples of a control step, give or take this [s]."""


@dataclass(frozen=True, kw_only=True)
class Rule:
    """k grows by ε, falls by a leak, and fires above β (paper III-E, Algorithm 1).

    "above": k grows by ε for each of the statistic's values above α, the paper's rule. "below": k
    grows by ε once per step in which all values are below α, the way back (IV-C). The paper gives
    "∀ i,j" and no pseudocode for it, which we read as one condition on the step. If each value
    counted, k would grow on rough ground too, where two feet nearly always have similar heights.
    A NaN value is neither above nor below.
    """

    when: Literal["above", "below"] = "above"
    """What the rule counts."""
    alpha: float
    """α, in the unit of the statistic."""
    beta: float
    """β [counts]: the rule fires when k exceeds it."""
    epsilon: float = 1.0
    """ε [counts], increment of k (III-E: one, or in general some small number)."""
    leak: float = 0.0
    """Decrease of k in each step, not below 0 [counts]; ours: the paper's k never decreases."""
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
        """Number of ε by which k grows; `factor` multiplies α, to modify it online."""
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
        """Whether each robot shifts: k is above β, and its time in the gait [s] is long enough."""
        return (k > self.beta) & (time_in_gait > self.hold - _ROUNDING)

    def delay(self, counts: float, period: float = CONTROL_PERIOD) -> float:
        """Time from k = 0 to firing [s] where each step, of `period` [s], has this many counts.

        Infinite where k does not rise.
        """
        rise = self.epsilon * counts - self.leak
        return math.inf if rise <= 0.0 else period * (math.floor(self.beta / rise) + 1)

    def soonest(self, width: int, period: float = CONTROL_PERIOD) -> float:
        """Shortest time to exceed β [s]: `delay` where all `width` values of a statistic count."""
        return self.delay(width if self.when == "above" else 1, period)


QUANTITIES = ("speed", "time")
"""Quantities on which α may depend: the commanded forward speed [m/s], or the time [s]."""


@dataclass(frozen=True, kw_only=True)
class Modulation:
    """A factor on α, linear between given points and constant beyond them."""

    of: Literal["speed", "time"]
    """The quantity on which it depends."""
    points: tuple[tuple[float, float], ...]
    """Pairs of a speed [m/s] or time [s], rising, and the factor there."""

    def __post_init__(self) -> None:
        if self.of not in QUANTITIES:
            raise GaitshiftError(f"α over: 'of' must be {' or '.join(QUANTITIES)}, got {self.of!r}")
        if not self.points or any(b[0] <= a[0] for a, b in pairwise(self.points)):
            raise GaitshiftError(
                f"α over {self.of}: points must be pairs with rising {self.of}s, such as "
                f"[[0.4, 0.8], [1.2, 1.0]], got {list(map(list, self.points))}"
            )
        if not all(np.isfinite(x) and factor > 0 for x, factor in self.points):
            raise GaitshiftError(
                f"α over {self.of}: factors must be above 0 and {self.of}s finite, got "
                f"{list(map(list, self.points))}"
            )

    def factor(self, sensed: Proprioception) -> Float[np.ndarray, " N"]:
        """Present factor on each robot's α."""
        at, factors = zip(*self.points, strict=True)
        if self.of == "time":
            return np.full(len(sensed.contact), float(np.interp(sensed.time, at, factors)))
        command: np.ndarray = sensed.need("forward_speed_command", "α over speed")
        return np.interp(command, at, factors)
