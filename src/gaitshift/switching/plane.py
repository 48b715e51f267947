"""How far the last touches of the feet lie from one plane: slopes are not roughness."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.switching.odometry import LegOdometry, OdometryState
from gaitshift.switching.signals import Signals

LEAST = 4
"""Touches below which there is nothing to tell: a plane goes through any three."""


@dataclass(frozen=True, kw_only=True, eq=False)
class PlaneState:
    """What `PlaneResidual` remembers."""

    odometry: OdometryState
    """Where the base is."""
    touch: Float[np.ndarray, "N 4 K 3"]
    """Where each foot touched, the last first, in the odometry's frame [m]; NaN before that."""
    time_up: Float[np.ndarray, "N 4"]
    """For how long each foot has not touched [s]."""


@dataclass(frozen=True, kw_only=True)
class PlaneResidual:
    """Standard deviation of the last touches about the plane through them, along the vertical [m].

    √(Σr² / (m − 3)) for the m touches kept, the degrees of freedom that a plane leaves. Leg
    odometry carries the touches along. With one touch a foot this is the paper's h less a plane.
    """

    touches: int = 2
    """Touches kept of each foot."""
    least_swing: float = 0.05
    """A foot that comes down again sooner has bounced: it is the same touch [s]."""

    unit = "m"
    width = 1
    needs = ()

    def __post_init__(self) -> None:
        if not 1 <= self.touches <= 100:
            raise GaitshiftError(f"touches = {self.touches}: 1 to 100 a foot would be right")

    def start(self, n: int) -> PlaneState:
        """State of n robots of which no foot has touched."""
        return PlaneState(
            odometry=LegOdometry().start(n),
            touch=np.full((n, 4, self.touches, 3), np.nan),
            time_up=np.full((n, 4), np.inf),
        )

    def step(
        self, state: PlaneState, signals: Signals
    ) -> tuple[PlaneState, Float[np.ndarray, "N 1"]]:
        """Touches after this step, and how far from a plane they lie."""
        odometry, foot = LegOdometry().step(state.odometry, signals)
        contact = signals.contact
        new = contact & (state.time_up >= self.least_swing)
        touch = np.where(new[..., None, None], np.roll(state.touch, 1, axis=2), state.touch)
        touch[:, :, 0] = np.where(contact[..., None], foot, touch[:, :, 0])
        time_up = np.where(contact, 0.0, state.time_up + signals.period)
        after = PlaneState(odometry=odometry, touch=touch, time_up=time_up)
        points = touch.reshape(len(touch), -1, 3)
        return after, deviation(points, ~np.isnan(points[..., 0]))[:, None]


def deviation(
    points: Float[np.ndarray, "N P 3"], known: Bool[np.ndarray, "N P"]
) -> Float[np.ndarray, " N"]:
    """√(Σr² / (m − 3)) of the m known points about their least-squares plane z(x, y) [m].

    NaN below four points; points that lie in one line are held against the line.
    """
    count = known.sum(axis=1)
    x, y, z = (_centred(points[..., axis], known, count) for axis in range(3))
    xx, xy, yy = (x * x).sum(axis=1), (x * y).sum(axis=1), (y * y).sum(axis=1)
    xz, yz = (x * z).sum(axis=1), (y * z).sum(axis=1)
    ridge = 1e-9  # [m²], where feet stand in one line
    determinant = (xx + ridge) * (yy + ridge) - xy * xy
    slope_x = (xz * (yy + ridge) - yz * xy) / determinant
    slope_y = (yz * (xx + ridge) - xz * xy) / determinant
    residual = np.where(known, z - slope_x[:, None] * x - slope_y[:, None] * y, 0.0)
    variance = (residual * residual).sum(axis=1) / np.maximum(count - 3, 1)
    return np.where(count < LEAST, np.nan, np.sqrt(variance))


def _centred(
    values: Float[np.ndarray, "N P"], known: Bool[np.ndarray, "N P"], count: np.ndarray
) -> Float[np.ndarray, "N P"]:
    """Less their mean over the known; 0 where not known."""
    kept = np.where(known, values, 0.0)
    mean = kept.sum(axis=1) / np.maximum(count, 1)
    return np.where(known, kept - mean[:, None], 0.0)
