"""What conditions watch: a few numbers a step and robot, which grow with the ground's roughness."""

import math
from dataclasses import fields, is_dataclass, replace
from typing import Any, Protocol, TypeVar, cast, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.shift.signals import Signals

S = TypeVar("S")


@runtime_checkable
class Statistic(Protocol[S]):
    """Turns signals into M numbers a robot; what it remembers comes in and goes out.

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
        """Optional signals that it looks at."""
        ...

    def start(self, n: int) -> S:
        """What it remembers of n robots that have not been seen yet."""
        ...

    def step(self, state: S, signals: Signals) -> tuple[S, Float[np.ndarray, "N M"]]:
        """Takes in one control step; nothing given is written to."""
        ...


def check_positive(statistic: object, *names: str) -> None:
    """`GaitshiftError` unless these settings of a statistic are finite numbers above 0."""
    for name in names:
        value: float = getattr(statistic, name)
        if not (math.isfinite(value) and value > 0.0):
            raise GaitshiftError(f"{name} must be a finite number above 0, got {value:g}")


AnyStatistic = Statistic[Any]
"""Where several kinds of statistic are handled alike."""


def begun_anew(statistic: AnyStatistic, state: Any, who: Bool[np.ndarray, " N"]) -> Any:
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
