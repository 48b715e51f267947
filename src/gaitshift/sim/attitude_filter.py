"""A complementary filter of gyro and accelerometer: the attitude that an inertial unit gives."""

import numpy as np
from jaxtyping import Float

from gaitshift.robot.state import GRAVITY, rotation_of


def filtered(
    orientation: Float[np.ndarray, "N 4"],
    rate_b: Float[np.ndarray, "N 3"],
    specific_force_b: Float[np.ndarray, "N 3"],
    *,
    time_constant: float,
    period: float,
) -> Float[np.ndarray, "N 4"]:
    """The orientation after a step: the gyro turns it, and the accelerometer levels it.

    With the specific force f and the estimated vertical u, it is turned by (f × u) / (g τ): the
    passive filter of Mahony et al. 2008. f is not normalised (ours): errors of tilt then decay as
    exp(-t/τ) at rest, accelerations whose mean over a stride is zero leave no error, and in flight
    the gyro alone counts. Nothing corrects the yaw.

    Args:
        orientation: before the step, unit quaternions (w, x, y, z).
        rate_b: angular velocity, the mean over the step [rad/s].
        specific_force_b: the mean over the step, in the body frame at its end [m/s²].
        time_constant: τ [s]; infinity leaves the accelerometer out.
        period: of the step [s].
    """
    turned = product(orientation, quaternion_of(rate_b * period))
    up_b = rotation_of(turned)[:, 2]
    levelling = np.cross(specific_force_b, up_b) / (GRAVITY * time_constant)
    levelled = product(turned, quaternion_of(levelling * period))
    return levelled / np.linalg.norm(levelled, axis=-1, keepdims=True)


def product(
    first: Float[np.ndarray, "*batch 4"], second: Float[np.ndarray, "*batch 4"]
) -> Float[np.ndarray, "*batch 4"]:
    """Quaternions (w, x, y, z) of the rotations `second`, then `first`."""
    w, x, y, z = (first[..., i] for i in range(4))
    a, b, c, d = (second[..., i] for i in range(4))
    parts = (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )
    return np.stack(parts, axis=-1)


def quaternion_of(turn: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions (w, x, y, z) of rotation vectors [rad]."""
    angle = np.linalg.norm(turn, axis=-1, keepdims=True)
    per_angle = 0.5 * np.sinc(angle / (2 * np.pi))  # sin(angle / 2) / angle
    return np.concatenate([np.cos(angle / 2), per_angle * turn], axis=-1)


def turn_between(
    before: Float[np.ndarray, "*batch 4"], after: Float[np.ndarray, "*batch 4"]
) -> Float[np.ndarray, "*batch 3"]:
    """The rotation vector [rad], at most half a turn long, that turns `before` into `after`.

    Orientations are unit quaternions (w, x, y, z); the vector is in the frame that turns.
    """
    turn = product(before * np.array([1.0, -1.0, -1.0, -1.0]), after)
    turn = np.where(turn[..., :1] < 0.0, -turn, turn)
    sine = np.linalg.norm(turn[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, turn[..., :1])
    return turn[..., 1:] * np.where(sine > 0.0, angle / np.where(sine > 0.0, sine, 1.0), 2.0)
