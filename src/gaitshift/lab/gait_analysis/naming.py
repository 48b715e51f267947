"""Names the gait of robots by their contacts alone, whatever gait was asked for."""

from collections.abc import Iterable, Mapping

import numpy as np

from gaitshift.gait import RewardMachine, gaits
from gaitshift.lab.gait_analysis.pattern import share_in_order
from gaitshift.lab.gait_analysis.phase import Phases, axial_of, ideal_of
from gaitshift.lab.gait_analysis.sample import Sample

NONE = "none"
"""The name of what is no known gait."""

LEAST_SCORE = 0.2
"""Below it no gait is named. Ours: noise, standing and flicker stay below 0.1; a gait that shows
its stance sets half of the time, with feet that touch twice a cycle, comes to 0.25."""


def gait_scores(sample: Sample, others: Iterable[RewardMachine] = ()) -> dict[str, float]:
    """Score in [0, 1] of every known gait, and of `others`, by name.

    It is the product phase · rhythm · pattern · firmness.

    - phase: of the foot that keeps it worst, the resultant length times the cosine of its distance
      from the ideal phase;
    - rhythm: of the foot that keeps it worst, touchdowns a stride of FL against the machine's, the
      smaller over the larger;
    - pattern: `share_in_order`;
    - firmness: of the foot that bounces most, touchdowns that end a swing over all onsets.

    A gait with a leading side is known by its mirror image as well: the better of both counts.
    """
    machines = {name: gaits.load(name) for name in gaits.names()}
    machines |= {machine.name: machine for machine in others}
    phases = Phases.of(sample.touchdowns, sample.period)
    firmness = _firmness(sample)
    return {name: firmness * _score(sample, phases, machine) for name, machine in machines.items()}


def name_gait(scores: Mapping[str, float]) -> str:
    """The gait of the best score, or `NONE` where even that is below `LEAST_SCORE`."""
    best = max(scores, key=lambda name: scores[name])
    return best if scores[best] >= LEAST_SCORE else NONE


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
    kept = np.real(phases.moments(axial) * np.conj(ideal))
    return max(0.0, float(kept.min()))


def _rhythm(phases: Phases, machine: RewardMachine) -> float:
    shown, wanted = phases.per_stride(), np.array(machine.touchdowns, dtype=float)
    if wanted[0] == 0 or phases.strides == 0:
        return 0.0
    wanted /= wanted[0]
    larger = np.maximum(np.maximum(shown, wanted), 1e-9)
    return float((np.minimum(shown, wanted) / larger).min())


def _pattern(sample: Sample, machine: RewardMachine) -> float:
    return share_in_order(sample.log.sensed.contact, sample.alive, machine)
