"""How far from where the last touches let one expect it the ground ahead is met."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.switching.heading import HeadingState, HeadingWatch
from gaitshift.switching.signals import Signals
from gaitshift.switching.touches import Touches, TouchState, fit_plane

LEAST = 6
"""Earlier touches from which a plane is worth believing."""

AHEAD = 0.1
"""Ground is new where no earlier touch lies further ahead by more than this [m]."""

RIDGE = 0.02
"""[m²]: a plane through touches that are near one line does not tilt across it at will."""

_HEADING = HeadingWatch()


@dataclass(frozen=True, kw_only=True, eq=False)
class SurpriseState:
    """What `TouchdownSurprise` remembers."""

    touches: TouchState
    """The touches of all feet."""
    heading: HeadingState
    """The heading that the robot keeps to."""
    error: Float[np.ndarray, "N J"]
    """The last errors, the last first [m]; NaN before that: one more than the changes."""


@dataclass(frozen=True, kw_only=True)
class TouchdownSurprise:
    """How much the errors of the last touchdowns differ from one to the next [m].

    Each foot that comes down on new ground, ahead of all earlier touches, is held against the plane
    through those, along the vertical: that is its error. A slope has none; where it begins errors
    grow and fade, and from one touchdown to the next they change little; a single step changes them
    once; noise changes them at each touchdown. The number is the larger of two estimates of the
    errors' own deviation that a drift does not disturb: root mean squares of their changes over √2
    (von Neumann 1941), and of the changes of those over √6. Feet that come down where others stood
    before say nothing new, and do not count. A robot that stumbles is thrown off its heading, and
    odometry by its feet is worth nothing then: all is forgotten, and nothing said until there are
    errors enough again.
    """

    touches: int = 3
    """Touches of each foot that the plane goes through."""
    memory: int = 6
    """Changes that the mean is over."""
    least_swing: float = 0.05
    """A foot that comes down again sooner has bounced: it is the same touch [s]."""

    unit = "m"
    width = 1
    needs = ()

    def __post_init__(self) -> None:
        _ = self._memory
        if not 1 <= self.memory <= 1000:
            raise GaitshiftError(f"memory = {self.memory}: 1 to 1000 changes would be right")

    @cached_property
    def _memory(self) -> Touches:
        return Touches(kept=self.touches, least_swing=self.least_swing)

    def start(self, n: int) -> SurpriseState:
        """State of n robots of which no foot has touched."""
        return SurpriseState(
            touches=self._memory.start(n),
            heading=_HEADING.start(n),
            error=np.full((n, self.memory + 1), np.nan),
        )

    def step(
        self, state: SurpriseState, signals: Signals
    ) -> tuple[SurpriseState, Float[np.ndarray, "N 1"]]:
        """Errors after this step, and what their changes come to; NaN until there are enough."""
        touches, new, foot = self._memory.step(state.touches, signals)
        heading, stumbles = _HEADING.step(state.heading, signals)
        error = state.error
        ids = np.flatnonzero(new.any(axis=1))
        if ids.size:
            error = error.copy()
            error[ids] = self._take_in(error[ids], state.touches, touches, new, foot, ids)
        if stumbles.any():
            touch = np.where(stumbles[:, None, None, None], np.nan, touches.touch)
            touches = replace(touches, touch=touch)
            error = np.where(stumbles[:, None], np.nan, error)
        change = error[:, :-1] - error[:, 1:]
        deviation = np.sqrt(np.mean(change * change, axis=1) / 2.0)
        if self.memory > 1:
            change = change[:, :-1] - change[:, 1:]
            deviation = np.maximum(deviation, np.sqrt(np.mean(change * change, axis=1) / 6.0))
        return SurpriseState(touches=touches, heading=heading, error=error), deviation[:, None]

    def _take_in(
        self,
        error: Float[np.ndarray, "K J"],
        before: TouchState,
        after: TouchState,
        new: Bool[np.ndarray, "N 4"],
        foot: Float[np.ndarray, "N 4 3"],
        ids: np.ndarray,
    ) -> Float[np.ndarray, "K J"]:
        """The errors of robots `ids`, some of whose feet came down, with the new ones in front."""
        points, came = before.points[ids], foot[ids]
        known = ~np.isnan(points[..., 0])
        plane = fit_plane(points, known, RIDGE)
        above = plane.above(came)
        way = after.odometry.base[ids, :2] - plane.middle[:, :2]
        way = way / np.maximum(np.hypot(way[:, :1], way[:, 1:]), 1e-9)
        ahead = _along(came, way) + AHEAD > _furthest(_along(points, way), known)[:, None]
        counts = new[ids] & ahead & (known.sum(axis=1) >= LEAST)[:, None]
        for leg in range(4):
            shifted = np.concatenate([above[:, leg, None], error[:, :-1]], axis=1)
            error = np.where(counts[:, leg, None], shifted, error)
        return error


def _along(
    points: Float[np.ndarray, "K P 3"], way: Float[np.ndarray, "K 2"]
) -> Float[np.ndarray, "K P"]:
    return points[..., 0] * way[:, :1] + points[..., 1] * way[:, 1:]


def _furthest(
    along: Float[np.ndarray, "K P"], known: Bool[np.ndarray, "K P"]
) -> Float[np.ndarray, " K"]:
    return np.where(known, along, -np.inf).max(axis=1)
