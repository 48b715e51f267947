"""The last touches of the feet, tracked by leg odometry, from which the terrain is estimated."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import GRAVITY, Proprioception
from gaitshift.shift.statistics.contacts import ContactFilter, ContactState

AGREEMENT = 1.0
"""Velocities that differ by less agree [m/s]; ours: a swinging foot moves at twice the speed of the
base."""


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
    stands: Bool[np.ndarray, "N 4"]
    """Feet by which the base moved."""
    flight: Float[np.ndarray, " N"]
    """Time since a foot last stood [s]."""


@dataclass(frozen=True, kw_only=True)
class LegOdometry:
    """Feet that touch in two steps running stand still: the base moves as they seem to move back.

    With no such foot the base flies on as it did, and falls. Errors add up with the distance: it is
    good for the few strides that conditions look back on. A foot that is felt in its swing would
    carry the base along. With a finite `agreement` a foot stands only where the base velocity that
    it shows is near the last one, or near that which another foot shows.
    """

    smoothing: float = 0.03
    """The velocity forgets by e in this time [s]."""
    agreement: float = np.inf
    """Greatest difference of velocities that agree [m/s]; infinity: every foot that is felt
    stands."""
    longest_flight: float = 0.3
    """With a finite agreement: after this time any foot that is felt stands [s]; ours: twice the
    longest flight of a shipped gait."""

    def start(self, n: int) -> OdometryState:
        """State of n robots at the origin, in the air and at rest."""
        return OdometryState(
            base=np.zeros((n, 3)),
            velocity=np.zeros((n, 3)),
            foot=np.zeros((n, 4, 3)),
            contact=np.zeros((n, 4), dtype=bool),
            stands=np.zeros((n, 4), dtype=bool),
            flight=np.full(n, np.inf),
        )

    def step(
        self, state: OdometryState, sensed: Proprioception
    ) -> tuple[OdometryState, Float[np.ndarray, "N 4 3"]]:
        """The base after this step, and where each foot is in the same frame [m]."""
        foot = sensed.foot_position_upright
        stands = self._standing(state, sensed, foot)
        count = stands.sum(axis=1)[:, None]
        back = np.where(stands[..., None], state.foot - foot, 0.0).sum(axis=1)
        by_feet = back / np.maximum(count, 1)
        period = sensed.period
        fall = np.array([0.0, 0.0, GRAVITY * period])
        by_flight = (state.velocity - 0.5 * fall) * period
        move = np.where(count > 0, by_feet, by_flight)
        lost = self._lost(state)[:, None]
        share = np.where(lost, 1.0, min(1.0, period / self.smoothing))
        by_feet_velocity = state.velocity + share * (by_feet / period - state.velocity)
        velocity = np.where(count > 0, by_feet_velocity, state.velocity - fall)
        base = state.base + move
        after = OdometryState(
            base=base,
            velocity=velocity,
            foot=foot,
            contact=sensed.contact,
            stands=stands,
            flight=np.where(count[:, 0] > 0, 0.0, state.flight + period),
        )
        return after, base[:, None] + foot

    def _standing(
        self, state: OdometryState, sensed: Proprioception, foot: Float[np.ndarray, "N 4 3"]
    ) -> Bool[np.ndarray, "N 4"]:
        """Feet that touch in two steps and show a base velocity that something else shows too."""
        touch = sensed.contact & state.contact
        if self.agreement == np.inf:
            return touch
        shown = (state.foot - foot) / sensed.period
        far = _square(shown - state.velocity[:, None]) > self.agreement**2
        if not (touch & far).any():
            return touch
        apart = _square(shown[:, :, None] - shown[:, None])
        agree = (apart < self.agreement**2) & touch[:, :, None] & touch[:, None]
        has_fellow = agree.sum(axis=-1) > 1
        return touch & (~far | has_fellow | self._lost(state)[:, None])

    def _lost(self, state: OdometryState) -> Bool[np.ndarray, " N"]:
        """Robots of which no foot has agreed for so long that the velocity must be wrong."""
        if self.agreement == np.inf:
            return np.zeros(len(state.flight), dtype=bool)
        return state.flight > self.longest_flight


def _square(vector: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
    # Written out, so that one robot gives the same bits alone and in a batch.
    x, y, z = (vector[..., axis] for axis in range(3))
    return x * x + y * y + z * z


@dataclass(frozen=True, kw_only=True, eq=False)
class TouchState:
    """State of `Touches`."""

    odometry: OdometryState
    """State of the odometry."""
    touch: Float[np.ndarray, "N 4 K 3"]
    """Last touches of each foot, the latest first, in the odometry's frame [m]; NaN before."""
    feet: ContactState
    """Which feet stand."""

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
    least_stance: float = 0.0
    """A foot that stands for less time has not touched [s]. Above 0 odometry decides which feet
    stand (`AGREEMENT`); at 0 every foot that is felt does, at once."""

    def __post_init__(self) -> None:
        if not 1 <= self.kept <= 100:
            raise GaitshiftError(f"touches must be 1 to 100 for each foot, got {self.kept}")
        _ = self._filter

    @cached_property
    def _filter(self) -> ContactFilter:
        return ContactFilter(least_stance=self.least_stance, least_swing=self.least_swing)

    @cached_property
    def _odometry(self) -> LegOdometry:
        return LegOdometry(agreement=AGREEMENT if self.least_stance > 0 else np.inf)

    def start(self, n: int) -> TouchState:
        """State of n robots before any touch."""
        return TouchState(
            odometry=self._odometry.start(n),
            touch=np.full((n, 4, self.kept, 3), np.nan),
            feet=self._filter.start(n),
        )

    def step(
        self, state: TouchState, sensed: Proprioception
    ) -> tuple[TouchState, Bool[np.ndarray, "N 4"], Float[np.ndarray, "N 4 3"]]:
        """The touches after this step, which feet came down in it, and positions of all feet [m].

        The last touch of a foot follows the foot while it stands.
        """
        odometry, foot = self._odometry.step(state.odometry, sensed)
        standing = odometry.stands if self.least_stance > 0 else sensed.contact
        feet = self._filter.step(state.feet, standing, sensed.period)
        new = feet.down & ~state.feet.down
        touch = state.touch.copy()
        if new.any():
            touch[:, :, 1:] = np.where(new[..., None, None], touch[:, :, :-1], touch[:, :, 1:])
        stands = feet.down & sensed.contact
        touch[:, :, 0] = np.where(stands[..., None], foot, touch[:, :, 0])
        return TouchState(odometry=odometry, touch=touch, feet=feet), new, foot


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
