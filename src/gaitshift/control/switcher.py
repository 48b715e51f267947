"""Switchers change the gaits of robots: by the conditions of a gait graph, or on a schedule."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool

from gaitshift.control.controller import Controller
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.state import Privileged, Proprioception
from gaitshift.shift.graph import Decision, GaitGraph

_ROUNDING = 1e-9
"""Times are multiples of 10 ms, give or take this [s]."""


@runtime_checkable
class Switcher(Protocol):
    """Decides from proprioception in each control step, and changes gaits of the controller."""

    def step(
        self, sensed: Proprioception, controller: Controller, truth: Privileged | None = None
    ) -> Decision:
        """Decides for all robots.

        `sensed` has the time and the command before the speed loop's trim. `truth` is for switchers
        with an oracle.
        """
        ...


class Autonomous:
    """The paper's higher controller for any gait graph: robots shift by its conditions."""

    def __init__(
        self,
        graph: GaitGraph,
        n: int,
        *,
        rough: Callable[[Privileged], Bool[np.ndarray, " N"]] | None = None,
    ) -> None:
        """All n robots start in the graph's first gait, with counters at 0.

        `rough` says which robots are on rough ground, for a graph with an oracle.
        """
        self.graph = graph
        self._rough = rough
        self._state = graph.begin(n)

    def retune(self, graph: GaitGraph) -> None:
        """Continues with other numbers on the same edges and statistics, and the same state.

        Raises:
            GaitshiftError: gaits, edges or statistics differ.
        """
        before, after = (
            (g.statistics, [(e.source, e.target, e.statistic) for e in g.edges])
            for g in (self.graph, graph)
        )
        if before != after:
            raise GaitshiftError("the new graph must have the same edges and statistics")
        self.graph = graph

    def step(
        self, sensed: Proprioception, controller: Controller, truth: Privileged | None = None
    ) -> Decision:
        """Updates the counters; a robot whose edge fires changes to the target gait."""
        if "value" in self.graph.needs and sensed.value is None:
            sensed = sensed.having(value=controller.value())
        rough = None if self._rough is None or truth is None else self._rough(truth)
        gaits = controller.repertoire.gaits
        known = np.array([_index(self.graph.gaits, gait) for gait in gaits])
        before = replace(self._state, gait=known[controller.gait])
        self._state, decision = self.graph.step(before, sensed, rough)
        if decision.fired.any():
            for index, gait in enumerate(self.graph.gaits):
                ids = np.flatnonzero(decision.fired & (self._state.gait == index))
                if ids.size:
                    controller.switch(ids, gait, sensed)
        return decision


def _index(gaits: tuple[str, ...], gait: str) -> int:
    return gaits.index(gait) if gait in gaits else -1


@dataclass(frozen=True)
class Scheduled:
    """Gait changes at given times, for all robots at once, as in the paper's sequence of seven."""

    plan: tuple[tuple[float, str], ...]
    """Times [s] and the gait that begins there, in order."""

    def step(
        self, sensed: Proprioception, controller: Controller, truth: Privileged | None = None
    ) -> Decision:
        """Makes the gait changes that are due in the control step that ends now."""
        late = float(sensed.time) + _ROUNDING
        fired = np.zeros(controller.n, dtype=bool)
        for start, gait in self.plan:
            if late - CONTROL_PERIOD < start <= late:
                controller.switch(np.arange(controller.n), gait, sensed)
                fired[:] = True
        return uncounted(fired)


def uncounted(fired: Bool[np.ndarray, " N"]) -> Decision:
    """The decision of a switcher without counters."""
    nothing = np.zeros(len(fired))
    return Decision(fired=fired, k=nothing, threshold=nothing)
