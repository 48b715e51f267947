"""The paper's statistic: how the heights at which the feet last touched differ (III-E)."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import LEG_PAIRS
from gaitshift.shift.signals import Signals

FRAMES = ("body", "gravity")
"""Frames a foot's height can be taken in: see `height_in_frame`."""

_FIRST, _SECOND = np.array(LEG_PAIRS).T


@dataclass(frozen=True, kw_only=True)
class HeightDifference:
    """|h_i − h_j| of the six unordered pairs of feet [m].

    h_i is the height of foot i relative to the base when it last touched. Ours, where the paper is
    silent: a foot that has not touched yet takes part in no pair.
    """

    frame: Literal["body", "gravity"] = "gravity"
    """Frame of h, body (paper III-E) or gravity; ours: the body frame takes pitch for terrain."""

    unit = "m"
    width = len(LEG_PAIRS)
    needs = ()

    def __post_init__(self) -> None:
        if self.frame not in FRAMES:
            raise _unknown_frame(self.frame)

    def start(self, n: int) -> Float[np.ndarray, "N 4"]:
        """Heights h of n robots of which no foot has touched: NaN."""
        return np.full((n, 4), np.nan)

    def step(
        self, state: Float[np.ndarray, "N 4"], signals: Signals
    ) -> tuple[Float[np.ndarray, "N 4"], Float[np.ndarray, "N 6"]]:
        """Heights h after this step [m], and how its pairs differ."""
        now = height_in_frame(signals.foot_position_b, signals.gravity_b, self.frame)
        height = np.where(signals.contact, now, state)
        return height, np.abs(height.take(_FIRST, axis=1) - height.take(_SECOND, axis=1))


def height_in_frame(
    foot_position_b: Float[np.ndarray, "N 4 3"], gravity_b: Float[np.ndarray, "N 3"], frame: str
) -> Float[np.ndarray, "N 4"]:
    """Height [m] of each foot above the base origin (negative while below it), seen in `frame`.

    "body": along the body's own z axis (paper III-E). "gravity": along up, −p·g, at the base: roll
    and pitch are removed, and yaw does not enter.

    Raises:
        GaitshiftError: another frame.
    """
    x, y, z = (foot_position_b[:, :, axis] for axis in range(3))
    if frame == "body":
        return z.copy()
    if frame == "gravity":
        # Written out, for one robot to give the same bits alone and in a batch.
        return -(x * gravity_b[:, :1] + y * gravity_b[:, 1:2] + z * gravity_b[:, 2:])
    raise _unknown_frame(frame)


def _unknown_frame(frame: str) -> GaitshiftError:
    return GaitshiftError(f"frame must be {' or '.join(FRAMES)}, got {frame!r}")
