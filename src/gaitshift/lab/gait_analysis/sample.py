"""The part of a log from which figures are computed: robots on their feet after the warm-up."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Int

from gaitshift.gait import RewardMachine
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD

AIR = 0.06
"""A foot that is up for less time has bounced, not swung [s]. Ours: the shortest swing of the
shipped gaits is 0.08 s, bounces last 0.01 to 0.04 s."""

GROUND = 0.03
"""A foot that is down for less time has stubbed, not stood [s]. Ours: the shortest stance of the
shipped gaits is 0.08 s."""


def onsets(contact: Bool[np.ndarray, "T N 4"]) -> Bool[np.ndarray, "T N 4"]:
    """Where a foot is down that was up in the step before; nowhere at the first step."""
    onset = np.zeros_like(contact)
    onset[1:] = contact[1:] & ~contact[:-1]
    return onset


def steady(contact: Bool[np.ndarray, "T N 4"], period: float) -> Bool[np.ndarray, "T N 4"]:
    """Contacts in which bounces count as stance and stubs as swing.

    Gaps shorter than `AIR` are closed first, then contacts shorter than `GROUND` are dropped.
    Stretches that reach the start or the end of the log stay, because their length is unknown.
    `period` is the time of a step [s].
    """
    steps = contact.shape[0]
    rows = np.moveaxis(contact, 0, -1).reshape(contact.shape[1] * 4, steps)
    rows = _without_short(rows, value=False, least=AIR / period)
    rows = _without_short(rows, value=True, least=GROUND / period)
    return np.moveaxis(rows.reshape(*contact.shape[1:], steps), -1, 0)


def _without_short(
    rows: Bool[np.ndarray, "R T"], *, value: bool, least: float
) -> Bool[np.ndarray, "R T"]:
    """Rows in which inner stretches of `value` shorter than `least` steps are inverted."""
    count, steps = rows.shape
    if rows.size == 0:
        return rows
    flat = rows.ravel()
    begins = np.zeros(flat.size, dtype=bool)
    begins[1:] = flat[1:] != flat[:-1]
    begins[::steps] = True
    begin = np.flatnonzero(begins)
    length = np.diff(begin, append=flat.size)
    inner = (begin % steps > 0) & ((begin + length) % steps > 0)
    short = inner & (flat[begin] == value) & (length < least - 1e-9)
    return np.repeat(flat[begin] ^ short, length).reshape(count, steps)


WARM_UP = 2.0
"""Seconds at the start that are left out of every figure except survival and lateral error."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sample:
    """L control steps of N robots; a robot does not count after its fall."""

    log: Log
    """The log from the end of the warm-up on."""
    whole: Log
    """The log with its warm-up, whose last step precedes the first of the sample."""

    @classmethod
    def of(cls, log: Log, warm_up: float = WARM_UP) -> "Sample":
        """The sample of a whole log; empty where the log is no longer than the warm-up [s]."""
        begin = int(np.searchsorted(log.time, warm_up, side="right"))
        return cls(log=log[begin:], whole=log)

    @property
    def period(self) -> float:
        """Time of a control step [s]."""
        time = self.log.time
        return float(time[1] - time[0]) if len(time) > 1 else CONTROL_PERIOD

    @cached_property
    def alive(self) -> Bool[np.ndarray, "L N"]:
        """Whether a robot is on its feet; from its fall on it is not."""
        return ~self.log.fallen

    @cached_property
    def steps(self) -> int:
        """Control steps of all robots on their feet together."""
        return int(self.alive.sum())

    @cached_property
    def contact(self) -> Bool[np.ndarray, "L N 4"]:
        """Feet that are down in truth, of robots on their feet."""
        return self.log.truth.foot_contact & self.alive[..., None]

    @cached_property
    def onsets(self) -> Bool[np.ndarray, "L N 4"]:
        """Where a foot is down that was up in the step before: every contact, bounces too."""
        return self._late(onsets(self.whole.truth.foot_contact)) & self.alive[..., None]

    @cached_property
    def touchdowns(self) -> Bool[np.ndarray, "L N 4"]:
        """Where a foot ends a swing: onsets that are no bounce (`steady`)."""
        steps = onsets(steady(self.whole.truth.foot_contact, self.period))
        return self._late(steps) & self.alive[..., None]

    def entries(self, machines: Mapping[str, RewardMachine]) -> Bool[np.ndarray, "L N"]:
        """Where a machine returns to its first state, and so completes a cycle."""
        log = self.whole
        first = np.array([machines[gait].initial for gait in log.gaits])
        in_first = log.machine_state == first[log.gait]
        same_gait = log.gait[1:] == log.gait[:-1]
        entry = np.zeros_like(in_first)
        entry[1:] = in_first[1:] & ~in_first[:-1] & same_gait
        return self._late(entry) & self.alive

    def gait(self) -> str:
        """The gait that was active for most of the time."""
        counts: Int[np.ndarray, " G"] = np.bincount(
            self.log.gait.ravel(), minlength=len(self.log.gaits)
        )
        return self.log.gaits[int(counts.argmax())]

    def _late(self, course: Bool[np.ndarray, "T *rest"]) -> Bool[np.ndarray, "L *rest"]:
        """The part of an array over the whole log that belongs to the sample."""
        return course[len(self.whole.time) - len(self.log.time) :]
