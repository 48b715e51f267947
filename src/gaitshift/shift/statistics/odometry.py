"""Leg odometry: where the base has moved to, by the feet that stand."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import GRAVITY, Proprioception


@dataclass(frozen=True, kw_only=True, eq=False)
class OdometryState:
    """What odometry remembers. Its frame has z up; x and y as the robot's heading was given."""

    base: Float[np.ndarray, "N 3"]
    """Where the base origin is, from where it was at first [m]."""
    velocity: Float[np.ndarray, "N 3"]
    """Its velocity [m/s]."""
    foot: Float[np.ndarray, "N 4 3"]
    """Feet from the base, a step ago [m]."""
    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""


@dataclass(frozen=True, kw_only=True)
class LegOdometry:
    """Feet that touch in two steps running stand still: the base moves as they seem to move back.

    With no such foot the base flies on as it did, and falls. Errors add up with the distance: it is
    good for the few strides that conditions look back on.
    """

    smoothing: float = 0.03
    """The velocity, which only flights use, forgets by e in this time [s]."""

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
        """The base after this step, and where each foot is in the same frame [m]."""
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
    """Feet from the base with z along the vertical, and x, y turned by the yaw [m].

    Where there is no heading, x is the body's heading.
    """
    up = -sensed.gravity_b
    ux, uy, uz = (up[:, None, axis] for axis in range(3))
    px, py, pz = (sensed.foot_position_b[..., axis] for axis in range(3))
    level = np.sqrt(np.maximum(1.0 - ux * ux, 1e-12))  # of the body's x axis in the horizontal
    # Rows of the rotation: the heading, the horizontal to its left, and up.
    x = level * px - ux * (uy * py + uz * pz) / level
    y = (uz * py - uy * pz) / level
    z = ux * px + uy * py + uz * pz
    if not sensed.has_heading:
        return np.stack([x, y, z], axis=2)
    c, s = np.cos(sensed.yaw)[:, None], np.sin(sensed.yaw)[:, None]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=2)
