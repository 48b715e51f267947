"""A rule replayed for a whole grid of α and β in one pass over what a statistic saw."""

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.shift import Rule

_TOGETHER = 16
"""Robots that a leaking counter is run for at once: some more take memory, fewer take time."""


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
            raise GaitshiftError(f"grid values of {name} must rise")
    steps, robots, _ = values.shape
    first = np.empty((robots, len(alphas), len(betas)), dtype=np.int32)
    last = steps_alive(alive)
    for start in range(0, robots, _TOGETHER):
        block = range(start, min(start + _TOGETHER, robots))
        for robot, k in zip(block, counters(values[:, block], rule, alphas), strict=True):
            rising = np.maximum.accumulate(k, axis=1) if rule.leak else k
            for a in range(len(alphas)):
                first[robot, a] = np.searchsorted(rising[a], betas, "right")
            if last[robot] < steps:
                first[robot][first[robot] >= last[robot]] = steps
    return first


def counters(
    values: Float[np.ndarray, "T N M"], rule: Rule, alphas: Float[np.ndarray, " A"]
) -> Float[np.ndarray, "N A T"]:
    """Counter k of each robot after each step, at each α, never set back."""
    counts = np.stack([counts_at(of_robot, rule, alphas) for of_robot in values.swapaxes(0, 1)])
    growth = rule.epsilon * counts - rule.leak
    if not rule.leak:
        return growth.cumsum(axis=2)
    steps = np.ascontiguousarray(np.moveaxis(growth, 2, 0))
    k, last = np.empty(steps.shape), np.zeros(steps.shape[1:])
    for t, grown in enumerate(steps):
        last = np.maximum(last + grown, 0.0, out=k[t])
    return np.ascontiguousarray(np.moveaxis(k, 0, 2))


def counts_at(
    values: Float[np.ndarray, "T M"], rule: Rule, alphas: Float[np.ndarray, " A"]
) -> Int[np.ndarray, "A T"]:
    """How many times ε k grows in each step of one robot, at each α."""
    steps = len(values)
    if rule.when == "below":
        largest = values.max(axis=1)  # NaN where any is unknown
        return (largest < alphas[:, None]).astype(np.int64)
    # A value is above as many of the rising α as are smaller than it.
    passed = np.searchsorted(alphas, np.where(np.isnan(values), -np.inf, values), "left")
    slot = passed * steps + np.arange(steps)[:, None]
    shape = (len(alphas) + 1, steps)
    each = np.bincount(slot.ravel(), minlength=shape[0] * steps).astype(np.int32).reshape(shape)
    return each[::-1].cumsum(axis=0, dtype=np.int32)[::-1][1:]


def steps_alive(alive: Bool[np.ndarray, "T N"]) -> Int[np.ndarray, " N"]:
    """Steps before each robot fell."""
    fell = ~alive
    return np.where(fell.any(axis=0), fell.argmax(axis=0), len(alive))
