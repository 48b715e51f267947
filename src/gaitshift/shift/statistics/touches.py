"""The last touches of the feet, tracked by leg odometry, from which the terrain is estimated."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
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


@dataclass(frozen=True, kw_only=True, eq=False)
class TouchState:
    """State of `Touches`."""

    odometry: OdometryState
    """State of the odometry."""
    touch: Float[np.ndarray, "N 4 K 3"]
    """Last touches of each foot, the latest first, in the odometry's frame [m]; NaN before."""
    time_up: Float[np.ndarray, "N 4"]
    """Time since each foot last touched [s]."""

    @property
    def points(self) -> Float[np.ndarray, "N P 3"]:
        """Touches of all feet along one axis."""
        n, feet, kept, _ = self.touch.shape
        return self.touch.reshape(n, feet * kept, 3)


@dataclass(frozen=True, kw_only=True)
class Touches:
    """Records the last touches of each foot."""

    kept: int
    """Number of touches of each foot in memory."""
    least_swing: float
    """A foot that touches again sooner has bounced: it is the same touch [s]."""

    def __post_init__(self) -> None:
        if not 1 <= self.kept <= 100:
            raise GaitshiftError(f"touches must be 1 to 100 for each foot, got {self.kept}")
        if not 0.0 <= self.least_swing < np.inf:
            raise GaitshiftError(
                f"least_swing must be finite and 0 s or more, got {self.least_swing:g}"
            )

    def start(self, n: int) -> TouchState:
        """State of n robots before any touch."""
        return TouchState(
            odometry=LegOdometry().start(n),
            touch=np.full((n, 4, self.kept, 3), np.nan),
            time_up=np.full((n, 4), np.inf),
        )

    def step(
        self, state: TouchState, sensed: Proprioception
    ) -> tuple[TouchState, Bool[np.ndarray, "N 4"], Float[np.ndarray, "N 4 3"]]:
        """The touches after this step, which feet came down in it, and positions of all feet [m].

        The last touch of a foot follows the foot while it stands.
        """
        odometry, foot = LegOdometry().step(state.odometry, sensed)
        contact = sensed.contact
        new = contact & (state.time_up >= self.least_swing)
        touch = state.touch.copy()
        if new.any():
            touch[:, :, 1:] = np.where(new[..., None, None], touch[:, :, :-1], touch[:, :, 1:])
        touch[:, :, 0] = np.where(contact[..., None], foot, touch[:, :, 0])
        time_up = np.where(contact, 0.0, state.time_up + sensed.period)
        return TouchState(odometry=odometry, touch=touch, time_up=time_up), new, foot


@dataclass(frozen=True, kw_only=True, eq=False)
class Plane:
    """z = height + slope · (x, y) about a middle point, for each of N robots."""

    middle: Float[np.ndarray, "N 3"]
    """Mean of the fitted points [m]."""
    slope: Float[np.ndarray, "N 2"]
    """dz/dx and dz/dy."""

    def above(self, points: Float[np.ndarray, "N P 3"]) -> Float[np.ndarray, "N P"]:
        """Height of each point above the plane, along the vertical [m]."""
        x, y, z = (points[..., axis] - self.middle[:, axis, None] for axis in range(3))
        return z - self.slope[:, :1] * x - self.slope[:, 1:] * y


def fit_plane(
    points: Float[np.ndarray, "N P 3"], known: Bool[np.ndarray, "N P"], ridge: float
) -> Plane:
    """Least-squares plane of each robot's known points.

    Args:
        points: x, y, z [m].
        known: which points are used.
        ridge: keeps slopes small [m²] in directions in which the points are close together.
    """
    count = np.maximum(known.sum(axis=1), 1)
    used = np.where(known[..., None], points, 0.0)
    middle = used.sum(axis=1) / count[:, None]
    x, y, z = (np.where(known, used[..., i] - middle[:, i, None], 0.0) for i in range(3))
    xx, xy, yy = (x * x).sum(axis=1), (x * y).sum(axis=1), (y * y).sum(axis=1)
    xz, yz = (x * z).sum(axis=1), (y * z).sum(axis=1)
    determinant = (xx + ridge) * (yy + ridge) - xy * xy
    slope_x = (xz * (yy + ridge) - yz * xy) / determinant
    slope_y = (yz * (xx + ridge) - xz * xy) / determinant
    return Plane(middle=middle, slope=np.stack([slope_x, slope_y], axis=1))
