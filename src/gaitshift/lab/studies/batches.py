"""Runs in batches."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

Outcome = TypeVar("Outcome")
"""A dataclass of arrays with one entry per run."""


def in_batches(
    run: Callable[[int, int], Outcome],
    total: int,
    *,
    most: int,
    seed: int,
    report: Callable[[int, int], None],
) -> Outcome:
    """The outcomes of `total` runs, at most `most` at a time.

    `run` takes the number of runs and the seed of a batch, `report` the runs done and the total.
    """
    parts: list[Outcome] = []
    for index, first in enumerate(range(0, total, most)):
        n = min(most, total - first)
        parts.append(run(n, 1000 * seed + index))
        report(first + n, total)
    kind: Any = type(parts[0])
    names = [field.name for field in fields(kind)]
    return kind(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})
