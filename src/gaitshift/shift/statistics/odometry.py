"""Leg odometry: the motion of the base from the feet that stand."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import GRAVITY, Proprioception


@dataclass(frozen=True, kw_only=True, eq=False)
class OdometryState:
    """State of the odometry, in a frame with z up and the origin of yaw of the given headings."""

    base: Float[np.ndarray, "N 3"]
    """Position of the base origin relative to its start [m]."""
    velocity: Float[np.ndarray, "N 3"]
    """Its velocity [m/s]."""
    foot: Float[np.ndarray, "N 4 3"]
    """Feet relative to the base, a step ago [m]."""
    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""


@dataclass(frozen=True, kw_only=True)
class LegOdometry:
    """Base motion from feet that touch in two successive steps, which are assumed to stand still.

    Without such a foot the base keeps its velocity and falls freely. Errors grow with the distance,
    but are small over the few strides that conditions use.
    """

    smoothing: float = 0.03
    """Time constant of the smoothed velocity, which is used only in flight [s]."""

    def start(self, n: int) -> OdometryState:
        """State of n robots at the origin, in the air and at rest."""
        return OdometryState(
            base=np.zeros((n, 3)),
            velocity=np.zeros((n, 3)),
            foot=np.zeros((n, 4, 3)),
            contact=np.zeros((n, 4), dtype=bool),
        )

    def step(
        self, state: OdometryState, sensed: Proprioception
    ) -> tuple[OdometryState, Float[np.ndarray, "N 4 3"]]:
        """The base after this step, and the feet in the same frame [m]."""
        foot = upright(sensed)
        stands = sensed.contact & state.contact
        count = stands.sum(axis=1)[:, None]
        back = np.where(stands[..., None], state.foot - foot, 0.0).sum(axis=1)
        by_feet = back / np.maximum(count, 1)
        period = sensed.period
        fall = np.array([0.0, 0.0, GRAVITY * period])
        by_flight = (state.velocity - 0.5 * fall) * period
        move = np.where(count > 0, by_feet, by_flight)
        share = min(1.0, period / self.smoothing)
        by_feet_velocity = state.velocity + share * (by_feet / period - state.velocity)
        velocity = np.where(count > 0, by_feet_velocity, state.velocity - fall)
        base = state.base + move
        after = OdometryState(base=base, velocity=velocity, foot=foot, contact=sensed.contact)
        return after, base[:, None] + foot


def upright(sensed: Proprioception) -> Float[np.ndarray, "N 4 3"]:
    """Feet relative to the base with z along the vertical, and x, y turned by the yaw [m].

    Without a heading, x is along the body's heading.
    """
    up = -sensed.gravity_b
    ux, uy, uz = (up[:, None, axis] for axis in range(3))
    px, py, pz = (sensed.foot_position_b[..., axis] for axis in range(3))
    level = np.sqrt(np.maximum(1.0 - ux * ux, 1e-12))  # horizontal length of the body's x axis
    # Rows of the rotation: the heading, the horizontal to its left, and up.
    x = level * px - ux * (uy * py + uz * pz) / level
    y = (uz * py - uy * pz) / level
    z = ux * px + uy * py + uz * pz
    if not sensed.has_heading:
        return np.stack([x, y, z], axis=2)
    c, s = np.cos(sensed.yaw)[:, None], np.sin(sensed.yaw)[:, None]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=2)
