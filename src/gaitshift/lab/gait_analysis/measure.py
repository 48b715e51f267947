"""All figures of a log, of base, joints and feet: what `gaitshift evaluate` prints."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.gait import RewardMachine
from gaitshift.lab.gait_analysis.naming import gait_scores, name_gait
from gaitshift.lab.gait_analysis.phase import Phases, axial_of
from gaitshift.lab.gait_analysis.sample import WARM_UP, Sample
from gaitshift.lab.gait_analysis.verdict import checks
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot
from gaitshift.robot.state import GRAVITY

_SHORTEST_DRIFT = 0.5
"""Robots that fall sooner after the warm-up have no drift [s]."""

Figure = float | None
"""None: nothing to measure."""


def base_figures(sample: Sample, robot: Robot) -> dict[str, Figure]:
    """The figures of `measure` for base and joints of this robot."""
    log, alive = sample.log, sample.alive
    if sample.steps == 0:
        return dict.fromkeys(_NAMES)
    sensed = log.sensed
    command = sensed.need("forward_speed_command", "gait figures")[alive]
    speed = log.truth.forward_speed[alive]
    mean = float(speed.mean(dtype=float))
    joint_speed = sensed.need("joint_velocity", "gait figures")[alive]
    torque = sensed.need("joint_torque", "gait figures")[alive]
    power = sensed.power[alive]
    turn = sensed.need("angular_velocity_b", "gait figures")[..., :2][alive]
    too_fast = np.abs(joint_speed).max(axis=-1) > robot.motor.no_load_speed
    height = sensed.base_height[alive]
    drag = robot.mass * GRAVITY * max(abs(mean), 1e-3)  # power of a cost of transport of 1
    values = (
        mean,
        abs(mean - float(command.mean())),
        float(np.sqrt(np.square(speed - command).mean())),
        _heading_drift(sample),
        float(sensed.yaw[alive].std()),
        float(power.mean(dtype=float)) / drag,
        float(robot.motor.electrical_power(torque, joint_speed).mean(dtype=float)) / drag,
        mean**2 / (GRAVITY * max(float(np.median(height)), 1e-3)),
        float(turn[:, 0].std(dtype=float)),
        float(turn[:, 1].std(dtype=float)),
        float(too_fast.mean()),
        float(robot.motor.is_saturated(torque, joint_speed).mean()),
        robot.motor.winding_rise(torque),
        float(log.truth.velocity_b[..., 1][alive].mean(dtype=float)),
        float(sensed.need("angular_velocity_b", "gait figures")[..., 2][alive].mean(dtype=float)),
        float(height.mean(dtype=float)) - robot.stance_height,
        _drift(sample),
    )
    return dict(zip(_NAMES, values, strict=True))


_NAMES = (
    "speed_mean",
    "speed_error",
    "speed_rmse",
    "heading_drift",
    "heading_error_sd",
    "cost_of_transport",
    "electrical_cost_of_transport",
    "froude",
    "roll_rate_sd",
    "pitch_rate_sd",
    "overspeed",
    "saturation",
    "winding_rise",
    "lateral_speed_mean",
    "yaw_rate_mean",
    "height_mean",
    "drift",
)


STALL = 2.0
"""Time without a change of state after which a machine has stalled [s]; ours: two cycles of the
slowest shipped gait."""


def stalled(log: Log) -> Figure:
    """Share of the robots on their feet at the end whose machine has stalled; None: too short."""
    upright, steps = ~log.fallen[-1], round(STALL / Sample.of(log, 0.0).period)
    if not upright.any() or len(log.time) <= steps:
        return None
    state, gait = (of[-steps - 1 :, upright] for of in (log.machine_state, log.gait))
    same = (state == state[0]).all(axis=0) & (gait == gait[0]).all(axis=0)
    return float(same.mean())


def lateral_error(log: Log) -> Figure:
    """95th percentile over robots on their feet of their final distance from their line [m]."""
    upright = ~log.fallen[-1]
    if not upright.any():
        return None
    return float(
        np.quantile(
            np.abs(
                log.truth.base_position_w[-1, upright, 1] - log.truth.base_position_w[0, upright, 1]
            ),
            0.95,
        )
    )


def _drift(sample: Sample) -> Figure:
    """Furthest that a robot on its feet is at the end from where it was after the warm-up [m]."""
    upright = sample.alive[-1]
    if not upright.any():
        return None
    place = sample.log.truth.base_position_w[:, upright, :2].astype(float)
    return float(np.linalg.norm(place[-1] - place[0], axis=-1).max())


def _heading_drift(sample: Sample) -> Figure:
    """Root mean square over the robots of their mean yaw rate less the commanded one [rad/s].

    A robot that needs a constant command to walk straight drifts by it, though it keeps its line.
    """
    last = sample.alive.sum(axis=0) - 1
    long_enough = np.flatnonzero(last * sample.period >= _SHORTEST_DRIFT)
    if long_enough.size == 0:
        return None
    end = last[long_enough]
    heading = np.unwrap(sample.log.sensed.yaw[:, long_enough].astype(float), axis=0)
    turned = heading[end, np.arange(len(end))] - heading[0]
    asked_for = sample.log.sensed.need("yaw_rate_command", "gait figures")[:, long_enough]
    commanded = asked_for.cumsum(axis=0) * sample.period
    asked = commanded[end, np.arange(len(end))] - commanded[0]
    return float(np.sqrt(np.square((turned - asked) / (end * sample.period)).mean()))


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


def measure(
    log: Log, machines: Mapping[str, RewardMachine], robot: Robot, *, warm_up: float = WARM_UP
) -> dict[str, Any]:
    """Figures of a log, over all robots while they are on their feet, after the warm-up.

    Robots are pooled. A figure is None where there was nothing to measure.

    - `survival`: share of robots that never fell, warm-up included.
    - `diverged`: number of robots whose simulation diverged, warm-up included; they have fallen.
    - `speed_mean` [m/s]: mean velocity along body x; `speed_error` [m/s]: its distance from the
      mean command; `speed_rmse` [m/s]: root mean square of the difference at each step.
    - `heading_drift` [rad/s]: root mean square over robots of the net turn less the commanded turn,
      over its time; `heading_error_sd` [rad]: spread of the heading about the line x.
    - `cost_of_transport`: mean mechanical power Σ|τ q̇| over m·g·v; `electrical_cost_of_transport`:
      that of the motors' electrical power (`Motor.electrical_power`).
    - `froude`: v²/(g h), v the mean speed, h the median height of the base over the lowest foot.
    - `roll_rate_sd`, `pitch_rate_sd` [rad/s]: spread of the body's angular velocity about x and y.
    - `overspeed`: share of steps in which a joint is faster than its motor without load.
    - `saturation`: share of joints and steps in which a motor gives all its torque.
    - `winding_rise` [K]: temperature of the hottest joint's windings over the air in the long run,
      where the robot's description has a thermal resistance.
    - `lateral_speed_mean` [m/s], `yaw_rate_mean` [rad/s]: mean velocity along body y, and mean
      angular velocity about body z.
    - `height_mean` [m]: mean height of the base over the lowest foot, from that of the stance.
    - `drift` [m]: greatest distance over robots between the places after the warm-up and at the
      end.
    - `slip` [m/s]: mean horizontal speed of the feet in contact.
    - `pattern_fraction`: share of steps whose contacts are a stance set of the gait's machine.
    - `cycles_per_s` [Hz]: full cycles of the machine, counted by entries into its first state.
    - `touchdowns_per_cycle` (4,): raw contact onsets of each foot over those of the machine, in
      whole cycles: 1 where no foot bounces, also for a gait with two touchdowns per cycle.
    - `phase` (4,) [stride of FL], `phase_consistency` (4,): circular mean and resultant length of
      touchdowns within the strides of FL (`phase.Phases`), 0 and 1 for FL itself.
    - `duty_factor` (4,): share of the time of whole cycles that each foot is down.
    - `clearance` (4,) [m]: median over strides of the greatest height of the sole over the ground.
    - `flight_fraction`: share of steps with no foot down.
    - `lateral_error_p95` [m]: 95th percentile of the distance from the line, at the end.
    - `stalled`: share of robots on their feet at the end whose machine has not changed its state
      for 2 s: they stand. 0 for a gait that stands by its definition.
    - `verdict`: `gait`, the name by the contacts alone, or "none"; `scores` of every known gait;
      `clean`, whether the name is that of the active gait and all its limits are met; `misses`,
      the limits that are not met.

    Args:
        log: the run; where it has several gaits, phases and verdict are those of the one that was
            active for most of the time.
        machines: the machines of the gaits in it, by name.
        robot: the robot of the log, for its mass and its motors.
        warm_up: seconds left out.
    """
    sample = Sample.of(log, warm_up)
    figures: dict[str, Any] = {
        "survival": float(1.0 - log.fallen[-1].mean()),
        "diverged": int(log.truth.diverged.any(axis=0).sum()),
        **base_figures(sample, robot),
        **feet_figures(sample, machines),
        "lateral_error_p95": lateral_error(log),
        "stalled": 0.0 if machines[sample.gait()].stands else stalled(log),
    }
    gait = sample.gait()
    scores = gait_scores(sample, machines.values())
    misses = [check.to_dict() for check in checks(figures, machines[gait]) if not check.passed]
    name = name_gait(scores)
    figures["verdict"] = {
        "gait": name,
        "clean": name == gait and not misses,
        "scores": scores,
        "misses": misses,
    }
    return figures
