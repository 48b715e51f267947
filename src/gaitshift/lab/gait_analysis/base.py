"""Figures of the base and the joints: speed, heading, sway, effort."""

import numpy as np

from gaitshift.lab.gait_analysis.sample import Sample
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
    power = sensed.power[alive]
    turn = sensed.need("angular_velocity_b", "gait figures")[..., :2][alive]
    too_fast = np.abs(joint_speed).max(axis=-1) > robot.velocity_limit
    height = sensed.base_height[alive]
    values = (
        mean,
        abs(mean - float(command.mean())),
        float(np.sqrt(np.square(speed - command).mean())),
        _heading_drift(sample),
        float(sensed.yaw[alive].std()),
        float(power.mean(dtype=float)) / (robot.mass * GRAVITY * max(abs(mean), 1e-3)),
        mean**2 / (GRAVITY * max(float(np.median(height)), 1e-3)),
        float(turn[:, 0].std(dtype=float)),
        float(turn[:, 1].std(dtype=float)),
        float(too_fast.mean()),
    )
    return dict(zip(_NAMES, values, strict=True))


_NAMES = (
    "speed_mean",
    "speed_error",
    "speed_rmse",
    "heading_drift",
    "heading_error_sd",
    "cost_of_transport",
    "froude",
    "roll_rate_sd",
    "pitch_rate_sd",
    "overspeed",
)


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
