"""Learning curves, and the iterations at which robots begin to walk."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float

from gaitshift import table
from gaitshift.errors import GaitshiftError

WALKING_SPEED = 0.8
"""A robot walks when its mean speed is above this [m/s]; ours: two thirds of v_d."""

WALKING_CHANGES = 2.0
"""… and its machine changes state more often than this [1/s]; ours: a stride per second."""

HELD_FOR = 10
"""… in this many successive iterations."""

LATE_SHARE = 0.1
"""Last share of a curve over which its end is averaged."""

DECIMALS = {"reward": 2, "speed": 3, "survival": 3, "changes_per_s": 2, "stance_fraction": 3}
"""Columns of a curve and their decimals, in memory as in tables, so that a curve read back from a
table is the same."""


@dataclass(frozen=True, kw_only=True)
class LearningCurve:
    """One run, iteration by iteration; entry 0 is iteration 1."""

    reward: Float[np.ndarray, " n"]
    """Mean reward a control step."""
    speed: Float[np.ndarray, " n"]
    """Mean forward speed [m/s]."""
    survival: Float[np.ndarray, " n"]
    """Probability of no fall in 10 s at the rate of falls."""
    changes_per_s: Float[np.ndarray, " n"]
    """Changes of the machine's state [1/s]."""
    stance_fraction: Float[np.ndarray, " n"]
    """Share of steps at which the present stance of the machine is shown."""

    @classmethod
    def read(cls, path: Path) -> "LearningCurve":
        """The curve in a `progress.csv`."""
        try:
            return cls.of(table.read(path))
        except (GaitshiftError, KeyError, ValueError) as error:
            raise GaitshiftError(f"{path} is no progress of a run: {error}") from error

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, str]]) -> "LearningCurve":
        """The curve in the rows of a table, one per iteration.

        Raises:
            KeyError: a column is missing.
            ValueError: an entry is not a number.
        """
        columns = {name: np.array([float(row[name]) for row in rows]) for name in DECIMALS}
        return cls(**{name: columns[name].round(DECIMALS[name]) for name in DECIMALS})

    @classmethod
    def empty(cls) -> "LearningCurve":
        """The curve of a run that diverged in its first iteration."""
        return cls(**{name: np.zeros(0) for name in DECIMALS})

    def __len__(self) -> int:
        return len(self.reward)

    def cut(self, iterations: int) -> "LearningCurve":
        """The first of its iterations."""
        return LearningCurve(**{name: getattr(self, name)[:iterations] for name in DECIMALS})

    def late(self, column: str) -> float:
        """Mean of a column over the last tenth."""
        values = getattr(self, column)
        return float(values[-max(1, round(LATE_SHARE * len(values))) :].mean())

    @property
    def walks_at(self) -> int | None:
        """First of ten successive iterations in which the robots walk, by speed and machine."""
        walking = (self.speed > WALKING_SPEED) & (self.changes_per_s > WALKING_CHANGES)
        return _first_held(walking)

    @property
    def moves_at(self) -> int | None:
        """First of ten successive iterations in which the robots are as fast, in any gait."""
        return _first_held(self.speed > WALKING_SPEED)

    @property
    def crosses_zero_at(self) -> int | None:
        """First of ten successive iterations with a positive reward."""
        return _first_held(self.reward > 0)


def _first_held(holds: Bool[np.ndarray, " n"]) -> int | None:
    """The first iteration, from 1, of `HELD_FOR` successive true ones; None if there is none."""
    run = 0
    for index, value in enumerate(holds):
        run = run + 1 if value else 0
        if run == HELD_FOR:
            return index + 2 - HELD_FOR
    return None


def median_iteration(iterations: Sequence[int | None]) -> float | None:
    """Median, in which None (never) counts as the latest; None if the median is None."""
    ordered = np.sort([np.inf if i is None else float(i) for i in iterations])
    lower, upper = ordered[(len(ordered) - 1) // 2], ordered[len(ordered) // 2]
    return float((lower + upper) / 2) if np.isfinite(upper) else None
