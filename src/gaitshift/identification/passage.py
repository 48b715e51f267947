"""Recordings cut into passages of one length: what ROC curves are made of."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.identification.grid import counters, steps_alive
from gaitshift.identification.recording import Recording
from gaitshift.switching import Rule

LENGTH = 3.0
"""Of a passage [m]; ours: twice what a condition may take to notice noise of 0.10 m."""


def passage_scores(
    recording: Recording,
    values: Float[np.ndarray, "T N M"],
    rule: Rule,
    alphas: Float[np.ndarray, " A"],
) -> dict[bool, list[int]]:
    """At how many of the α the rule fires in each passage, by whether its ground is rough.

    Each passage of `LENGTH` begins with k = 0: where a robot starts, where the ground changes, or
    where the last one ended; what is left over at the end is no passage. β and leak are the rule's.
    """
    scores: dict[bool, list[int]] = {True: [], False: []}
    ends = steps_alive(recording.alive)
    for robot in range(recording.robots):
        rough, way = recording.rough[:, robot], recording.distance[:, robot]
        for start, end in _cut(rough[: ends[robot]], way[: ends[robot]]):
            k = counters(values[start:end, [robot]], rule, alphas)[0]
            scores[bool(rough[start])].append(int(np.count_nonzero(k.max(axis=1) > rule.beta)))
    return scores


def _cut(rough: Bool[np.ndarray, " T"], way: Float[np.ndarray, " T"]) -> Iterator[tuple[int, int]]:
    """First step of each passage of one robot, and the step after its last."""
    changes = np.flatnonzero(rough[1:] != rough[:-1]) + 1
    borders: list[int] = [0, *changes.tolist(), len(rough)]
    for first, last in pairwise(borders):
        start = first
        while start < last:
            end = start + int(np.count_nonzero(way[start:last] < way[start] + LENGTH))
            if end < last:
                yield start, end
            start = end
