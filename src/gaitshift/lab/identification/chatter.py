"""Chatter: how often robots would have shifted, there and back, by two rules in turn."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.lab.identification.firings import first_firings
from gaitshift.lab.identification.recording import Recording, Way
from gaitshift.shift import AnyStatistic, Condition, Rule, Signals, load_condition

SHIPPED = "touchdown_surprise"
"""The condition whose way back, or way there, stands in for the one that is not judged."""


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedValues:
    """A statistic whose numbers were known before, step by step: what it says forgets nothing."""

    values: Float[np.ndarray, "T N M"]
    """Of all steps."""

    unit = ""
    needs = ()

    @property
    def width(self) -> int:
        """M."""
        return self.values.shape[2]

    def start(self, n: int) -> int:
        """The first step."""
        del n
        return 0

    def step(self, state: int, signals: Signals) -> tuple[int, Float[np.ndarray, "N M"]]:
        """The next step, and what was known of this one."""
        del signals
        return state + 1, self.values[state]


def shipped_rule(*, back: bool) -> Rule:
    """The shipped condition's rule of the way there or back."""
    condition = load_condition(SHIPPED)
    return condition.flat if back else condition.rough


def in_turn(rule: Rule, statistic: AnyStatistic, way: Way) -> Condition:
    """A condition of this rule on this way, and of the shipped one's on the other."""
    shipped = load_condition(SHIPPED)
    if way == "rough":
        return replace(
            shipped,
            statistic=statistic,
            statistic_back=shipped.statistic_back or shipped.statistic,
            alpha=rule.alpha,
            beta=rule.beta,
            leak=rule.leak,
        )
    return replace(
        shipped,
        statistic_back=statistic,
        alpha_back=rule.alpha,
        beta_back=rule.beta,
        leak_back=rule.leak,
    )


def shifts(recording: Recording, condition: Condition) -> Int[np.ndarray, " N"]:
    """How often each robot would have shifted, there and back taken together.

    All begin in the gait for flat ground. A robot that has fallen shifts no more.
    """
    n = recording.robots
    state, count = condition.start(n), np.zeros(n, dtype=np.int64)
    for alive, signals in zip(recording.alive, recording, strict=True):
        state, fires = condition.step(state, signals, count % 2 == 1)
        count += fires & alive
    return count


def ever_fires(recording: Recording, rule: Rule, values: Float[np.ndarray, "T N M"]) -> bool:
    """Whether any robot fires a rule: where none does on the way there, none ever shifts."""
    alpha, beta = np.array([rule.alpha]), np.array([rule.beta])
    first = first_firings(values, recording.alive, rule, alpha, beta)
    return bool((first < len(recording.time)).any())


def chattered(recording: Recording, count: Int[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Whether each robot shifted more than once there and once back for each rough stretch.

    Once there and once back is nobody's chatter, even where no ground was rough: it is a false
    shift, and is told as such.
    """
    rough = recording.rough & recording.alive
    begun = rough & ~np.roll(rough, 1, axis=0)
    begun[0] = rough[0]
    return count > 2 * np.maximum(begun.sum(axis=0), 1)
