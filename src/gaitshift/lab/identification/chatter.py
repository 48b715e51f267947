"""Chatter: how often robots would shift to the rough gait and back, by two rules."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.lab.identification.firings import first_firings
from gaitshift.lab.identification.labelled_run import LabelledRun, Way
from gaitshift.robot.state import Proprioception
from gaitshift.shift import GaitGraph, Rule, load_graph, there_and_back, ways
from gaitshift.shift.statistics import Watched


@dataclass(frozen=True, kw_only=True, eq=False)
class RecordedValues:
    """A statistic that replays values computed before; a reset does not change them."""

    values: Float[np.ndarray, "T N M"]
    """Of all steps."""

    unit = ""
    needs = ()
    search = None

    @property
    def width(self) -> int:
        """M."""
        return self.values.shape[2]

    def start(self, n: int) -> int:
        """The first step."""
        del n
        return 0

    def step(self, state: int, sensed: Proprioception) -> tuple[int, Float[np.ndarray, "N M"]]:
        """The index of the next step, and the values of this one."""
        del sensed
        return state + 1, self.values[state]


def shipped_rule(*, back: bool) -> Rule:
    """The default graph's rule of the way there or back, used for the way that is not judged."""
    return ways(load_graph())[back].rule


def in_turn(rule: Rule, statistic: Watched, way: Way) -> GaitGraph:
    """A graph with this rule on this way, and the default graph's on the other."""
    shipped = load_graph()
    there, back = ways(shipped)
    if way == "rough":
        return there_and_back(
            statistic,
            replace(there.rule, alpha=rule.alpha, beta=rule.beta, leak=rule.leak),
            back.rule,
            statistic_back=shipped.statistics[back.statistic],
        )
    return there_and_back(
        shipped.statistics[there.statistic],
        there.rule,
        replace(back.rule, alpha=rule.alpha, beta=rule.beta, leak=rule.leak),
        statistic_back=statistic,
    )


def shifts(recording: LabelledRun, graphs: Sequence[GaitGraph]) -> Int[np.ndarray, "G N"]:
    """Number of shifts of each robot by each of the graphs, there and back together.

    All begin in the gait for flat ground. A robot that has fallen no longer shifts.
    """
    n = recording.robots
    states = [graph.begin(n) for graph in graphs]
    count = np.zeros((len(graphs), n), dtype=np.int64)
    for alive, sensed, rough in zip(recording.alive, recording, recording.rough, strict=True):
        for i, graph in enumerate(graphs):
            before = replace(states[i], gait=count[i] % 2)
            states[i], decision = graph.step(before, sensed, rough)
            count[i] += decision.fired & alive
    return count


def ever_fires(recording: LabelledRun, rule: Rule, values: Float[np.ndarray, "T N M"]) -> bool:
    """Whether a rule fires for any robot; if not, no robot ever shifts."""
    alpha, beta = np.array([rule.alpha]), np.array([rule.beta])
    first = first_firings(values, recording.alive, rule, alpha, beta)
    return bool((first < len(recording.time)).any())


def chattered(recording: LabelledRun, count: Int[np.ndarray, " N"]) -> Bool[np.ndarray, " N"]:
    """Whether each robot shifted more than once there and once back for each rough stretch.

    One shift there and one back never count as chatter, even without rough ground: they are
    reported as false shifts.
    """
    rough = recording.rough & recording.alive
    begun = rough & ~np.roll(rough, 1, axis=0)
    begun[0] = rough[0]
    return count > 2 * np.maximum(begun.sum(axis=0), 1)
