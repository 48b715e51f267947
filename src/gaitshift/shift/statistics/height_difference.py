"""The paper's statistic: differences of the heights at which the feet last touched (III-E)."""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import LEG_PAIRS
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SIX_LEAKS, SearchRange
from gaitshift.shift.statistics.contacts import ContactFilter, ContactState

FRAMES = ("body", "gravity")
"""Axis of a foot's height: the body's z axis (paper III-E), or the vertical."""

_FIRST, _SECOND = np.array(LEG_PAIRS).T


@dataclass(frozen=True, kw_only=True, eq=False)
class TouchHeights:
    """State of `HeightDifference` for N robots."""

    height: Float[np.ndarray, "N 4"]
    """h of each foot [m]; NaN before its first touch."""
    feet: ContactState
    """Which feet stand."""


@dataclass(frozen=True, kw_only=True)
class HeightDifference:
    """|h_i − h_j| of the six unordered pairs of feet [m].

    h_i is the height of foot i relative to the base when it last touched. Ours, as the paper does
    not say: pairs with a foot that has not touched yet are NaN.
    """

    frame: Literal["body", "gravity"] = "gravity"
    """Axis of h: the body's z axis (paper III-E) or the vertical; ours: in the body frame pitch
    looks like terrain."""
    least_stance: float = 0.0
    """A foot that is felt for less time has not touched [s]; 0, as in the paper: contacts as they
    are measured."""

    unit = "m"
    width = len(LEG_PAIRS)
    needs = ()
    search = SearchRange(
        low=0.005,
        low_back=0.001,
        high=0.5,
        leaks=SIX_LEAKS,
        note="differences of foot heights along the vertical; a leak may be chosen",
    )

    def __post_init__(self) -> None:
        _ = self._filter
        if self.frame not in FRAMES:
            raise GaitshiftError(f"frame must be {' or '.join(FRAMES)}, got {self.frame!r}")

    @cached_property
    def _filter(self) -> ContactFilter:
        return ContactFilter(least_stance=self.least_stance)

    def start(self, n: int) -> TouchHeights:
        """State of n robots before any touch."""
        return TouchHeights(height=np.full((n, 4), np.nan), feet=self._filter.start(n))

    def step(
        self, state: TouchHeights, sensed: Proprioception
    ) -> tuple[TouchHeights, Float[np.ndarray, "N 6"]]:
        """Heights h after this step, and their differences by pair [m]."""
        now = sensed.foot_position_b[..., 2] if self.frame == "body" else sensed.foot_height
        feet = self._filter.step(state.feet, sensed.contact, sensed.period)
        height = np.where(feet.down, now, state.height)
        difference = np.abs(height.take(_FIRST, axis=1) - height.take(_SECOND, axis=1))
        return TouchHeights(height=height, feet=feet), difference
