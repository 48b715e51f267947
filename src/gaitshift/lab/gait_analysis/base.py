"""Figures of the base and the joints: speed, heading, sway, effort."""

import numpy as np
from jaxtyping import Float

from gaitshift.lab.gait_analysis.sample import Sample
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot
from gaitshift.robot.motion import GRAVITY

_SHORTEST_DRIFT = 0.5
"""Robots that fall sooner after the warm-up have no drift [s]."""

Figure = float | None
"""None: there was nothing to measure."""


def base_figures(sample: Sample, robot: Robot) -> dict[str, Figure]:
    """What `measure` says of base and joints, for robots of this kind."""
    log, alive = sample.log, sample.alive
    if sample.steps == 0:
        return dict.fromkeys(_NAMES)
    speed, command = forward_speed(log)[alive], log.command[..., 0][alive]
    mean = float(speed.mean(dtype=float))
    joint_speed = log.qvel[..., 6:][alive]
    power = np.abs(log.torque[alive] * joint_speed).sum(axis=-1)
    turn = log.qvel[..., 3:5][alive]
    too_fast = np.abs(joint_speed).max(axis=-1) > robot.velocity_limit
    height = (log.qpos[..., 2] - log.foot_position_w[..., 2].min(axis=-1))[alive]
    values = (
        mean,
        abs(mean - float(command.mean())),
        float(np.sqrt(np.square(speed - command).mean())),
        _heading_drift(sample),
        float(yaw(log)[alive].std()),
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
    """95th percentile over robots on their feet of how far they end from where y began [m]."""
    upright = ~log.fallen[-1]
    if not upright.any():
        return None
    return float(np.quantile(np.abs(log.qpos[-1, upright, 1] - log.qpos[0, upright, 1]), 0.95))


def forward_speed(log: Log) -> Float[np.ndarray, "T N"]:
    """Base velocity along body x [m/s]."""
    w, x, y, z = np.moveaxis(log.qpos[..., 3:7], -1, 0)
    axis = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=-1)
    return np.einsum("tni,tni->tn", axis, log.qvel[..., :3])


def yaw(log: Log) -> Float[np.ndarray, "T N"]:
    """Heading of the body's x axis about world z, in (-π, π] [rad]."""
    w, x, y, z = np.moveaxis(log.qpos[..., 3:7], -1, 0)
    return np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))


def _heading_drift(sample: Sample) -> Figure:
    """Root mean square over the robots of the rate at which they turn beyond their command [rad/s].

    A robot that needs a steady command to go straight drifts by that, though it keeps its line.
    """
    last = sample.alive.sum(axis=0) - 1
    long_enough = np.flatnonzero(last * sample.period >= _SHORTEST_DRIFT)
    if long_enough.size == 0:
        return None
    end = last[long_enough]
    heading = np.unwrap(yaw(sample.log)[:, long_enough].astype(float), axis=0)
    turned = heading[end, np.arange(len(end))] - heading[0]
    commanded = sample.log.command[:, long_enough, 1].cumsum(axis=0) * sample.period
    asked = commanded[end, np.arange(len(end))] - commanded[0]
    return float(np.sqrt(np.square((turned - asked) / (end * sample.period)).mean()))
