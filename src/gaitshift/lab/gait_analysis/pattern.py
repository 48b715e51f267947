"""Contact patterns as a gait has them: its stance sets, one after the other in its order."""

import numpy as np
from jaxtyping import Bool, Int

from gaitshift.gait import RewardMachine
from gaitshift.gait.elements import feet_label
from gaitshift.robot.legs import LABEL_COUNT, label_of

BRIEF = 3
"""Patterns shown for fewer control steps are passed over: feet that land together land some 10 ms
apart, and what stands in between may look like a stance set out of order. Ours."""


def share_in_order(
    contact: Bool[np.ndarray, "L N 4"], alive: Bool[np.ndarray, "L N"], machine: RewardMachine
) -> float:
    """Share of the steps of robots on their feet that show a stance set of the gait in its order.

    Other patterns between two stance sets are passed over, as landings take a few steps, and so are
    stance sets that are shown for less than `BRIEF`. A stance set is in order where it and the two
    shown before it follow each other in the machine's cycle: two would not tell a half-bound, left
    and right hind foot in turn, from one that often lands on the same. A robot that stays in one
    stance set shows no order.
    """
    cycle = _cycle(machine)
    steps = len(alive)
    labels = label_of(contact).T.ravel()
    shown = np.flatnonzero(np.isin(labels, cycle) & alive.T.ravel())
    _, length = _visits(labels[shown], shown // steps)
    shown = shown[np.repeat(length >= BRIEF, length)]
    label, robot = labels[shown], shown // steps
    visit, length = _visits(label, robot)
    of, whose = label[visit], robot[visit]
    code = 256 * of[:-2] + 16 * of[1:-1] + of[2:]
    following = np.roll(cycle, -1)
    wanted = 256 * cycle + 16 * following + np.roll(cycle, -2)
    in_order = np.isin(code, wanted) & (whose[:-2] == whose[2:])
    return float(length[2:][in_order].sum() / max(1, alive.sum()))


def _visits(
    label: Int[np.ndarray, " K"], robot: Int[np.ndarray, " K"]
) -> tuple[Int[np.ndarray, " V"], Int[np.ndarray, " V"]]:
    """Where each robot begins to show another label, and for how many of the K it shows it."""
    visit = np.flatnonzero(np.diff(LABEL_COUNT * robot + label, prepend=-1) != 0)
    return visit, np.diff(visit, append=label.size)


def _cycle(machine: RewardMachine) -> np.ndarray:
    """Labels of the stance sets on the machine's cycle, in order."""
    stance = {state.name: feet_label(state.stance) for state in machine.states}
    return np.array([stance[machine.edges[number].source] for number in machine.cycle])
