"""The conditions that are compared: a statistic each, with the α and leaks that are tried."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.identification.recording import Recording
from gaitshift.switching import (
    AnyStatistic,
    AttitudeVariance,
    ContactTiming,
    CostOfTransport,
    HeightDifference,
    Oracle,
    PlaneResidual,
    Slip,
    TouchdownSurprise,
    ValueDrop,
)

BETAS = np.concatenate([[0.0], np.unique(np.rint(np.geomspace(1.0, 5000.0, 120)))])
"""β that are tried [counts]."""

_ALPHAS = 100
_LEAKS = (0.0, 0.02, 0.1, 0.3, 0.6)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A condition but for its numbers."""

    name: str
    """As on the command line."""
    statistic: AnyStatistic
    """What it watches."""
    low: float
    """Smallest α that is tried, in the statistic's unit."""
    high: float
    """Largest α that is tried; those between them lie evenly on a logarithmic scale."""
    leaks: tuple[float, ...] = _LEAKS
    """Leaks that are tried [counts a step]."""
    note: str = ""
    """What it stands for, in a few words."""
    values_of: Callable[[Recording], Float[np.ndarray, "T N M"]] | None = field(
        default=None, compare=False
    )
    """Where the numbers come from otherwise than step by step: a classifier's."""

    @property
    def alphas(self) -> Float[np.ndarray, " A"]:
        """α that are tried."""
        return np.geomspace(self.low, self.high, _ALPHAS)

    def values(self, recording: Recording) -> Float[np.ndarray, "T N M"]:
        """Its numbers on a recording."""
        if self.values_of is not None:
            return self.values_of(recording)
        return recording.values(self.statistic)

    def is_fed_by(self, recording: Recording) -> bool:
        """Whether the recording has all signals that it looks at."""
        return all(getattr(recording, name) is not None for name in self.statistic.needs)


def _six(leaks: tuple[float, ...]) -> tuple[float, ...]:
    """Leaks for six numbers a step."""
    return tuple(6 * leak for leak in leaks)


CANDIDATES = (
    Candidate(
        name="paper",
        statistic=HeightDifference(frame="body"),
        low=0.005,
        high=0.5,
        leaks=(0.0,),
        note="Algorithm 1 as printed: body frame, no leak",
    ),
    Candidate(
        name="height_difference",
        statistic=HeightDifference(),
        low=0.005,
        high=0.5,
        leaks=_six(_LEAKS),
        note="the same along the vertical, with a leak",
    ),
    Candidate(
        name="plane_residual",
        statistic=PlaneResidual(),
        low=0.002,
        high=0.2,
        note="two touches a foot about their plane",
    ),
    Candidate(
        name="touchdown_surprise",
        statistic=TouchdownSurprise(),
        low=0.005,
        high=0.1,
        note="new touches against the plane of the earlier ones",
    ),
    Candidate(
        name="attitude_variance",
        statistic=AttitudeVariance(),
        low=0.003,
        high=0.3,
        note="deviation of roll and pitch",
    ),
    Candidate(
        name="contact_timing",
        statistic=ContactTiming(),
        low=0.005,
        high=0.5,
        leaks=_six(_LEAKS),
        note="strides shorter or longer than asked for",
    ),
    Candidate(
        name="slip",
        statistic=Slip(),
        low=0.02,
        high=2.0,
        leaks=_six(_LEAKS),
        note="speed of feet that ought to stand",
    ),
    Candidate(
        name="cost_of_transport",
        statistic=CostOfTransport(),
        low=0.1,
        high=10.0,
        note="power over weight and speed",
    ),
    Candidate(
        name="value_drop",
        statistic=ValueDrop(),
        low=0.01,
        high=100.0,
        note="the critic expects less than it did",
    ),
    Candidate(
        name="oracle",
        statistic=Oracle(),
        low=0.4,
        high=0.6,
        leaks=(0.0,),
        note="sees the ground: a point of reference",
    ),
)
"""A new one is an entry here."""


def candidates(names: tuple[str, ...]) -> tuple[Candidate, ...]:
    """The candidates of these names; all if none.

    Raises:
        GaitshiftError: no such candidate.
    """
    known = tuple(candidate.name for candidate in CANDIDATES)
    unknown = [name for name in names if name not in known]
    if unknown:
        listed = ", ".join((*known, "classifier"))
        raise GaitshiftError(f"no condition '{unknown[0]}'; known: {listed}, or all")
    return tuple(c for c in CANDIDATES if not names or c.name in names)
