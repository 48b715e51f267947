"""A rule replayed for a whole grid of α and β in one pass over what a statistic saw."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.switching import Rule

_CHUNK = 20_000_000
"""Numbers of k kept at a time: 160 MB."""


def first_firings(
    values: Float[np.ndarray, "T N M"],
    alive: Bool[np.ndarray, "T N"],
    rule: Rule,
    alphas: Float[np.ndarray, " A"],
    betas: Float[np.ndarray, " B"],
) -> Int[np.ndarray, "N A B"]:
    """The step in which each robot first fires at each α and β; T where it never does.

    ε, leak and side are the rule's; its own α, β and hold play no part. The counter goes through
    the same sums as on a robot, so a replay fires in the very step in which the robot did. A robot
    that has fallen fires no more.

    Raises:
        GaitshiftError: α or β are not rising.
    """
    for name, grid in (("α", alphas), ("β", betas)):
        if len(grid) == 0 or np.any(np.diff(grid) <= 0.0):
            raise GaitshiftError(f"the grid of {name} must have rising values")
    steps, robots, _ = values.shape
    first = np.empty((robots, len(alphas), len(betas)), dtype=np.int64)
    for part in _parts(robots, max(1, _CHUNK // (steps * len(alphas)))):
        k = counters(values[:, part], rule, alphas)
        highest = np.maximum.accumulate(k, axis=0)
        rising = np.ascontiguousarray(np.moveaxis(highest, 0, 2))
        for robot in range(rising.shape[0]):
            for a in range(len(alphas)):
                first[part.start + robot, a] = np.searchsorted(rising[robot, a], betas, "right")
    first[first >= _steps_alive(alive)[:, None, None]] = steps
    return first


def counters(
    values: Float[np.ndarray, "T N M"], rule: Rule, alphas: Float[np.ndarray, " A"]
) -> Float[np.ndarray, "T N A"]:
    """Counter k after each step, at each α, never set back."""
    counts = counts_at(values, rule, alphas)
    k = np.empty(counts.shape)
    last = np.zeros(counts.shape[1:])
    for t, count in enumerate(counts):
        last = np.maximum(last + (rule.epsilon * count - rule.leak), 0.0)
        k[t] = last
    return k


def counts_at(
    values: Float[np.ndarray, "T N M"], rule: Rule, alphas: Float[np.ndarray, " A"]
) -> Int[np.ndarray, "T N A"]:
    """How many times ε k grows in each step, at each α."""
    steps, robots, width = values.shape
    rows = values.reshape(steps * robots, width)
    counts = [replace(rule, alpha=float(alpha)).count(rows) for alpha in alphas]
    return np.stack(counts, axis=1).reshape(steps, robots, len(alphas))


def _steps_alive(alive: Bool[np.ndarray, "T N"]) -> Int[np.ndarray, " N"]:
    """Steps before each robot fell."""
    fell = ~alive
    return np.where(fell.any(axis=0), fell.argmax(axis=0), len(alive))


def _parts(total: int, size: int) -> Iterator[slice]:
    for start in range(0, total, size):
        yield slice(start, min(start + size, total))
