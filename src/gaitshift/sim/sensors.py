"""Perfect sensors: proprioception from the simulator's state."""

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import Privileged, Proprioception

POSE = 7
"""Base position and quaternion at the head of MuJoCo's qpos."""
TWIST = 6
"""Linear and angular velocity at the head of MuJoCo's qvel."""


def sense(
    truth: Privileged,
    rotation: Float[np.ndarray, "N 3 3"],
    qpos: Float[np.ndarray, "N 19"],
    qvel: Float[np.ndarray, "N 18"],
    torque: Float[np.ndarray, "N 12"],
    *,
    contact: Bool[np.ndarray, "N 4"],
    mass: float,
) -> Proprioception:
    """Proprioception without noise and without delay, of arrays that do not change later.

    Args:
        truth: the privileged state at the same instant.
        rotation: of the bases, from body to world.
        qpos: MuJoCo's positions: m, quaternion, rad.
        qvel: MuJoCo's velocities: m/s in the world, rad/s in the body, rad/s of the joints.
        torque: of the joints [N·m].
        contact: which feet bear on the ground.
        mass: of the robot [kg].
    """
    offset = truth.foot_position_w - truth.base_position_w[:, None]
    sensed = Proprioception(
        contact=contact,
        foot_position_b=offset @ rotation,  # rotated back, row by row
        orientation=truth.base_quaternion_w,
        joint_position=qpos[:, POSE:],
        joint_velocity=qvel[:, TWIST:],
        joint_torque=torque,
        velocity_b=truth.velocity_b,
        angular_velocity_b=qvel[:, 3:TWIST],
        mass=mass,
    )
    vars(sensed)["rotation"] = rotation  # which it would compute again
    return sensed
