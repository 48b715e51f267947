"""Prediction errors of touchdown heights: new ground against a plane through earlier touches."""

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SearchRange
from gaitshift.shift.statistics.heading import HeadingState, HeadingWatch
from gaitshift.shift.statistics.touches import Touches, TouchState, fit_plane

LEAST = 6
"""Least number of earlier touches for a plane."""

AHEAD = 0.1
"""Ground is new where no earlier touch lies further ahead by more than this [m]."""

RIDGE = 0.02
"""Ridge of the fit [m²]: it keeps a plane through touches near one line level across the line."""

LAG = 3
"""An error is compared with the one before it and the one this many before it. In a trot, whose
front feet alternate, both are of the other foot, half a stride and one and a half strides ago."""

FROM_MEAN = math.sqrt(math.pi) / 2.0
"""Standard deviation σ of normal errors over the mean size of their differences, which is 2σ/√π."""

STEEP = 0.08
"""Rise over run above which ground is steep: a slope of 5°; ours: noise of 10 cm seldom is."""

STEEP_FOR = 15.0
"""Decay constant of the memory of steep ground [touchdowns]."""

STEADY = 0.0055
"""Heading deviation of normal walking [rad]; ours: that of a trot on flat ground."""

ASIDE_WINDOW = 1.0
"""Time constant of the root mean square of the heading deviation [s]."""

_HEADING = HeadingWatch()


@dataclass(frozen=True, kw_only=True, eq=False)
class SurpriseState:
    """State of `TouchdownSurprise`."""

    touches: TouchState
    """The touches of all feet."""
    heading: HeadingState
    """The filtered heading."""
    aside: Float[np.ndarray, " N"]
    """Mean square of the deviation from it [rad²]."""
    error: Float[np.ndarray, "N 4"]
    """The last errors, the latest first [m]; NaN before."""
    change: Float[np.ndarray, "N 2"]
    """Mean sizes of their changes, over one touchdown and over `LAG` [m]."""
    steep: Float[np.ndarray, " N"]
    """Rise over run of the steepest of the last planes; it decays with time."""


