"""Many runs, so many at a time."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar

import numpy as np

Outcome = TypeVar("Outcome")
"""A dataclass of arrays, an entry a run."""


def in_batches(
    run: Callable[[int, int], Outcome],
    total: int,
    *,
    most: int,
    seed: int,
    report: Callable[[int, int], None],
) -> Outcome:
    """What all of `total` runs came to, at most `most` at a time.

    `run` takes how many and the seed of the batch, `report` the runs done and those in all.
    """
    parts: list[Outcome] = []
    for index, first in enumerate(range(0, total, most)):
        n = min(most, total - first)
        parts.append(run(n, 1000 * seed + index))
        report(first + n, total)
    kind: Any = type(parts[0])
    names = [field.name for field in fields(kind)]
    return kind(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})
