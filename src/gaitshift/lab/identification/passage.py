"""Recordings cut into passages of one length, for ROC curves."""

from collections.abc import Iterator, Mapping
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.lab.identification.firings import counters, steps_alive
from gaitshift.lab.identification.labelled_run import LabelledRun
from gaitshift.lab.identification.statistics import auc
from gaitshift.shift import Rule

LENGTH = 3.0
"""Length of a passage [m]; ours: twice the accepted delay on noise of 0.10 m."""

GridScores = dict[bool, list[Int[np.ndarray, " B"]]]
"""Scores of passages at each β of a grid, by whether their ground is rough."""


def passage_scores(
    recording: LabelledRun,
    values: Float[np.ndarray, "T N M"],
    rule: Rule,
    alphas: Float[np.ndarray, " A"],
) -> dict[bool, list[int]]:
    """Number of α at which the rule fires in each passage, by whether its ground is rough.

    Each passage of `LENGTH` begins with k = 0 where a robot starts, where the ground changes, or
    where the last passage ended; a shorter rest is dropped. β and leak are the rule's.
    """
    scores = passage_grid(recording, values, rule, alphas, np.array([rule.beta]))
    return {rough: [int(of[0]) for of in rows] for rough, rows in scores.items()}


def passage_grid(
    recording: LabelledRun,
    values: Float[np.ndarray, "T N M"],
    rule: Rule,
    alphas: Float[np.ndarray, " A"],
    betas: Float[np.ndarray, " B"],
) -> GridScores:
    """`passage_scores` at each β of a grid."""
    scores: GridScores = {True: [], False: []}
    for robot, start, end in _passages(recording):
        highest = counters(values[start:end, [robot]], rule, alphas)[0].max(axis=1)
        fires = highest[:, None] > betas
        scores[bool(recording.rough[start, robot])].append(
            np.count_nonzero(fires, axis=0).astype(np.int16)
        )
    return scores


def best_beta(
    scores: Mapping[str, GridScores], betas: Float[np.ndarray, " B"], chosen: float
) -> float:
    """The β with the largest area under the ROC curve, as a mean over the courses.

    It is `chosen` if none is better or there are no passages of both kinds.

    Args:
        scores: by the name of the course; those of smooth ground are pooled.
        betas: the grid of the scores.
        chosen: the chosen β of the grid.
    """
    others = [row for course in scores.values() for row in course[False]]
    met = [np.stack(course[True]) for course in scores.values() if course[True]]
    if not met or not others:
        return chosen
    smooth = np.stack(others).astype(float)
    area = np.mean([auc(rough.astype(float), smooth) for rough in met], axis=0)
    best, own = int(area.argmax()), int(np.searchsorted(betas, chosen))
    return chosen if area[own] >= area[best] else float(betas[best])


def longest_passage(recording: LabelledRun) -> int:
    """Steps of the longest passage; 0 where there is none."""
    return max((end - start for _, start, end in _passages(recording)), default=0)


def _passages(recording: LabelledRun) -> Iterator[tuple[int, int, int]]:
    """Robot, first step, and the step after the last, of each passage."""
    ends = steps_alive(recording.alive)
    for robot in range(recording.robots):
        rough, way = recording.rough[:, robot], recording.distance[:, robot]
        for start, end in _cut(rough[: ends[robot]], way[: ends[robot]]):
            yield robot, start, end


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
