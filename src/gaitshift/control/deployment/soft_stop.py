"""The soft stop: joints go where they are, and their stiffness fades to pure damping."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from gaitshift.robot.description import Gains

DURATION = 1.0
"""Time in which the stiffness fades to 0 [s]; ours: a robot sinks in about this time by itself."""

SPEED = 2.0
"""Greatest speed of a target during the stop [rad/s]; ours: slower than a leg swings."""


@dataclass(frozen=True, kw_only=True, eq=False)
class SoftStop:
    """A stop that begins at time 0. The damping of the joints stays, so energy only leaves."""

    start: Float[np.ndarray, " 12"]
    """The last targets before the stop [rad]."""
    hold: Float[np.ndarray, " 12"]
    """The joint angles at its start, where the targets go [rad]."""
    gains: Gains
    """Those before the stop."""

    def target(self, time: float) -> Float[np.ndarray, " 12"]:
        """Joint targets so long after the start [rad]: at most `SPEED` · time from the first."""
        return self.start + np.clip(self.hold - self.start, -SPEED * time, SPEED * time)

    def kp(self, time: float) -> float:
        """Stiffness so long after the start [N·m/rad]: falls evenly to 0 over `DURATION`."""
        return self.gains.kp * min(1.0, max(0.0, 1.0 - time / DURATION))
