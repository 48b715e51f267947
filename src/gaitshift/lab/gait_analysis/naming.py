"""Names the gait of robots by their contacts alone, independent of the commanded gait."""

from collections.abc import Iterable, Mapping

import numpy as np
from jaxtyping import Bool, Int

from gaitshift.gait import RewardMachine, gaits
from gaitshift.gait.elements import feet_label
from gaitshift.lab.gait_analysis.phase import Phases, axial_of, ideal_of
from gaitshift.lab.gait_analysis.sample import Sample
from gaitshift.robot.legs import LABEL_COUNT, label_of

NONE = "none"
"""The name for contacts of no known gait."""

LEAST_SCORE = 0.2
"""No gait is named below this score. Ours: noise, standing and flicker stay below 0.1; a gait that
shows its stance sets half of the time, with feet that touch twice a cycle, scores 0.25."""


UNSTEADY = 10.0
"""What steps off its stance cost a gait that stands; ours: feet that shiver do not stand."""


def gait_scores(sample: Sample, others: Iterable[RewardMachine] = ()) -> dict[str, float]:
    """Score in [0, 1] of every known gait, and of `others`, by name.

    It is the product phase · rhythm · pattern · firmness.

    - phase: resultant length times the cosine of the distance from the ideal phase, of the worst
      foot;
    - rhythm: touchdowns per stride of FL and those of the machine, the smaller over the larger, of
      the worst foot;
    - pattern: `share_in_order`;
    - firmness: touchdowns that end a swing over all onsets, of the foot that bounces most.

    For a gait with a leading side the better score of the gait and its mirror image counts. A gait
    that stands loses 1 for each tenth of the steps that do not show its stance, or are of robots
    with feet that step.
    """
    machines = {name: gaits.load(name) for name in gaits.names()}
    machines |= {machine.name: machine for machine in others}
    phases = Phases.of(sample.touchdowns, sample.period)
    firmness = _firmness(sample)
    return {
        name: _standing(sample, machine)
        if machine.stands
        else firmness * _score(sample, phases, machine)
        for name, machine in machines.items()
    }


def name_gait(scores: Mapping[str, float]) -> str:
    """The gait with the best score, or `NONE` where that is below `LEAST_SCORE`."""
    best = max(scores, key=lambda name: scores[name])
    return best if scores[best] >= LEAST_SCORE else NONE


def _standing(sample: Sample, machine: RewardMachine) -> float:
    stance = label_of(sample.contact) == feet_label(machine.states[0].stance)
    quiet = ~sample.touchdowns.any(axis=(0, 2))
    share = float((stance & sample.alive & quiet).sum() / max(1, sample.alive.sum()))
    return max(0.0, 1.0 - UNSTEADY * (1.0 - share))


def _score(sample: Sample, phases: Phases, machine: RewardMachine) -> float:
    sides = [machine] if machine.mirrored_states() is not None else [machine, machine.mirrored()]
    return max(
        _phase(phases, side) * _rhythm(phases, side) * _pattern(sample, side) for side in sides
    )


def _firmness(sample: Sample) -> float:
    firm, all_ = (each.sum(axis=(0, 1)) for each in (sample.touchdowns, sample.onsets))
    return float((firm / np.maximum(np.maximum(all_, firm), 1)).min())


def _phase(phases: Phases, machine: RewardMachine) -> float:
    axial = axial_of(machine)
    ideal = np.exp(2j * np.pi * np.array(axial) * ideal_of(machine))
    agreement = np.real(phases.moments(axial) * np.conj(ideal))
    return max(0.0, float(agreement.min()))


def _rhythm(phases: Phases, machine: RewardMachine) -> float:
    shown, wanted = phases.per_stride(), np.array(machine.touchdowns, dtype=float)
    if wanted[0] == 0 or phases.strides == 0:
        return 0.0
    wanted /= wanted[0]
    larger = np.maximum(np.maximum(shown, wanted), 1e-9)
    return float((np.minimum(shown, wanted) / larger).min())


def _pattern(sample: Sample, machine: RewardMachine) -> float:
    return share_in_order(sample.log.truth.foot_contact, sample.alive, machine)


BRIEF = 3
"""Patterns shown for fewer control steps are ignored. Ours: feet that land together touch about
10 ms apart, and the pattern in between may be a stance set out of order."""


def share_in_order(
    contact: Bool[np.ndarray, "L N 4"], alive: Bool[np.ndarray, "L N"], machine: RewardMachine
) -> float:
    """Share of the steps of robots on their feet that show a stance set of the gait in its order.

    Other patterns between two stance sets are ignored, as landings take a few steps, and so are
    stance sets shown for less than `BRIEF`. A stance set is in order where it and the two shown
    before it follow each other in the machine's cycle. Two would not be enough: a half-bound that
    alternates its hind feet and one that often lands on the same foot would score alike. A robot
    that stays in one stance set shows no order.
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
    """Where each robot begins to show another label, and for how many of the K steps."""
    visit = np.flatnonzero(np.diff(LABEL_COUNT * robot + label, prepend=-1) != 0)
    return visit, np.diff(visit, append=label.size)


def _cycle(machine: RewardMachine) -> np.ndarray:
    """Labels of the stance sets on the machine's cycle, in order."""
    stance = {state.name: feet_label(state.stance) for state in machine.states}
    return np.array([stance[machine.edges[number].source] for number in machine.cycle])
