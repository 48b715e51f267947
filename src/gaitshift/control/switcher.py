"""Who changes the gaits: conditions on a graph, or a schedule."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.control.controller import Controller
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.robot.motion import Motion
from gaitshift.shift.graph import GaitGraph
from gaitshift.shift.signals import Signals
from gaitshift.shift.statistic import AnyStatistic, begun_anew
from gaitshift.shift.statistics.height_difference import HeightDifference

_ROUNDING = 1e-9
"""Times are multiples of 10 ms, give or take this [s]."""


@dataclass(frozen=True, kw_only=True)
class Decision:
    """What a switcher saw in one step, for logs: zero where it has no such notion."""

    k: Float[np.ndarray, " N"]
    """The counter, before a firing sets it back to 0, of the edge that is nearest to firing."""
    threshold: Float[np.ndarray, " N"]
    """What k was held against."""
    foot_height: Float[np.ndarray, "N 4"]
    """h_i: height of each foot at its last touch, in the condition's frame [m]."""


@runtime_checkable
class Switcher(Protocol):
    """Looks at the motion once a control step and changes gaits through what drives them."""

    def step(self, time: float, motion: Motion, driver: Controller, command: Command) -> Decision:
        """Decides for all robots at `time` [s]; `command` is what is wanted of them.

        What a speed loop makes of it, and the driver is asked for, may be something else.
        """
        ...


class Autonomous:
    """The paper's higher controller, over any gait graph: the robots shift by its conditions.

    Of the edges that leave a robot's gait each counts on its own; the first to fire is taken.
    """

    def __init__(
        self, graph: GaitGraph, n: int, *, sees: Callable[[Motion], np.ndarray] | None = None
    ) -> None:
        """All n robots stand in the graph's first gait, nothing counted yet.

        `sees` tells which robots are on rough ground, for a graph with an oracle.
        """
        self.graph = graph
        self._sees = sees
        self._statistics: dict[str, AnyStatistic] = {**graph.statistics}
        heights = [s for s in self._statistics.values() if isinstance(s, HeightDifference)]
        self._logged = heights[0] if heights else HeightDifference()
        self._height = self._logged.start(n)
        self._asks_critic = any("value" in s.needs for s in self._statistics.values())
        self._memory: dict[str, Any] = {k: s.start(n) for k, s in self._statistics.items()}
        self._k = np.zeros((n, len(graph.edges)))
        self._time_in_gait = np.zeros(n)

    def retune(self, graph: GaitGraph) -> None:
        """Goes on with other numbers on the same edges and statistics; nothing is forgotten.

        Raises:
            GaitshiftError: gaits, edges or statistics are others.
        """
        before, after = (
            (g.statistics, [(e.source, e.target, e.statistic) for e in g.edges])
            for g in (self.graph, graph)
        )
        if before != after:
            raise GaitshiftError(
                "a running graph cannot change its edges or statistics, only their numbers"
            )
        self.graph = graph

    def step(self, time: float, motion: Motion, driver: Controller, command: Command) -> Decision:
        """Lets the edges count; where one fires, the robot changes to the gait it leads to."""
        rough = None if self._sees is None else self._sees(motion)
        value = driver.value() if self._asks_critic else None
        signals = Signals.from_motion(motion, time=time, command=command, value=value, rough=rough)
        values: dict[str, np.ndarray] = {}
        for name, statistic in self._statistics.items():
            self._memory[name], values[name] = statistic.step(self._memory[name], signals)
        self._height, _ = self._logged.step(self._height, signals)
        self._time_in_gait = self._time_in_gait + signals.period
        decision, fire = self._count(signals, values, driver)
        self._shift(fire, motion, driver)
        return decision

    def _count(
        self, signals: Signals, values: dict[str, np.ndarray], driver: Controller
    ) -> tuple[Decision, Bool[np.ndarray, "N E"]]:
        """Moves the counters of the edges that leave each robot's gait: which of them fire."""
        n = len(self._k)
        k, threshold, nearest = np.zeros(n), np.zeros(n), np.full(n, -np.inf)
        fire = np.zeros(self._k.shape, dtype=bool)
        for index, edge in enumerate(self.graph.edges):
            here = driver.gait == driver.gaits.index(edge.source)
            if not here.any():
                continue
            factor = 1.0 if edge.modulation is None else edge.modulation.factor(signals)
            counted = edge.rule.step(self._k[:, index], values[edge.statistic], factor)
            self._k[here, index] = counted[here]
            fire[:, index] = here & edge.rule.fires(counted, self._time_in_gait)
            near = counted / (edge.rule.beta + 1.0)
            closer = here & (near > nearest)
            nearest[closer] = near[closer]
            k[closer], threshold[closer] = counted[closer], edge.rule.beta
        height = np.where(np.isnan(self._height), 0.0, self._height)  # 0: it never touched
        return Decision(k=k, threshold=threshold, foot_height=height), fire

    def _shift(self, fire: Bool[np.ndarray, "N E"], motion: Motion, driver: Controller) -> None:
        if not fire.any():
            return
        edges = self.graph.edges
        free = np.ones(len(self._k), dtype=bool)
        for index in sorted(range(len(edges)), key=lambda i: -edges[i].priority):
            takes = free & fire[:, index]
            driver.switch(np.flatnonzero(takes), edges[index].target, motion)
            free &= ~takes
            # the edges of the new gait start anew or, as there is one k in the paper, go on from it
            self._k[takes] = 0.0 if self.graph.reset else self._k[takes, index, None]
        if self.graph.reset:
            for name, statistic in self._statistics.items():
                self._memory[name] = begun_anew(statistic, self._memory[name], ~free)
        self._time_in_gait[~free] = 0.0


@dataclass(frozen=True)
class Scheduled:
    """Gaits changed at given times, for all robots at once: the paper's seven in a row."""

    plan: tuple[tuple[float, str], ...]
    """Times [s] and the gait that begins there, in order."""

    def step(self, time: float, motion: Motion, driver: Controller, command: Command) -> Decision:
        """Carries out what fell due in the control step that ends at `time`."""
        late = time + _ROUNDING
        for start, gait in self.plan:
            if late - CONTROL_PERIOD < start <= late:
                driver.switch(np.arange(driver.n), gait, motion)
        nothing = np.zeros(driver.n)
        return Decision(k=nothing, threshold=nothing, foot_height=np.zeros((driver.n, 4)))
