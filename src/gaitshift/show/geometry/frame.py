"""What is to be seen of N robots at one instant."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.lab.log import Log
from gaitshift.robot.motion import rotation_of

_PLANE = 0.55, 0.4
"""Half of the length and width of the plane through the touches [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """N robots at one instant."""

    time: float
    """Since the start [s]."""
    qpos: Float[np.ndarray, "N 19"]
    """MuJoCo's positions."""
    contact: Bool[np.ndarray, "N 4"]
    """Whether each foot touches."""
    touch_w: Float[np.ndarray, "N 4 3"]
    """Where each foot touched last, world frame [m]; NaN before."""
    foot_position_w: Float[np.ndarray, "N 4 3"]
    """Lowest point of each foot [m]."""
    foot_height: Float[np.ndarray, "N 4"]
    """The condition's h_i [m]."""
    k: Float[np.ndarray, " N"]
    """The counter of the edge that is nearest to firing."""
    threshold: Float[np.ndarray, " N"]
    """The β that it is held against; 0 where nothing counts."""
    gait: Int[np.ndarray, " N"]
    """Index of the gait."""
    machine_state: Int[np.ndarray, " N"]
    """State of its machine."""
    speed: Float[np.ndarray, " N"]
    """Velocity along the base's x axis [m/s]."""
    fallen: Bool[np.ndarray, " N"]
    """Whether the robot has fallen."""


def last_touches(
    before: Float[np.ndarray, "N 4 3"],
    contact: Bool[np.ndarray, "N 4"],
    foot_position_w: Float[np.ndarray, "N 4 3"],
) -> Float[np.ndarray, "N 4 3"]:
    """Where each foot touched last, after a step with these contacts."""
    return np.where(contact[..., None], foot_position_w, before)


def frames_of(log: Log, every: int) -> list[Frame]:
    """The entries of a log, one of `every`."""
    n = log.k.shape[1]
    quaternion = log.qpos[..., 3:7].astype(float)
    rotation = rotation_of(quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True))
    speed = np.einsum("tni,tni->tn", rotation[..., 0], log.qvel[..., :3].astype(float))
    touch, frames = np.full((n, 4, 3), np.nan), list[Frame]()
    for t in range(len(log.time)):
        feet = log.foot_position_w[t].astype(float)
        touch = last_touches(touch, log.contact[t], feet)
        if t % every:
            continue
        frames.append(
            Frame(
                time=float(log.time[t]),
                qpos=log.qpos[t].astype(float),
                contact=log.contact[t],
                touch_w=touch,
                foot_position_w=feet,
                foot_height=log.foot_height[t].astype(float),
                k=log.k[t],
                threshold=log.threshold[t],
                gait=log.gait[t].astype(int),
                machine_state=log.machine_state[t].astype(int),
                speed=speed[t],
                fallen=log.fallen[t],
            )
        )
    return frames


def plane_corners(points: Float[np.ndarray, "4 3"]) -> Float[np.ndarray, "4 3"]:
    """Corners of a piece of the plane of least squares through points, about their middle [m]."""
    middle = points.mean(axis=0)
    offset = points - middle
    slope = cast(Any, np.linalg).lstsq(offset[:, :2], offset[:, 2], rcond=1e-3)[0]
    length, width = _PLANE
    corners = np.array([[-length, -width], [length, -width], [length, width], [-length, width]])
    return np.column_stack([corners, corners @ slope]) + middle
