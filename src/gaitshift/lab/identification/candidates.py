"""The conditions that are compared: a statistic each, with α and leaks to try."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.labelled_run import LabelledRun, Way
from gaitshift.lab.identification.log_files import columns_of
from gaitshift.shift import STATISTICS, HeightDifference
from gaitshift.shift.statistic import LEAKS
from gaitshift.shift.statistics import Watched

BETAS = np.concatenate([[0.0], np.unique(np.rint(np.geomspace(1.0, 5000.0, 120)))])
"""β that are tried [counts]."""


@dataclass(frozen=True, kw_only=True)
class Candidate:
    """A condition without its numbers."""

    name: str
    """Name on the command line."""
    values: Callable[[LabelledRun], Float[np.ndarray, "T N M"]]
    """Computes its values on a recording."""
    low: float
    """Smallest α that is tried, in `unit`."""
    high: float
    """Largest α that is tried; the values between are evenly spaced on a logarithmic scale."""
    low_back: float | None = None
    """Smallest α that is tried on the way back, where a quiet gait has lower values; None:
    `low`."""
    unit: str = ""
    """Of α."""
    needs: tuple[str, ...] = ()
    """Optional signals that it reads."""
    count: int = 100
    """Number of α that are tried."""
    leaks: tuple[float, ...] = LEAKS
    """Leaks that are tried [counts a step]."""
    note: str = ""
    """Short description."""
    statistic: Watched | None = None
    """The statistic that computes the values step by step; None: they need whole recordings."""

    def alphas(self, way: Way) -> Float[np.ndarray, " A"]:
        """α that are tried on this way."""
        low = self.low if way == "rough" or self.low_back is None else self.low_back
        return np.geomspace(low, self.high, self.count)

    def missing(self, recording: LabelledRun) -> tuple[str, ...]:
        """Columns that it reads and the recording's log lacks."""
        absent = (name for name in self.needs if getattr(recording.sensed, name) is None)
        return tuple(column for name in absent for column in columns_of(name))


def statistics_of(candidates: Iterable[Candidate], recording: LabelledRun) -> Iterator[Watched]:
    """The statistics of the candidates whose signals a recording has."""
    for candidate in candidates:
        if candidate.statistic is not None and not candidate.missing(recording):
            yield candidate.statistic


def _watching(name: str, statistic: Watched, **changes: Any) -> Candidate | None:
    """The candidate of a statistic; None where the statistic is independent of the ground."""
    if statistic.search is None:
        return None
    return Candidate(
        name=name,
        statistic=statistic,
        values=lambda recording: recording.values(statistic),
        unit=statistic.unit,
        needs=statistic.needs,
        **{**asdict(statistic.search), **changes},
    )


_PAPER = {"leaks": (0.0,), "note": "Algorithm 1 as printed: body frame, no leak"}

CANDIDATES = tuple(
    candidate
    for candidate in (
        _watching("paper", HeightDifference(frame="body"), **_PAPER),
        *(_watching(name, made()) for name, made in STATISTICS.items()),
    )
    if candidate is not None
)
"""The paper's algorithm, and every statistic of `shift.STATISTICS` with a search range."""


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
