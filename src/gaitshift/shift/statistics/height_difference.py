"""The paper's statistic: differences of the heights at which the feet last touched (III-E)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import LEG_PAIRS
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SIX_LEAKS, SearchRange

FRAMES = ("body", "gravity")
"""Axis of a foot's height: the body's z axis (paper III-E), or the vertical."""

_FIRST, _SECOND = np.array(LEG_PAIRS).T


@dataclass(frozen=True, kw_only=True)
class HeightDifference:
    """|h_i − h_j| of the six unordered pairs of feet [m].

    h_i is the height of foot i relative to the base when it last touched. Ours, as the paper does
    not say: pairs with a foot that has not touched yet are NaN.
    """

    frame: Literal["body", "gravity"] = "gravity"
    """Axis of h: the body's z axis (paper III-E) or the vertical; ours: in the body frame pitch
    looks like terrain."""

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
        if self.frame not in FRAMES:
            raise GaitshiftError(f"frame must be {' or '.join(FRAMES)}, got {self.frame!r}")

    def start(self, n: int) -> Float[np.ndarray, "N 4"]:
        """Heights h of n robots before any touch: NaN."""
        return np.full((n, 4), np.nan)

    def step(
        self, state: Float[np.ndarray, "N 4"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 4"], Float[np.ndarray, "N 6"]]:
        """Heights h after this step, and their differences by pair [m]."""
        now = sensed.foot_position_b[..., 2] if self.frame == "body" else sensed.foot_height
        height = np.where(sensed.contact, now, state)
        return height, np.abs(height.take(_FIRST, axis=1) - height.take(_SECOND, axis=1))
