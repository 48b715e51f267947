"""The state of simulated robots as the two records: what is true, and what perfect sensors show."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.description import Robot
from gaitshift.robot.state import Privileged, Proprioception, rotation_of
from gaitshift.sim.terrain import Fields

POSE = 7
"""Base position and quaternion at the head of MuJoCo's qpos."""
TWIST = 6
"""Linear and angular velocity at the head of MuJoCo's qvel."""


class Feet(NamedTuple):
    """The spheres of the feet of N robots."""

    lowest_w: Float[np.ndarray, "N 4 3"]
    """The lowest point of each, world frame [m]."""
    velocity_w: Float[np.ndarray, "N 4 3"]
    """Velocity of the middle of each [m/s]."""
    force: Float[np.ndarray, "N 4"]
    """Normal force on each [N]."""


def measured(
    robot: Robot,
    fields: Fields,
    *,
    qpos: Float[np.ndarray, "N 19"],
    qvel: Float[np.ndarray, "N 18"],
    torque: Float[np.ndarray, "N 12"],
    feet: Feet,
    body_contact: Bool[np.ndarray, " N"],
) -> tuple[Privileged, Proprioception]:
    """The truth, and proprioception without noise and delay, of arrays that do not change later.

    Args:
        robot: whose states these are.
        fields: the grounds under the robots.
        qpos: MuJoCo's positions: m, quaternion, rad.
        qvel: MuJoCo's velocities: m/s in the world, rad/s in the body, rad/s of the joints.
        torque: of the joints [N·m].
        feet: of the robots.
        body_contact: whose base touches the ground.
    """
    rotation = rotation_of(qpos[:, 3:POSE])
    truth = Privileged(
        base_position_w=qpos[:, :3],
        base_quaternion_w=qpos[:, 3:POSE],
        velocity_b=np.einsum("nij,ni->nj", rotation, qvel[:, :3]),
        foot_position_w=feet.lowest_w,
        foot_velocity_w=feet.velocity_w,
        foot_force=feet.force,
        clearance=feet.lowest_w[..., 2] - fields.height_at(feet.lowest_w[..., :2]),
        body_contact=body_contact,
        diverged=np.zeros(len(qpos), dtype=bool),
    )
    offset = truth.foot_position_w - truth.base_position_w[:, None]
    ideal = Proprioception(
        contact=truth.foot_contact,
        foot_position_b=offset @ rotation,  # rotated back, row by row
        orientation=truth.base_quaternion_w,
        joint_position=qpos[:, POSE:],
        joint_velocity=qvel[:, TWIST:],
        joint_torque=torque,
        velocity_b=truth.velocity_b,
        angular_velocity_b=qvel[:, 3:TWIST],
        mass=robot.mass,
    )
    vars(ideal)["rotation"] = rotation  # which it would compute again
    return truth, ideal
