"""All recordings of a kind of ground together, at each α and β of a grid."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from gaitshift.lab.identification.grid import first_firings
from gaitshift.lab.identification.labelled_run import LabelledRun
from gaitshift.lab.identification.scores import detections, false_shifts
from gaitshift.shift import AnyStatistic, Rule


@dataclass(frozen=True, kw_only=True)
class Grid:
    """The values of α and β that are tried."""

    alphas: Float[np.ndarray, " A"]
    """α, in the statistic's unit, rising."""
    betas: Float[np.ndarray, " B"]
    """β [counts], rising."""

    @property
    def shape(self) -> tuple[int, int]:
        """A, B."""
        return len(self.alphas), len(self.betas)


@dataclass(kw_only=True, eq=False)
class Tally:
    """What came of a rule over many recordings."""

    shape: tuple[int, int]
    """A, B."""
    came: Int[np.ndarray, "A B"] = field(init=False)
    """Robots that came to rough ground without having fired."""
    detected: Int[np.ndarray, "A B"] = field(init=False)
    """Those of them that fired on it."""
    seconds: Float[np.ndarray, "A B"] = field(init=False)
    """Sum of their delays [s]."""
    metres: Float[np.ndarray, "A B"] = field(init=False)
    """Sum of their delays [m]."""
    fired: Int[np.ndarray, "A B"] = field(init=False)
    """Robots that fired on smooth ground."""
    km: Float[np.ndarray, "A B"] = field(init=False)
    """Way over smooth ground until firing, of all robots [km]."""
    robots: int = 0
    """Robots in all."""

    def __post_init__(self) -> None:
        self.came, self.detected, self.fired = (np.zeros(self.shape, dtype=int) for _ in range(3))
        self.seconds, self.metres, self.km = (np.zeros(self.shape) for _ in range(3))

    def add(self, recording: LabelledRun, first: Int[np.ndarray, "N A B"]) -> None:
        """Takes in the firings of one recording."""
        found, wrong = detections(recording, first), false_shifts(recording, first)
        self.came += found.came
        self.detected += found.detected
        self.seconds += np.nansum(found.delay_s, axis=0)
        self.metres += np.nansum(found.delay_m, axis=0)
        self.fired += wrong.fired
        self.km += wrong.km
        self.robots += wrong.robots

    def join(self, other: "Tally") -> None:
        """Takes in all that another one has."""
        for name in ("came", "detected", "seconds", "metres", "fired", "km", "robots"):
            setattr(self, name, getattr(self, name) + getattr(other, name))

    @property
    def missed(self) -> Float[np.ndarray, "A B"]:
        """Share of the rough stretches that went by without a shift; NaN where none was met."""
        return 1.0 - _share(self.detected, self.came)

    @property
    def delay_m(self) -> Float[np.ndarray, "A B"]:
        """Mean delay of a detection [m]; NaN without one."""
        return _share(self.metres, self.detected)

    @property
    def delay_s(self) -> Float[np.ndarray, "A B"]:
        """Mean delay of a detection [s]; NaN without one."""
        return _share(self.seconds, self.detected)

    @property
    def false_per_km(self) -> Float[np.ndarray, "A B"]:
        """Shifts on smooth ground a kilometre; NaN where none was walked."""
        return _share(self.fired, self.km)


@runtime_checkable
class Joining(Protocol):
    """What came of some recordings, and takes in what came of others."""

    def join(self, other: Any, /) -> None:
        """Takes in all that another one has."""
        ...


Part = TypeVar("Part", bound=Joining)


def join_by_name(mine: dict[str, Part], others: Mapping[str, Part]) -> None:
    """Takes in, for each name, all that the others have of it."""
    for name, other in others.items():
        if name in mine:
            mine[name].join(other)
        else:
            mine[name] = other


def replay(
    recordings: Iterable[LabelledRun], statistic: AnyStatistic, rule: Rule, grid: Grid
) -> dict[str, Tally]:
    """What a rule does at each α and β, by the names of the recordings."""
    tallies: dict[str, Tally] = {}
    for recording in recordings:
        values = recording.values(statistic)
        first = first_firings(values, recording.alive, rule, grid.alphas, grid.betas)
        tallies.setdefault(recording.name, Tally(shape=grid.shape)).add(recording, first)
    return tallies


def _share(part: np.ndarray, whole: np.ndarray) -> Float[np.ndarray, "A B"]:
    return np.where(whole > 0, part / np.where(whole > 0, whole, 1), np.nan)
