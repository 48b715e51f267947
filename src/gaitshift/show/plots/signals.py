"""Quantities that figures and videos derive from a log: spans, speeds, ground, smooth courses."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Shaped

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import Terrain

_SAME_GROUND = 0.01
"""Largest difference below the feet at which two grounds are the same [m]."""


@dataclass(frozen=True, kw_only=True)
class Span:
    """A stretch of time with a constant value."""

    begin: float
    """[s]"""
    end: float
    """[s]"""
    entry: int
    """Index of its first entry in the log."""

    @property
    def middle(self) -> float:
        """The middle of the stretch [s]."""
        return (self.begin + self.end) / 2


def check_robot(log: Log, robot: int) -> None:
    """`GaitshiftError` unless the log has at least two entries, and this robot."""
    steps, count = log.k.shape
    if steps < 2:
        raise GaitshiftError(f"a log must have 2 control steps or more to draw, got {steps}")
    if not 0 <= robot < count:
        raise GaitshiftError(f"robot must be 0 to {count - 1}, got {robot}")


def window(log: Log, t0: float, t1: float) -> Log:
    """The entries of a log from `t0` to `t1` [s]; `GaitshiftError` where they are less than two."""
    begin = int(np.searchsorted(log.time, t0, side="left"))
    end = int(np.searchsorted(log.time, t1, side="right"))
    if end - begin < 2:
        raise GaitshiftError(
            f"times must be within {log.time[0]:g} to {log.time[-1]:g} s, got {t0:g} to {t1:g} s"
        )
    return log[begin:end]


def period(log: Log) -> float:
    """Time from one entry to the next [s]."""
    return float(log.time[1] - log.time[0])


def spans(log: Log, values: Shaped[np.ndarray, " T"]) -> list[Span]:
    """Stretches of equal values. An entry is valid until the next one."""
    cuts = np.flatnonzero(values[1:] != values[:-1]) + 1
    entries = [0, *cuts.tolist()]
    times = [*log.time[entries].tolist(), float(log.time[-1]) + period(log)]
    return [Span(begin=times[i], end=times[i + 1], entry=entry) for i, entry in enumerate(entries)]


def gait_at(log: Log, robot: int, entry: int) -> str:
    """Name of the present gait."""
    return log.gaits[int(log.gait[entry, robot])]


def gait_spans(log: Log, robot: int) -> list[tuple[str, Span]]:
    """The gaits in order, with the time of each."""
    return [(gait_at(log, robot, s.entry), s) for s in spans(log, log.gait[:, robot])]


def shift_times(log: Log, robot: int) -> list[float]:
    """Times of the shifts before a fall [s]."""
    fell = fall_time(log, robot)
    starts = [span.begin for _, span in gait_spans(log, robot)[1:]]
    return [time for time in starts if fell is None or time < fell]


def fall_time(log: Log, robot: int) -> float | None:
    """Time of the robot's fall [s]; None without a fall."""
    fallen = np.flatnonzero(log.fallen[:, robot])
    return float(log.time[fallen[0]]) if fallen.size else None


def has_condition(log: Log, robot: int) -> bool:
    """Whether there was a shift condition; without one the log has zeros."""
    return bool((log.threshold[:, robot] > 0).any())


def ground_of(log: Log) -> Terrain:
    """The ground in the log."""
    return Terrain(
        height=log.terrain_height,
        size=(float(log.terrain_size[0]), float(log.terrain_size[1])),
        origin=(float(log.terrain_origin[0]), float(log.terrain_origin[1])),
        name=log.terrain,
    )


def walks_on_kept_ground(log: Log, robot: int) -> bool:
    """Whether the ground in the log is this robot's; of several grounds a log has the first."""
    kept = ground_of(log).height_at(log.truth.foot_position_w[:, robot, :, :2])
    return bool(np.allclose(kept, _ground_below_feet(log, robot), atol=_SAME_GROUND))


def ground_below(log: Log, robot: int) -> Float[np.ndarray, " T"]:
    """Height of the ground below the base [m]; if it is not in the log, below the feet."""
    if walks_on_kept_ground(log, robot):
        return ground_of(log).height_at(log.truth.base_position_w[:, robot, :2])
    return _ground_below_feet(log, robot).mean(axis=1)


def _ground_below_feet(log: Log, robot: int) -> Float[np.ndarray, "T 4"]:
    return log.truth.foot_position_w[:, robot, :, 2] - log.truth.clearance[:, robot]


def smoothed(values: Float[np.ndarray, " T"], step: float, sigma: float) -> Float[np.ndarray, " T"]:
    """Values every `step` [s], averaged in a Gaussian window of standard deviation `sigma` [s].

    The window is symmetric, so nothing is delayed. Each point is the value of the line that fits
    best in its window (local linear regression), so that straight lines are preserved up to the
    ends.
    """
    reach = int(np.ceil(3 * sigma / step))
    offset = np.arange(-reach, reach + 1)
    weights = np.exp(-0.5 * (offset * step / sigma) ** 2)

    def summed(course: Float[np.ndarray, " T"], power: int) -> Float[np.ndarray, " T"]:
        return np.correlate(np.pad(course, reach), weights * offset**power, mode="valid")

    s0, s1, s2 = (summed(np.ones(len(values)), power) for power in range(3))
    total, moment = summed(values, 0), summed(values, 1)
    return (s2 * total - s1 * moment) / (s0 * s2 - s1**2)
