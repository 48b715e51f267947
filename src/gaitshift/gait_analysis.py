"""What a log says about a gait: the figures by which policies are judged."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.log import Log
from gaitshift.reward_machine import RewardMachine
from gaitshift.robot import ROBOTS

GRAVITY = 9.81
"""[m/s²]"""

WARM_UP = 2.0
"""Seconds from the start that are left out of every figure but survival."""


def measure(
    log: Log, machines: Mapping[str, RewardMachine], *, mass: float, warm_up: float = WARM_UP
) -> dict[str, float | list[float]]:
    """Figures of a log, over all robots that are on their feet, after the warm-up.

    - `survival`: share of robots that never fell.
    - `speed_mean` [m/s]: mean velocity along body x; `speed_rmse` [m/s]: against the command.
    - `pattern_fraction`: share of steps whose contacts are a stance set of the gait's machine.
    - `cycles_per_s` [1/s]: full cycles of the machine, counted by entries into its first state.
    - `touchdowns_per_cycle` (4,): raw contact onsets of each foot over full cycles.
    - `duty_factor` (4,): share of steps each foot is down.
    - `slip` [m/s]: mean horizontal speed of the feet in contact.
    - `overspeed`: share of steps in which a joint is faster than the robot's limit.
    - `cost_of_transport`: mean mechanical power Σ|τ q̇| over m·g·v.
    - `heading_error_sd` [rad]: spread of the heading about the line x.
    - `lateral_error_p95` [m]: 95th percentile of the distance from the line, at the end.

    Args:
        log: the run.
        machines: the machines of the gaits in it, by name.
        mass: of the robot [kg].
        warm_up: seconds left out.
    """
    late = log.time > warm_up
    alive = ~log.fallen[late]
    steps = max(1, int(alive.sum()))
    speed = _forward_speed(log)[late]
    command = log.command[late, :, 0]
    contact, seconds = log.contact[late], steps * _period(log)
    cycles = _cycles(log, machines)[late]
    count = max(1, int((cycles & alive).sum()))
    onsets = _onsets(log)[late] & alive[..., None]
    joint_speed = log.qvel[late][..., 6:]
    power = np.abs(log.torque[late] * joint_speed).sum(axis=-1)
    mean_speed = float(speed[alive].mean()) if alive.any() else 0.0
    feet = contact & alive[..., None]
    return {
        "survival": float(1.0 - log.fallen[-1].mean()),
        "speed_mean": mean_speed,
        "speed_rmse": float(np.sqrt(np.square(speed - command)[alive].mean()))
        if alive.any()
        else 0.0,
        "pattern_fraction": float((log.stance_shown[late] & alive).sum() / steps),
        "cycles_per_s": float((cycles & alive).sum() / seconds),
        "touchdowns_per_cycle": [float(x) for x in onsets.sum(axis=(0, 1)) / count],
        "duty_factor": [float(x) for x in feet.sum(axis=(0, 1)) / steps],
        "slip": _slip(log, late, feet),
        "overspeed": float((_too_fast(log)[late] & alive).sum() / steps),
        "cost_of_transport": float(
            power[alive].mean() / (mass * GRAVITY * max(abs(mean_speed), 1e-3))
        )
        if alive.any()
        else 0.0,
        "heading_error_sd": float(_yaw(log)[late][alive].std()) if alive.any() else 0.0,
        "lateral_error_p95": _lateral_error(log),
    }


def robot_mass(name: str) -> float:
    """Mass of a robot by its name [kg]."""
    robot = ROBOTS[name]
    model = robot.spec(robot.gains_of("default")).compile()
    return float(model.body_mass.sum())


def _period(log: Log) -> float:
    return float(log.time[1] - log.time[0]) if len(log.time) > 1 else 0.01


def _forward_speed(log: Log) -> Float[np.ndarray, "T N"]:
    """Base velocity along body x [m/s]."""
    w, x, y, z = np.moveaxis(log.qpos[..., 3:7], -1, 0)
    axis = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=-1)
    return np.einsum("tni,tni->tn", axis, log.qvel[..., :3])


def _yaw(log: Log) -> Float[np.ndarray, "T N"]:
    w, x, y, z = np.moveaxis(log.qpos[..., 3:7], -1, 0)
    return np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))


def _onsets(log: Log) -> Bool[np.ndarray, "T N 4"]:
    """Where a foot is down that was up in the step before."""
    onset = np.zeros_like(log.contact)
    onset[1:] = log.contact[1:] & ~log.contact[:-1]
    return onset


def _cycles(log: Log, machines: Mapping[str, RewardMachine]) -> Bool[np.ndarray, "T N"]:
    """Where a machine comes back into its first state."""
    first = np.array([machines[gait].initial for gait in log.gaits])
    in_first = log.machine_state == first[log.gait]
    entry = np.zeros_like(in_first)
    same_gait = log.gait[1:] == log.gait[:-1]
    entry[1:] = in_first[1:] & ~in_first[:-1] & same_gait
    return entry


def _too_fast(log: Log) -> Bool[np.ndarray, "T N"]:
    """Where the fastest joint exceeds the robot's velocity limit."""
    return np.abs(log.qvel[..., 6:]).max(axis=-1) > ROBOTS[log.robot].velocity_limit


def _slip(log: Log, late: Bool[np.ndarray, " T"], feet: Bool[np.ndarray, "L N 4"]) -> float:
    """Mean horizontal speed of feet that are down in two steps running [m/s]."""
    position = log.foot_position_w[late][..., :2]
    speed = np.linalg.norm(np.diff(position, axis=0), axis=-1) / _period(log)
    both = feet[1:] & feet[:-1]
    return float(speed[both].mean()) if both.any() else 0.0


def _lateral_error(log: Log) -> float:
    """95th percentile over the robots on their feet of how far they end from where y began [m]."""
    upright = ~log.fallen[-1]
    if not upright.any():
        return float("nan")
    return float(np.quantile(np.abs(log.qpos[-1, upright, 1] - log.qpos[0, upright, 1]), 0.95))
