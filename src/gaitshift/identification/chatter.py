"""Chatter: how often robots would have shifted, there and back, by two rules in turn."""

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.identification.recording import Recording
from gaitshift.switching import Rule, load_condition

SHIPPED = "touchdown_surprise"
"""The condition whose way back, or way there, stands in for the one that is not judged."""


def shipped_values(recording: Recording, *, back: bool) -> Float[np.ndarray, "T N M"]:
    """What the shipped condition watches on a recording, on the way there or back."""
    condition = load_condition(SHIPPED)
    watched = condition.statistic_back if back else None
    return recording.values(watched or condition.statistic)


def shipped_rule(*, back: bool) -> Rule:
    """The shipped condition's rule of the way there or back."""
    condition = load_condition(SHIPPED)
    return condition.flat if back else condition.rough


def shifts(
    there: tuple[Rule, Float[np.ndarray, "T N M"]],
    back: tuple[Rule, Float[np.ndarray, "T N L"]],
    alive: Bool[np.ndarray, "T N"],
) -> Int[np.ndarray, " N"]:
    """How often each robot shifts, there and back taken together.

    All begin in the gait for flat ground. Each rule counts what belongs to it from k = 0 when it
    comes into force, as in `Condition.step`. A robot that has fallen shifts no more.

    Args:
        there: the rule to the rough gait, and what it watches.
        back: the rule of the way back, and what it watches.
        alive: whether robots are on their feet.
    """
    grown = np.stack([_growth(*there), _growth(*back)])
    betas = np.array([there[0].beta, back[0].beta])
    n: int = alive.shape[1]
    robots = np.arange(n)
    k, count = np.zeros(n), np.zeros(n, dtype=np.int64)
    for t in range(len(alive)):
        in_force = count % 2
        k = np.maximum(k + grown[in_force, t, robots], 0.0)
        fires = alive[t] & (k > betas[in_force])
        k[fires] = 0.0
        count += fires
    return count


def chattered(recording: Recording, count: Int[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Whether each robot shifted more than once there and once back for each rough stretch.

    Once there and once back is nobody's chatter, even where no ground was rough: it is a false
    shift, and is told as such.
    """
    rough = recording.rough & recording.alive
    begun = rough & ~np.roll(rough, 1, axis=0)
    begun[0] = rough[0]
    return count > 2 * np.maximum(begun.sum(axis=0), 1)


def _growth(rule: Rule, values: Float[np.ndarray, "T N M"]) -> Float[np.ndarray, "T N"]:
    """What k gains in each step, before it is kept from falling below 0."""
    steps, robots, width = values.shape
    counts = rule.count(values.reshape(steps * robots, width)).reshape(steps, robots)
    return rule.epsilon * counts - rule.leak
