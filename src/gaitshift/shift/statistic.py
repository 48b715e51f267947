"""What conditions watch: a few numbers a step and robot, which grow with the ground's roughness."""

import math
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Protocol, TypeVar, cast, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception

S = TypeVar("S")

LEAKS = (0.0, 0.02, 0.1, 0.3, 0.6)
"""Leaks that `identify` tries [counts a step]; ours."""

SIX_LEAKS = tuple(6 * leak for leak in LEAKS)
"""The same for the six pairs of feet, which count one by one."""


@dataclass(frozen=True, kw_only=True)
class SearchRange:
    """The α and leaks that `gaitshift identify` tries for a statistic."""

    low: float
    """Smallest α, in the statistic's unit."""
    high: float
    """Largest α; those between them lie evenly on a logarithmic scale."""
    low_back: float | None = None
    """Smallest α on the way back, where a quiet gait shows less; None: `low`."""
    count: int = 100
    """How many α."""
    leaks: tuple[float, ...] = LEAKS
    """Leaks [counts a step]."""
    note: str = ""
    """What the statistic stands for, in a few words."""


@runtime_checkable
class Statistic(Protocol[S]):
    """Turns what robots sense into M numbers each; what it remembers comes in and goes out.

    A number that is not known yet is NaN. Robots do not know of each other: a batch of them is the
    same as each alone, to the bit.
    """

    @property
    def unit(self) -> str:
        """Of its numbers, and so of α: `m`, `rad`, or empty."""
        ...

    @property
    def width(self) -> int:
        """M."""
        ...

    @property
    def needs(self) -> tuple[str, ...]:
        """Optional fields of `Proprioception` that it reads."""
        ...

    @property
    def search(self) -> SearchRange | None:
        """What `identify` tries; None where it says nothing of the ground."""
        ...

    def start(self, n: int) -> S:
        """What it remembers of n robots that have not been seen yet."""
        ...

    def step(self, state: S, sensed: Proprioception) -> tuple[S, Float[np.ndarray, "N M"]]:
        """Takes in one control step; nothing given is written to."""
        ...


def check_positive(statistic: object, *names: str) -> None:
    """`GaitshiftError` unless these settings of a statistic are finite numbers above 0."""
    for name in names:
        value: float = getattr(statistic, name)
        if not (math.isfinite(value) and value > 0.0):
            raise GaitshiftError(f"{name} must be above 0, got {value:g}")


@runtime_checkable
class Starting(Protocol):
    """What has a state of robots that were not seen yet."""

    def start(self, n: int) -> Any:
        """That state, of n robots."""
        ...


AnyStatistic = Statistic[Any]
"""Where several kinds of statistic are handled alike."""


def begun_anew(statistic: Starting, state: Any, who: Bool[np.ndarray, " N"]) -> Any:
    """What a statistic remembers, with nothing of the robots `who`: they were not seen yet."""
    return _chosen(who, statistic.start(len(who)), state) if who.any() else state


def _chosen(who: Bool[np.ndarray, " N"], ours: Any, others: Any) -> Any:
    """Rows of `ours` where `who`, of `others` elsewhere, in all arrays of two states."""
    state: Any = others
    if is_dataclass(others):
        names = [f.name for f in fields(others)]
        rows = {name: _chosen(who, getattr(ours, name), getattr(others, name)) for name in names}
        return replace(cast(Any, others), **rows)
    if not isinstance(ours, np.ndarray):
        return state
    chosen: Any = np.array(state)
    chosen[who] = ours[who]
    return chosen
