"""Recordings cut into passages of one length: what ROC curves are made of."""

import numpy as np
from jaxtyping import Float

from gaitshift.identification.grid import counts_at, steps_alive
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
        growth = rule.epsilon * counts_at(values[:, robot], rule, alphas).T - rule.leak
        rough, way = recording.rough[:, robot], recording.distance[:, robot]
        start = 0
        k = peak = np.zeros(len(alphas))
        for t in range(int(ends[robot])):
            is_over = way[t] - way[start] >= LENGTH
            if is_over or rough[t] != rough[start]:
                if is_over:
                    scores[bool(rough[start])].append(int(np.count_nonzero(peak > rule.beta)))
                start = t
                k = peak = np.zeros(len(alphas))
            k = np.maximum(k + growth[t], 0.0)
            peak = np.maximum(peak, k)
    return scores
