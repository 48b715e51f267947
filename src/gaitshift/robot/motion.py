"""What is measured of N robots at one instant, with frames and units in the names.

Frames: `_w` world (z up), `_b` body (base origin, x forward, y left, z up). Axis 0 is the robot,
axis 1 the leg (`gaitshift.robot.legs.LEGS`) or the joint (legs × HAA, HFE, KFE).
"""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

GRAVITY = 9.81
"""[m/s²]"""


@dataclass(frozen=True, kw_only=True)
class Motion:
    """The motion of N robots at one instant. Its arrays are its own and never change."""

    joint_position: Float[np.ndarray, "N 12"]
    """[rad]"""
    joint_velocity: Float[np.ndarray, "N 12"]
    """[rad/s]"""
    joint_torque: Float[np.ndarray, "N 12"]
    """Torque applied over the last physics step [N·m]."""
    base_position_w: Float[np.ndarray, "N 3"]
    """Base origin [m]."""
    base_quaternion_w: Float[np.ndarray, "N 4"]
    """Rotation from body to world, unit quaternion (w, x, y, z)."""
    base_linear_velocity_w: Float[np.ndarray, "N 3"]
    """Velocity of the base origin [m/s]."""
    base_angular_velocity_b: Float[np.ndarray, "N 3"]
    """[rad/s]"""
    foot_position_w: Float[np.ndarray, "N 4 3"]
    """The lowest point of each foot, where it would touch level ground [m]."""
    foot_velocity_w: Float[np.ndarray, "N 4 3"]
    """Velocity of each foot's centre [m/s]."""
    foot_force: Float[np.ndarray, "N 4"]
    """Normal force on each foot, summed over its contacts, in the last physics step [N]."""
    contact: Bool[np.ndarray, "N 4"]
    """Whether a foot's summed normal force exceeds the world's threshold."""
    clearance: Float[np.ndarray, "N 4"]
    """Height of each foot's lowest point above the ground under it [m]."""
    body_contact: Bool[np.ndarray, " N"]
    """Whether the base touches the ground: the paper's end of an episode."""

    def of(self, ids: Int[np.ndarray, " K"]) -> "Motion":
        """The motion of some of the robots, in the order of `ids`."""
        return Motion(**{f.name: getattr(self, f.name)[ids] for f in fields(self)})

    @cached_property
    def rotation_wb(self) -> Float[np.ndarray, "N 3 3"]:
        """Rotation matrices from body to world."""
        return rotation_of(self.base_quaternion_w)

    @cached_property
    def base_linear_velocity_b(self) -> Float[np.ndarray, "N 3"]:
        """Velocity of the base origin, in the body frame [m/s]."""
        return np.einsum("nij,ni->nj", self.rotation_wb, self.base_linear_velocity_w)

    @cached_property
    def gravity_b(self) -> Float[np.ndarray, "N 3"]:
        """Unit vector of the direction of gravity, in the body frame: (0, 0, -1) when level."""
        return -self.rotation_wb[:, 2]

    @cached_property
    def yaw(self) -> Float[np.ndarray, " N"]:
        """Heading of the body's x axis about world z, in (-π, π] [rad]."""
        return np.arctan2(self.rotation_wb[:, 1, 0], self.rotation_wb[:, 0, 0])

    @cached_property
    def foot_position_b(self) -> Float[np.ndarray, "N 4 3"]:
        """The lowest point of each foot from the base origin, in the body frame [m]."""
        offset = self.foot_position_w - self.base_position_w[:, None]
        return np.einsum("nij,nli->nlj", self.rotation_wb, offset)

    @cached_property
    def foot_height(self) -> Float[np.ndarray, "N 4"]:
        """Height of each foot's lowest point above the base origin, along the vertical [m].

        Negative while it is below. Joints and attitude are enough for a robot to compute it.
        """
        return self.foot_position_w[..., 2] - self.base_position_w[:, 2:]

    @cached_property
    def base_height(self) -> Float[np.ndarray, " N"]:
        """Height z of the base origin above the lowest foot [m].

        On level ground with a foot down it is the paper's body height. It asks nothing of the
        ground, so a robot can compute it from its joints and its attitude alone.
        """
        return self.base_position_w[:, 2] - self.foot_position_w[:, :, 2].min(axis=1)


def rotation_of(quaternion: Float[np.ndarray, "*batch 4"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrices of unit quaternions (w, x, y, z)."""
    w, x, y, z = (quaternion[..., i] for i in range(4))
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    rows = (
        (1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)),
        (2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)),
        (2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)),
    )
    rotation = np.empty((*w.shape, 3, 3))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            rotation[..., i, j] = entry
    return rotation


def turned(
    quaternion: Float[np.ndarray, "*batch 4"], yaw: Float[np.ndarray, "*batch"]
) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions (w, x, y, z) turned by `yaw` about world z [rad]."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    c, s = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.stack((c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w), axis=-1)
