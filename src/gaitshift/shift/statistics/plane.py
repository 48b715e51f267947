"""Deviation of the last touches of the feet from a plane, so that slopes do not count as rough."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import SearchRange
from gaitshift.shift.statistics.touches import Touches, TouchState, fit_plane

LEAST = 4
"""Least number of touches for a value: a plane goes through any three."""

_RIDGE = 1e-9
"""Ridge of the fit [m²], for feet in one line."""


@dataclass(frozen=True, kw_only=True)
class PlaneResidual:
    """Standard deviation of the last touches about the plane through them, along the vertical [m].

    √(Σr² / (m − 3)) for m touches; a plane has three parameters, so m − 3 degrees of freedom
    remain. Leg odometry gives the positions of earlier touches. With one touch per foot these are
    the paper's h less a plane.
    """

    touches: int = 2
    """Number of touches of each foot in memory."""
    least_swing: float = 0.05
    """A foot that touches again sooner has bounced: it is the same touch [s]."""
    least_stance: float = 0.0
    """A foot that stands for less time has not touched [s]; above 0 false contacts are sorted out
    (`Touches`)."""

    unit = "m"
    width = 1
    needs = ()
    search = SearchRange(low=0.002, high=0.2, note="distance of the last touches from their plane")

    def __post_init__(self) -> None:
        _ = self._memory

    @cached_property
    def _memory(self) -> Touches:
        return Touches(
            kept=self.touches, least_swing=self.least_swing, least_stance=self.least_stance
        )

    def start(self, n: int) -> TouchState:
        """State of n robots before any touch."""
        return self._memory.start(n)

    def step(
        self, state: TouchState, sensed: Proprioception
    ) -> tuple[TouchState, Float[np.ndarray, "N 1"]]:
        """Touches after this step, and their deviation from a plane."""
        after, _, _ = self._memory.step(state, sensed)
        points = after.points
        return after, deviation(points, ~np.isnan(points[..., 0]))[:, None]


def deviation(
    points: Float[np.ndarray, "N P 3"], known: Bool[np.ndarray, "N P"]
) -> Float[np.ndarray, " N"]:
    """√(Σr² / (m − 3)) of the m known points about their least-squares plane z(x, y) [m].

    NaN below four points. For points in one line it is the deviation from the line.
    """
    count = known.sum(axis=1)
    above = fit_plane(points, known, _RIDGE).above(points)
    residual = np.where(known, above, 0.0)
    variance = (residual * residual).sum(axis=1) / np.maximum(count - 3, 1)
    return np.where(count < LEAST, np.nan, np.sqrt(variance))
