"""The oracle, a reference for conditions: it reads the true roughness of the ground."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.shift.statistic import SearchRange


@dataclass(frozen=True, kw_only=True)
class Oracle:
    """1 where the ground under the robot is rough, 0 where not.

    It is not a `Statistic`, because it reads the truth, which a robot does not have.
    """

    unit = ""
    width = 1
    needs = ()
    search = SearchRange(low=0.4, high=0.6, leaks=(0.0,), note="knows the true ground: a reference")

    def start(self, n: int) -> None:
        """No memory."""

    def values(self, rough: Bool[np.ndarray, "*batch"]) -> Float[np.ndarray, "*batch 1"]:
        """1 where `rough`, 0 elsewhere."""
        return rough.astype(np.float64)[..., None]
