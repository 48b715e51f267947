"""The statistic of a condition: a few values per step and robot that grow with roughness."""

import math
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Protocol, TypeVar, cast, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception

S = TypeVar("S")

LEAKS = (0.0, 0.02, 0.1, 0.3, 0.6)
"""Leaks that `identify` tries [counts per step]; ours."""

SIX_LEAKS = tuple(6 * leak for leak in LEAKS)
"""The same for six pairs of feet, each of which counts."""


@dataclass(frozen=True, kw_only=True)
class SearchRange:
    """The α and leaks that `gaitshift identify` tries for a statistic."""

    low: float
    """Smallest α, in the statistic's unit."""
    high: float
    """Largest α; the values between are evenly spaced on a logarithmic scale."""
    low_back: float | None = None
    """Smallest α on the way back, where a quiet gait has lower values; None: `low`."""
    count: int = 100
    """Number of α."""
    leaks: tuple[float, ...] = LEAKS
    """Leaks [counts a step]."""
    note: str = ""
    """Short description of the statistic."""


@runtime_checkable
class Statistic(Protocol[S]):
    """Computes M values per robot from proprioception; its memory is passed in and returned.

    A value that is not known yet is NaN. Robots are independent: a batch gives the same bits as
    each robot alone.
    """

    @property
    def unit(self) -> str:
        """Unit of its values and of α: `m`, `rad`, or empty."""
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
        """The α and leaks that `identify` tries; None where it is independent of the ground."""
        ...

    def start(self, n: int) -> S:
        """Its memory of n robots before their first step."""
        ...

    def step(self, state: S, sensed: Proprioception) -> tuple[S, Float[np.ndarray, "N M"]]:
        """Memory and values after one control step; the arguments are not changed."""
        ...


def check_positive(statistic: object, *names: str) -> None:
    """`GaitshiftError` unless these settings of a statistic are finite numbers above 0."""
    for name in names:
        value: float = getattr(statistic, name)
        if not (math.isfinite(value) and value > 0.0):
            raise GaitshiftError(f"{name} must be above 0, got {value:g}")


@runtime_checkable
class Starting(Protocol):
    """Anything with an initial state of robots."""

    def start(self, n: int) -> Any:
        """The state of n robots before their first step."""
        ...


AnyStatistic = Statistic[Any]
"""A statistic of any kind."""


def begun_anew(statistic: Starting, state: Any, who: Bool[np.ndarray, " N"]) -> Any:
    """The memory of a statistic in which the robots `who` are reset."""
    return _chosen(who, statistic.start(len(who)), state) if who.any() else state


def _chosen(who: Bool[np.ndarray, " N"], fresh: Any, others: Any) -> Any:
    """Rows of `fresh` where `who`, of `others` elsewhere, in all arrays of two states."""
    state: Any = others
    if is_dataclass(others):
        names = [f.name for f in fields(others)]
        rows = {name: _chosen(who, getattr(fresh, name), getattr(others, name)) for name in names}
        return replace(cast(Any, others), **rows)
    if not isinstance(fresh, np.ndarray):
        return state
    chosen: Any = np.array(state)
    chosen[who] = fresh[who]
    return chosen
