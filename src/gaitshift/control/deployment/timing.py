"""Deadlines of a control loop on a monotonic clock, and how well they are met."""

import gc
from collections.abc import Generator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from gaitshift.robot.command import CONTROL_PERIOD

PERCENTILES = (50, 95, 99)


@contextmanager
def uninterrupted() -> Generator[None]:
    """Keeps Python's garbage collector away from the block, where it takes 60 ms at a time."""
    was_on = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


class Pace:
    """Absolute deadlines, one a control period; a late step does not move those that follow."""

    def __init__(self, start: float) -> None:
        """The first deadline is `start` [s]."""
        self._start, self._number = start, 0

    @property
    def deadline(self) -> float:
        """When the next control step is due [s]."""
        return self._start + self._number * CONTROL_PERIOD

    def advance(self, now: float) -> int:
        """Ends a control step at this time [s]; deadlines that were missed.

        A step that ends after the next deadline misses it, and each whole period more misses
        another one. The loop leaves those out and never runs faster to catch up.
        """
        self._number += 1
        late = now - self.deadline
        if late <= 0.0:
            return 0
        whole = int(late / CONTROL_PERIOD)
        self._number += whole
        return 1 + whole


@dataclass(kw_only=True)
class Timing:
    """Measured times of a loop."""

    jitter: list[float] = field(default_factory=list[float])
    """How long after its deadline each control step began [s]."""
    work: list[float] = field(default_factory=list[float])
    """How long each took [s]."""
    round_trip: list[float] = field(default_factory=list[float])
    """From a command to the first sensors that result from it, a control step of the robot among
    it [s]."""
    misses: int = 0
    """Deadlines that were missed."""

    def summary(self) -> dict[str, Any]:
        """Misses, and percentiles in milliseconds; None without a measurement."""
        return {
            "deadline_misses": self.misses,
            **{
                f"{name}_ms": _percentiles(getattr(self, name))
                for name in ("jitter", "work", "round_trip")
            },
        }


def _percentiles(times: list[float]) -> dict[str, float] | None:
    if not times:
        return None
    milliseconds = 1000.0 * np.array(times)
    values = np.percentile(milliseconds, PERCENTILES).tolist()
    named = {f"p{of}": round(value, 3) for of, value in zip(PERCENTILES, values, strict=True)}
    return {**named, "max": round(float(milliseconds.max()), 3)}
