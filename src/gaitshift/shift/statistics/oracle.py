"""A point of reference: a condition that sees the ground."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.shift.signals import Signals


@dataclass(frozen=True, kw_only=True)
class Oracle:
    """1 where the ground under the robot is rough, 0 where not."""

    unit = ""
    width = 1
    needs = ("rough",)

    def start(self, n: int) -> None:
        """Nothing to remember."""

    def step(self, state: None, signals: Signals) -> tuple[None, Float[np.ndarray, "N 1"]]:
        """What the signal says."""
        return None, signals.need("rough", "oracle").astype(np.float64)[:, None]
