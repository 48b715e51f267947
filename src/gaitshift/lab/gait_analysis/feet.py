"""Figures of the feet: contacts, cycles, phases, clearance, slip."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.gait import RewardMachine
from gaitshift.lab.gait_analysis.base import Figure
from gaitshift.lab.gait_analysis.phase import Phases, axial_of
from gaitshift.lab.gait_analysis.sample import Sample

PerFoot = list[float] | None
"""Values in the order of `LEGS`; None: nothing to measure."""


def feet_figures(
    sample: Sample, machines: Mapping[str, RewardMachine]
) -> dict[str, Figure | PerFoot | list[Figure]]:
    """The figures of `measure` for feet and machines."""
    steps, contact = sample.steps, sample.contact
    cycles = sample.entries(machines)
    whole = _whole_cycles(cycles)
    machine = machines[sample.gait()]
    phases = Phases.of(sample.touchdowns, sample.period)
    moments = phases.moments(axial_of(machine))
    phase = np.angle(moments) / (2 * np.pi) % 1.0 / np.array(axial_of(machine))
    known = [fraction.size > 0 for fraction in phases.fractions]
    return {
        "slip": _slip(sample),
        "pattern_fraction": float(sample.log.stance_shown[sample.alive].mean()) if steps else None,
        "cycles_per_s": float(cycles.sum() / (steps * sample.period)) if steps else None,
        "touchdowns_per_cycle": _touchdowns_per_cycle(sample, machines, cycles, whole),
        "phase": _where(known, phase),
        "phase_consistency": _where(known, np.abs(moments)),
        "duty_factor": _duty_factor(sample, whole) if steps else None,
        "clearance": [_clearance(sample, leg) for leg in range(4)],
        "flight_fraction": float((sample.alive & ~contact.any(axis=2)).sum() / steps)
        if steps
        else None,
    }


def _where(known: list[bool], values: Float[np.ndarray, " 4"]) -> list[Figure]:
    return [float(value) if there else None for there, value in zip(known, values, strict=True)]


def _whole_cycles(entry: Bool[np.ndarray, "T N"]) -> Bool[np.ndarray, "T N"]:
    """Where each robot is between its first and its last entry into a cycle.

    Figures over whole cycles only: a partial cycle at either end would count some feet more often.
    """
    before = entry.cumsum(axis=0) - entry
    return (before >= 1) & (before < entry.sum(axis=0))


def _touchdowns_per_cycle(
    sample: Sample,
    machines: Mapping[str, RewardMachine],
    entry: Bool[np.ndarray, "T N"],
    whole: Bool[np.ndarray, "T N"],
) -> PerFoot:
    """Onsets over the touchdowns of the machine in whole cycles."""
    counts = np.bincount(sample.log.gait[entry & whole], minlength=len(sample.log.gaits))
    expected = counts @ np.array([machines[name].touchdowns for name in sample.log.gaits])
    if not expected.all():
        return None
    return ((sample.onsets & whole[..., None]).sum(axis=(0, 1)) / expected).tolist()


def _duty_factor(sample: Sample, whole: Bool[np.ndarray, "T N"]) -> list[float]:
    """Share of the steps of whole cycles that each foot is down; of all steps without a cycle."""
    taken = whole if whole.any() else sample.alive
    down = (sample.contact & taken[..., None]).sum(axis=(0, 1))
    return (down / taken.sum()).tolist()


def _clearance(sample: Sample, leg: int) -> Figure:
    """Median over the strides of a foot, touchdown to touchdown, of its greatest height [m]."""
    steps = len(sample.log.time)
    at = np.flatnonzero(sample.touchdowns[:, :, leg].T.ravel())
    if at.size < 2:
        return None
    heights = np.where(sample.alive, sample.log.truth.clearance[:, :, leg], -np.inf).T.ravel()
    highest = np.maximum.reduceat(heights, at)[:-1]
    one_robot = np.diff(at // steps) == 0
    return float(np.median(highest[one_robot])) if one_robot.any() else None


def _slip(sample: Sample) -> Figure:
    """Mean horizontal speed of feet that are down in two successive steps [m/s]."""
    position = sample.log.truth.foot_position_w[..., :2]
    both = sample.contact[1:] & sample.contact[:-1]
    if not both.any():
        return None
    speed = np.linalg.norm(np.diff(position, axis=0)[both], axis=-1) / sample.period
    return float(speed.mean(dtype=float))
