"""The conditions that are compared: a statistic each, with the α and leaks that are tried."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.log_files import columns_of
from gaitshift.lab.identification.recording import Recording, Way
from gaitshift.shift import (
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

_LEAKS = (0.0, 0.02, 0.1, 0.3, 0.6)


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A condition but for its numbers."""

    name: str
    """As on the command line."""
    values: Callable[[Recording], Float[np.ndarray, "T N M"]]
    """What it watches on a recording."""
    low: float
    """Smallest α that is tried, in `unit`."""
    high: float
    """Largest α that is tried; those between them lie evenly on a logarithmic scale."""
    low_back: float | None = None
    """Smallest α that is tried on the way back, where a quiet gait shows less; None: `low`."""
    unit: str = ""
    """Of α."""
    needs: tuple[str, ...] = ()
    """Optional signals that it looks at."""
    count: int = 100
    """How many α are tried."""
    leaks: tuple[float, ...] = _LEAKS
    """Leaks that are tried [counts a step]."""
    note: str = ""
    """What it stands for, in a few words."""
    statistic: AnyStatistic | None = None
    """What says those values step by step; None: they come of whole recordings alone."""

    def alphas(self, way: Way) -> Float[np.ndarray, " A"]:
        """α that are tried on this way."""
        low = self.low if way == "rough" or self.low_back is None else self.low_back
        return np.geomspace(low, self.high, self.count)

    def missing(self, recording: Recording) -> tuple[str, ...]:
        """Columns of a table that the recording's log lacks, and that it looks at."""
        signals = (name for name in self.needs if getattr(recording, name) is None)
        return tuple(column for name in signals for column in columns_of(name))


def _watching(statistic: AnyStatistic, name: str, **settings: Any) -> Candidate:
    """A candidate whose numbers are a statistic's, step by step."""
    return Candidate(
        name=name,
        statistic=statistic,
        values=lambda recording: recording.values(statistic),
        unit=statistic.unit,
        needs=statistic.needs,
        **settings,
    )


def _six(leaks: tuple[float, ...]) -> tuple[float, ...]:
    """Leaks for six numbers a step."""
    return tuple(6 * leak for leak in leaks)


CANDIDATES = (
    _watching(
        HeightDifference(frame="body"),
        "paper",
        low=0.005,
        low_back=0.001,
        high=0.5,
        leaks=(0.0,),
        note="Algorithm 1 as printed: body frame, no leak",
    ),
    _watching(
        HeightDifference(),
        "height_difference",
        low=0.005,
        low_back=0.001,
        high=0.5,
        leaks=_six(_LEAKS),
        note="differences of foot heights along gravity, with a leak",
    ),
    _watching(
        PlaneResidual(),
        "plane_residual",
        low=0.002,
        high=0.2,
        note="residual of the last two touches of each foot about their plane",
    ),
    _watching(
        TouchdownSurprise(),
        "touchdown_surprise",
        low=0.005 / 20 ** (50 / 99),  # 1.1 mm, in the steps of 100 values from 5 mm to 10 cm
        high=0.1,
        count=150,
        note="change of new touches about the plane of earlier ones",
    ),
    _watching(
        AttitudeVariance(),
        "attitude_variance",
        low=0.003,
        high=0.3,
        note="deviation of roll and pitch",
    ),
    _watching(
        ContactTiming(),
        "contact_timing",
        low=0.005,
        high=0.5,
        leaks=_six(_LEAKS),
        note="stride duration minus commanded stride duration",
    ),
    _watching(
        Slip(),
        "slip",
        low=0.02,
        high=2.0,
        leaks=_six(_LEAKS),
        note="speed of feet in contact",
    ),
    _watching(
        CostOfTransport(),
        "cost_of_transport",
        low=0.1,
        high=10.0,
        note="cost of transport: power over weight and speed",
    ),
    _watching(
        ValueDrop(),
        "value_drop",
        low=0.01,
        high=100.0,
        note="drop of the critic's value",
    ),
    _watching(
        Oracle(),
        "oracle",
        low=0.4,
        high=0.6,
        leaks=(0.0,),
        note="knows the ground: the reference",
    ),
)
"""A new one is an entry here."""


def candidates(names: Sequence[str]) -> tuple[Candidate, ...]:
    """The candidates of these names, each once.

    Raises:
        GaitshiftError: no such candidate.
    """
    known = {candidate.name: candidate for candidate in CANDIDATES}
    unknown = [name for name in names if name not in known]
    if unknown:
        listed = ", ".join((*known, "classifier"))
        raise GaitshiftError(f"condition must be one of {listed}, or all, got '{unknown[0]}'")
    return tuple(known[name] for name in dict.fromkeys(names))
