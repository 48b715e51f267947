"""The gait graph: gaits as nodes, shift conditions on edges. Only the graph counts k."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from reprlib import repr as shortened
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.gait.drawing import mermaid_ids
from gaitshift.robot.state import Proprioception
from gaitshift.shift.rule import Modulation, Rule
from gaitshift.shift.statistic import begun_anew
from gaitshift.shift.statistics import Watched, watch

MOST_EDGES = 256
"""Most edges of a graph; ours: their pairs are compared, and eight gaits have 56."""

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_ -]*")


@dataclass(frozen=True, kw_only=True)
class Edge:
    """An edge from one gait to another."""

    source: str
    """The gait it leaves."""
    target: str
    """The gait it leads to."""
    statistic: str
    """Name, in the graph, of the statistic of its rule."""
    rule: Rule
    """The rule by which it fires."""
    priority: int = 0
    """Of two edges that fire in the same step the one with the higher priority is taken."""
    modulation: Modulation | None = None
    """How α depends on time or speed; None: α is constant."""

    @property
    def name(self) -> str:
        """Its name in error messages."""
        return f"{self.source} -> {self.target}"


@dataclass(frozen=True, kw_only=True, eq=False)
class GraphState:
    """State of a graph for N robots between two steps."""

    gait: Int[np.ndarray, " N"]
    """Index into the graph's `gaits` of each robot's gait; -1: none of them."""
    k: Float[np.ndarray, "N E"]
    """The paper's counter of each edge [counts]."""
    time_in_gait: Float[np.ndarray, " N"]
    """Time since the last shift [s]."""
    memory: Mapping[str, Any]
    """Memory of each statistic, by its name in the graph."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Decision:
    """Decision of a graph for N robots in one step."""

    fired: Bool[np.ndarray, " N"]
    """Which robots change their gait now; `GraphState.gait` has the new one."""
    k: Float[np.ndarray, " N"]
    """The counter of the edge that is nearest to firing, before a shift resets it [counts]."""
    threshold: Float[np.ndarray, " N"]
    """The β of that edge [counts]; 0 where no edge leaves the gait."""


@dataclass(frozen=True, kw_only=True)
class GaitGraph:
    """Gaits as nodes, conditions on the edges between them; checked when it is built.

    The paper's Algorithm 1 (III-E) is an edge, its reverse (IV-C) the edge back. A graph works with
    any controller, learned or model-based (III-F). α may change between steps (III-E): continue
    with the same state and another graph, or give an edge a `modulation`.

    Raises:
        GaitshiftError: no edges; an edge to its own gait; a gait that cannot be reached; two edges
            of one gait that could fire in the same step; an unknown statistic.
    """

    start: str
    """The gait at the beginning."""
    statistics: Mapping[str, Watched]
    """Statistics by name."""
    edges: tuple[Edge, ...]
    """The edges."""
    reset: bool = True
    """Whether a shift sets the robot's counters to 0."""
    forget: bool = True
    """Whether statistics begin anew as well; else what they know of the ground stays."""

    def __post_init__(self) -> None:
        if not self.edges:
            raise GaitshiftError("a gait graph must have at least one edge, got none")
        if len(self.edges) > MOST_EDGES:
            raise GaitshiftError(
                f"a gait graph must have {MOST_EDGES} edges or fewer, got {len(self.edges)}"
            )
        for name in (*self.gaits, *self.statistics):
            if not _NAME.fullmatch(name):
                raise GaitshiftError(
                    "names of gaits and statistics must be letters, digits, blanks, '_' and '-', a "
                    f"letter first, got {shortened(name)}"
                )
        for edge in self.edges:
            if edge.source == edge.target:
                raise GaitshiftError(
                    f"edge {edge.name}: source and target must be different gaits, got "
                    f"{edge.source!r} for both"
                )
            if edge.statistic not in self.statistics:
                known = tuple(self.statistics)
                raise GaitshiftError(
                    f"edge {edge.name}: {known_names('statistic', edge.statistic, known)}"
                )
        for a, b in combinations(self.edges, 2):
            if a.source == b.source and a.priority == b.priority:
                raise GaitshiftError(
                    f"edges {a.name} and {b.name} leave the same gait with the same priority "
                    f"{a.priority}; priorities must differ"
                )
        self._check_reach()

    def _check_reach(self) -> None:
        reached = {self.start}
        while more := {e.target for e in self.edges if e.source in reached} - reached:
            reached |= more
        lost = [gait for gait in self.gaits if gait not in reached]
        if lost:
            raise GaitshiftError(
                f"no edges lead from the start gait '{self.start}' to the gait '{lost[0]}'"
            )

    @cached_property
    def gaits(self) -> tuple[str, ...]:
        """The gaits, each once, the first one first."""
        ends = (gait for edge in self.edges for gait in (edge.source, edge.target))
        return tuple(dict.fromkeys((self.start, *ends)))

    @property
    def needs(self) -> frozenset[str]:
        """Optional fields of `Proprioception` that its statistics read."""
        return frozenset(name for one in self.statistics.values() for name in one.needs)

    def begin(self, n: int) -> GraphState:
        """State of n robots in the first gait before their first step."""
        return GraphState(
            gait=np.zeros(n, dtype=np.int64),
            k=np.zeros((n, len(self.edges))),
            time_in_gait=np.zeros(n),
            memory={name: one.start(n) for name, one in self.statistics.items()},
        )

    def step(
        self,
        state: GraphState,
        sensed: Proprioception,
        rough: Bool[np.ndarray, " N"] | None = None,
    ) -> tuple[GraphState, Decision]:
        """State after one control step of N robots, and which robots shift now.

        Each edge that leaves a robot's gait counts independently; the first to fire is taken.
        `rough` is the true label of the ground, for an oracle. The arguments are not changed.
        """
        memory, values = dict[str, Any](), dict[str, np.ndarray]()
        for name, one in self.statistics.items():
            memory[name], values[name] = watch(one, state.memory[name], sensed, rough)
        time = state.time_in_gait + sensed.period
        k, fires, decision = self._count(state, sensed, values, time)
        if not decision.fired.any():
            return replace(state, k=k, time_in_gait=time, memory=memory), decision
        gait = state.gait.copy()
        free = np.ones(len(gait), dtype=bool)
        for index in self._by_priority:
            takes = free & fires[:, index]
            gait[takes] = self.gaits.index(self.edges[index].target)
            free &= ~takes
            # Edges of the new gait start at 0 or, as the paper has one k, continue from it.
            k[takes] = 0.0 if self.reset else k[takes, index, None]
        if self.reset and self.forget:
            for name, one in self.statistics.items():
                memory[name] = begun_anew(one, memory[name], decision.fired)
        time = np.where(decision.fired, 0.0, time)
        return GraphState(gait=gait, k=k, time_in_gait=time, memory=memory), decision

    def _count(
        self,
        state: GraphState,
        sensed: Proprioception,
        values: Mapping[str, np.ndarray],
        time: Float[np.ndarray, " N"],
    ) -> tuple[Float[np.ndarray, "N E"], Bool[np.ndarray, "N E"], Decision]:
        """Updated counters of the edges that leave each robot's gait, and which edges fire."""
        n, after = len(state.gait), state.k.copy()
        k, threshold, nearest = np.zeros(n), np.zeros(n), np.full(n, -np.inf)
        fires = np.zeros(after.shape, dtype=bool)
        for index, edge in enumerate(self.edges):
            here = state.gait == self.gaits.index(edge.source)
            if not here.any():
                continue
            factor = 1.0 if edge.modulation is None else edge.modulation.factor(sensed)
            counted = edge.rule.step(after[:, index], values[edge.statistic], factor)
            after[here, index] = counted[here]
            fires[:, index] = here & edge.rule.fires(counted, time)
            near = counted / (edge.rule.beta + 1.0)
            closer = here & (near > nearest)
            nearest[closer] = near[closer]
            k[closer], threshold[closer] = counted[closer], edge.rule.beta
        return after, fires, Decision(fired=np.asarray(fires.any(axis=1)), k=k, threshold=threshold)

    @cached_property
    def _by_priority(self) -> tuple[int, ...]:
        """Indices of the edges, those of high priority first."""
        return tuple(sorted(range(len(self.edges)), key=lambda i: -self.edges[i].priority))

    def mermaid(self) -> str:
        """The graph as a Mermaid `stateDiagram-v2`: one line per edge, with its rule."""
        ids = mermaid_ids(self.gaits)
        lines = ["stateDiagram-v2", "    direction LR"]
        lines += [f"    {ids[gait]} : {gait}" for gait in self.gaits if ids[gait] != gait]
        lines += [f"    [*] --> {ids[self.start]}"]
        for edge in self.edges:
            unit = self.statistics[edge.statistic].unit
            rule = f"{edge.statistic} {edge.rule.when} {edge.rule.alpha:g} {unit}".rstrip()
            ends = f"{ids[edge.source]} --> {ids[edge.target]}"
            lines.append(f"    {ends} : {rule}, k over {edge.rule.beta:g}")
        return "\n".join(lines) + "\n"