@dataclass(frozen=True, kw_only=True)
class TouchdownSurprise:
    """How much the errors of the last touchdowns differ from one to the next [m].

    A foot that comes down on new ground, ahead of all earlier touches, has an error: its height
    above the plane through these touches, along the vertical. On a slope errors are 0; at its start
    they grow and decay; a single step changes them once; noise changes them at each touchdown. The
    value is the standard deviation of the errors, estimated from the mean size of their changes
    from one touchdown to the next (after von Neumann 1941, who uses squares, in which a single step
    weighs more). A drift, as at the foot of a slope, is removed: over n touchdowns it changes an
    error n times as much as over one. With the means mₙ of the sizes of changes over n touchdowns,
    (n² m₁² − mₙ²) / (n² − 1) has no drift, and equals m₁² for independent errors (`LAG`,
    `FROM_MEAN`). Means start at 0: unknown ground counts as smooth. A foot that comes down among
    earlier touches does not count.

    Two factors reduce the value. After steep ground an error at its end is expected: the value is
    divided by the recent steepness over `STEEP`, if above 1. Leg odometry is less reliable when the
    body turns, as at the edge of a step: the value is divided by the heading deviation over
    `STEADY`, if above 1. A robot whose deviation exceeds `HeadingWatch.limit` stumbles: its state
    is reset, and the value is NaN until there are enough errors again. Without a yaw the heading is
    not used.
    """

    touches: int = 4
    """Number of touches of each foot in the fit of the plane."""
    memory: float = 10.0
    """Decay constant of the means [touchdowns on new ground]; 1: the last change alone."""
    least_swing: float = 0.05
    """A foot that touches again sooner has bounced: it is the same touch [s]."""
    least_stance: float = 0.0
    """A foot that stands for less time has not touched [s]; above 0 false contacts are sorted out
    (`Touches`)."""

    unit = "m"
    width = 1
    needs = ()
    search = SearchRange(
        low=0.005 / 20 ** (50 / 99),  # 1.1 mm, in the steps of 100 values from 5 mm to 10 cm
        high=0.1,
        count=150,
        note="changes of touchdown errors from the plane of earlier touches",
    )

    def __post_init__(self) -> None:
        _ = self._memory
        if not 1.0 <= self.memory <= 1000.0:
            raise GaitshiftError(f"memory must be 1 to 1000 touchdowns, got {self.memory:g}")

    @cached_property
    def _memory(self) -> Touches:
        return Touches(
            kept=self.touches, least_swing=self.least_swing, least_stance=self.least_stance
        )

    def start(self, n: int) -> SurpriseState:
        """State of n robots before any touch."""
        return SurpriseState(
            touches=self._memory.start(n),
            heading=_HEADING.start(n),
            aside=np.zeros(n),
            error=np.full((n, 1 + LAG), np.nan),
            change=np.zeros((n, 2)),
            steep=np.zeros(n),
        )

    def step(
        self, state: SurpriseState, sensed: Proprioception
    ) -> tuple[SurpriseState, Float[np.ndarray, "N 1"]]:
        """State after this step, and the value; NaN until there are enough errors."""
        touches, new, foot = self._memory.step(state.touches, sensed)
        heading, off = _HEADING.step(state.heading, sensed)
        share = min(1.0, sensed.period / ASIDE_WINDOW)
        aside = state.aside + share * (off * off - state.aside)
        error, change, steep = state.error, state.change, state.steep
        ids = np.flatnonzero(new.any(axis=1))
        if ids.size:
            error, change, steep = error.copy(), change.copy(), steep.copy()
            above, slope, counts = _met(state.touches, touches, new, foot, ids)
            error[ids], change[ids] = self._take_in(error[ids], change[ids], above, counts)
            met = counts.sum(axis=1)
            remembered = np.exp(-met / STEEP_FOR) * steep[ids]
            steep[ids] = np.where(met > 0, np.maximum(slope, remembered), steep[ids])
        thrown = np.abs(off) > _HEADING.limit
        if thrown.any():
            touch = np.where(thrown[:, None, None, None], np.nan, touches.touch)
            touches = replace(touches, touch=touch)
            error = np.where(thrown[:, None], np.nan, error)
            change = np.where(thrown[:, None], 0.0, change)
            steep = np.where(thrown, 0.0, steep)
        without_drift = (LAG**2 * change[:, 0] ** 2 - change[:, 1] ** 2) / (LAG**2 - 1)
        deviation = FROM_MEAN * np.sqrt(np.maximum(without_drift, 0.0))
        aside_by = np.maximum(np.sqrt(aside) / STEADY, 1.0)
        value = deviation / aside_by / np.maximum(steep / STEEP, 1.0)
        known = ~np.isnan(error[:, -1])
        after = SurpriseState(
            touches=touches,
            heading=heading,
            aside=aside,
            error=error,
            change=change,
            steep=steep,
        )
        return after, np.where(known, value, np.nan)[:, None]

    def _take_in(
        self,
        error: Float[np.ndarray, "K 4"],
        change: Float[np.ndarray, "K 2"],
        above: Float[np.ndarray, "K 4"],
        counts: Bool[np.ndarray, "K 4"],
    ) -> tuple[Float[np.ndarray, "K 4"], Float[np.ndarray, "K 2"]]:
        """Errors and means with the errors `above` [m] of the feet that count."""
        for leg in range(4):
            size = np.abs(above[:, leg, None] - error[:, [0, LAG - 1]])
            taken = counts[:, leg, None] & ~np.isnan(size)
            change = np.where(taken, change + (size - change) / self.memory, change)
            shifted = np.concatenate([above[:, leg, None], error[:, :-1]], axis=1)
            error = np.where(counts[:, leg, None], shifted, error)
        return error, change


def _met(
    before: TouchState,
    after: TouchState,
    new: Bool[np.ndarray, "N 4"],
    foot: Float[np.ndarray, "N 4 3"],
    ids: np.ndarray,
) -> tuple[Float[np.ndarray, "K 4"], Float[np.ndarray, " K"], Bool[np.ndarray, "K 4"]]:
    """Feet of the robots `ids` relative to the plane through their earlier touches.

    Returns the height of the feet above it [m], its rise over run, and which feet count: those that
    came down on new ground, of robots with enough earlier touches.
    """
    points, came = before.points[ids], foot[ids]
    known = ~np.isnan(points[..., 0])
    plane = fit_plane(points, known, RIDGE)
    way = after.odometry.base[ids, :2] - plane.middle[:, :2]
    way = way / np.maximum(np.hypot(way[:, :1], way[:, 1:]), 1e-9)
    ahead = _along(came, way) + AHEAD > _furthest(_along(points, way), known)[:, None]
    counts = new[ids] & ahead & (known.sum(axis=1) >= LEAST)[:, None]
    return plane.above(came), np.hypot(*plane.slope.T), counts


def _along(
    points: Float[np.ndarray, "K P 3"], way: Float[np.ndarray, "K 2"]
) -> Float[np.ndarray, "K P"]:
    return points[..., 0] * way[:, :1] + points[..., 1] * way[:, 1:]


def _furthest(
    along: Float[np.ndarray, "K P"], known: Bool[np.ndarray, "K P"]
) -> Float[np.ndarray, " K"]:
    return np.where(known, along, -np.inf).max(axis=1)
