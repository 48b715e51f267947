"""A rival statistic: early or late touchdowns."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SIX_LEAKS, SearchRange


@dataclass(frozen=True, kw_only=True, eq=False)
class TimingState:
    """State of `ContactTiming`."""

    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""
    touchdown: Float[np.ndarray, "N 4"]
    """When each foot last came down [s]; NaN before that."""
    error: Float[np.ndarray, "N 4"]
    """Error of its last stride [s]; NaN before two touchdowns."""


@dataclass(frozen=True, kw_only=True)
class ContactTiming:
    """Difference between the last stride of each foot and the commanded stride [s].

    A stride lasts from touchdown to touchdown. The error of an overdue foot grows before its
    touchdown.
    """

    unit = "s"
    width = 4
    needs = ("stride_frequency_command",)
    search = SearchRange(
        low=0.005, high=0.5, leaks=SIX_LEAKS, note="strides shorter or longer than commanded"
    )

    def start(self, n: int) -> TimingState:
        """State of n robots before any touchdown."""
        return TimingState(
            contact=np.ones((n, 4), dtype=bool),
            touchdown=np.full((n, 4), np.nan),
            error=np.full((n, 4), np.nan),
        )

    def step(
        self, state: TimingState, sensed: Proprioception
    ) -> tuple[TimingState, Float[np.ndarray, "N 4"]]:
        """Errors after this step."""
        stride = 1.0 / sensed.need("stride_frequency_command", "contact_timing")[:, None]
        down = sensed.contact & ~state.contact
        since = sensed.time - state.touchdown
        error = np.where(down, np.abs(since - stride), state.error)
        touchdown = np.where(down, sensed.time, state.touchdown)
        after = TimingState(contact=sensed.contact, touchdown=touchdown, error=error)
        return after, np.fmax(error, sensed.time - touchdown - stride)
