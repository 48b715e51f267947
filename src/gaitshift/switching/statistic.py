"""What conditions watch: a few numbers a step and robot, which grow with the ground's roughness."""

from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Float

from gaitshift.switching.signals import Signals

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


AnyStatistic = Statistic[Any]
"""Where several kinds of statistic are handled alike."""
