"""Contact patterns as a gait has them: its stance sets, one after the other in its order."""

import numpy as np
from jaxtyping import Bool

from gaitshift.legs import label_of
from gaitshift.reward_machine import RewardMachine
from gaitshift.reward_machine.feet import feet_label


def share_in_order(
    contact: Bool[np.ndarray, "L N 4"], alive: Bool[np.ndarray, "L N"], machine: RewardMachine
) -> float:
    """Share of the steps of robots on their feet that show a stance set of the gait in its order.

    Other patterns between two stance sets are passed over, as landings take a few steps. A stance
    set is in order where it and the two shown before it follow each other in the machine's cycle:
    two would not tell a half-bound, left and right hind foot in turn, from one that often lands
    on the same. A robot that stays in one stance set shows no order.
    """
    cycle = _cycle(machine)
    steps, robots = alive.shape
    labels = label_of(contact).T.ravel()
    shown = np.flatnonzero(np.isin(labels, cycle) & alive.T.ravel())
    if shown.size == 0:
        return 0.0
    label, robot = labels[shown], shown // steps
    visit = np.flatnonzero(np.diff(label * robots + robot, prepend=-1) != 0)
    length = np.diff(visit, append=shown.size)
    of, whose = label[visit], robot[visit]
    code = 256 * of[:-2] + 16 * of[1:-1] + of[2:]
    following = np.roll(cycle, -1)
    wanted = 256 * cycle + 16 * following + np.roll(cycle, -2)
    in_order = np.isin(code, wanted) & (whose[:-2] == whose[2:])
    return float(length[2:][in_order].sum() / alive.sum())


def _cycle(machine: RewardMachine) -> np.ndarray:
    """Labels of the stance sets on the machine's cycle, in order."""
    stance = {state.name: feet_label(state.stance) for state in machine.states}
    return np.array([stance[machine.edges[number].source] for number in machine.cycle])
