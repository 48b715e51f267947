"""A statistic for gait graphs: how fast the robot is told to walk."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.shift.signals import Signals


@dataclass(frozen=True, kw_only=True)
class SpeedCommand:
    """The commanded forward speed [m/s]."""

    unit = "m/s"
    width = 1
    needs = ("speed_command",)

    def start(self, n: int) -> None:
        """Nothing to remember."""

    def step(self, state: None, signals: Signals) -> tuple[None, Float[np.ndarray, "N 1"]]:
        """What the signal says."""
        return None, signals.need("speed_command", "speed")[:, None]
