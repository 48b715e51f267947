"""Contacts of feet without bounces, gaps and false touches."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.data import check_ranges


@dataclass(frozen=True, kw_only=True, eq=False)
class ContactState:
    """State of `ContactFilter` for N robots."""

    down: Bool[np.ndarray, "N 4"]
    """Which feet stand, by the filter."""
    differs: Float[np.ndarray, "N 4"]
    """Time for which each measured contact has been another [s]."""


@dataclass(frozen=True, kw_only=True)
class ContactFilter:
    """A foot stands, or swings, when its contact has said so for long enough.

    Force sensors miss contacts for a step or two and feel some in the air. Both times 0: contacts
    as they are measured.
    """

    least_stance: float = 0.0
    """A foot that is felt for less time does not stand [s]."""
    least_swing: float = 0.0
    """A foot that is not felt for less time has bounced: it still stands [s]."""

    def __post_init__(self) -> None:
        check_ranges(self, least_stance=(0.0, 1.0), least_swing=(0.0, 1.0))

    def start(self, n: int) -> ContactState:
        """State of n robots in the air."""
        return ContactState(down=np.zeros((n, 4), dtype=bool), differs=np.zeros((n, 4)))

    def step(
        self, state: ContactState, contact: Bool[np.ndarray, "N 4"], period: float
    ) -> ContactState:
        """State after a step of `period` [s] that ends with these contacts."""
        other = contact != state.down
        differs = np.where(other, state.differs + period, 0.0)
        least = np.where(state.down, self.least_swing, self.least_stance)
        turns = other & (differs > least - 1e-9)
        return ContactState(down=state.down ^ turns, differs=np.where(turns, 0.0, differs))
