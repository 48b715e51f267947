"""A statistic for gait graphs: the commanded forward speed."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.robot.state import Proprioception


@dataclass(frozen=True, kw_only=True)
class SpeedCommand:
    """The commanded forward speed [m/s]."""

    unit = "m/s"
    width = 1
    needs = ("forward_speed_command",)
    search = None

    def start(self, n: int) -> None:
        """No memory."""

    def step(self, state: None, sensed: Proprioception) -> tuple[None, Float[np.ndarray, "N 1"]]:
        """The command of this step."""
        return None, sensed.need("forward_speed_command", "speed")[:, None]
