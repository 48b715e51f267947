"""The swing of each foot, from the change of state that lifts it to its touchdown."""

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.gait import RewardMachine, Step


class Swings:
    """The swings of N robots' feet: their heights, and touchdowns out of place.

    At the start of an episode every foot may land once, and its swing counts as high enough.
    """

    def __init__(self, machine: RewardMachine, n: int) -> None:
        self._machine = machine
        self._height: Float[np.ndarray, "N 4"] = np.empty((n, 4))
        self._touches: Bool[np.ndarray, "N 4"] = np.empty((n, 4), dtype=bool)
        self._may_land: Bool[np.ndarray, "N 4"] = np.empty((n, 4), dtype=bool)
        self.restart(np.arange(n))

    def restart(self, ids: Int[np.ndarray, " K"]) -> None:
        """Episodes of these robots begin."""
        self._height[ids] = np.inf
        self._touches[ids] = False
        self._may_land[ids] = True

    def see(
        self,
        left: Int[np.ndarray, " N"],
        step: Step,
        contact: Bool[np.ndarray, "N 4"],
        clearance: Float[np.ndarray, "N 4"],
        factor: float = 1.0,
    ) -> tuple[Int[np.ndarray, " N"], Float[np.ndarray, " N"]]:
        """Number of touchdowns out of place, and share of the swing height that was reached.

        A touchdown is in place if it is the first since the machine lifted the foot, and if the
        state or the next one has the foot in its stance. The share is that of the edge taken, 1
        without an edge.

        Args:
            left: state of the machine before the step.
            step: result of the machine's step.
            contact: which feet are down after the step.
            clearance: of the feet over the ground [m].
            factor: on the machine's swing heights.
        """
        lands = contact & ~self._touches
        in_place = lands & self._may_land & self._machine.expected(left)
        height = np.fmax(self._height, clearance)
        lifted = self._machine.lifted(left, step.state)
        self._touches = contact.copy()
        self._may_land = (self._may_land & ~in_place) | lifted
        self._height = np.where(lifted, clearance, height)
        return (lands & ~in_place).sum(axis=1), self._machine.swing_share(
            step.edge, height / factor
        )
