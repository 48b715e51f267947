"""What figures and videos derive from a log: spans, speeds, the ground, smooth courses."""

from dataclasses import fields, replace

import numpy as np
from jaxtyping import Float, Int, Shaped

from gaitshift.errors import GaitshiftError
from gaitshift.log import Log
from gaitshift.terrain import Terrain

_TIMELESS = ("gaits", "robot", "terrain")
"""What the names of a log's fields begin with where the first axis is not time."""


def check_robot(log: Log, robot: int) -> None:
    """`GaitshiftError` unless the log has a course in time, and this robot."""
    steps, count = log.k.shape
    if steps < 2:
        raise GaitshiftError(f"a log of {steps} control steps shows nothing; 2 is the least")
    if not 0 <= robot < count:
        raise GaitshiftError(f"robot {robot} is not in the log; it holds 0 to {count - 1}")


def window(log: Log, t0: float, t1: float) -> Log:
    """The entries of a log from `t0` to `t1` [s]; `GaitshiftError` where they are less than two."""
    inside = (log.time >= t0) & (log.time <= t1)
    if np.count_nonzero(inside) < 2:
        raise GaitshiftError(
            f"nothing to show from {t0:g} to {t1:g} s: the log goes from {log.time[0]:g} "
            f"to {log.time[-1]:g} s"
        )
    courses = (f.name for f in fields(log) if not f.name.startswith(_TIMELESS))
    return replace(log, **{name: getattr(log, name)[inside] for name in courses})


def edges(time: Float[np.ndarray, " T"]) -> Float[np.ndarray, " T+1"]:
    """Ends of the stretches that entries stand for [s]: from each entry to the one after it."""
    return np.append(time, 2 * time[-1] - time[-2])


def runs(values: Shaped[np.ndarray, " T"]) -> Int[np.ndarray, "n 2"]:
    """Stretches of equal values: first entry and the one after the last, in order."""
    cuts = np.flatnonzero(values[1:] != values[:-1]) + 1
    return np.stack([np.append(0, cuts), np.append(cuts, len(values))], axis=1)


def runs_of(flags: Shaped[np.ndarray, " T"]) -> Int[np.ndarray, "n 2"]:
    """Those of the `runs` in which the flag is set, as the stance phases of a foot."""
    stretches = runs(flags)
    return stretches[np.asarray(flags[stretches[:, 0]], dtype=bool)]


def shifts(log: Log, robot: int) -> Int[np.ndarray, " n"]:
    """Entries at which another gait takes over, as long as the robot stands."""
    return runs(log.gait[: fall(log, robot), robot])[1:, 0]


def fall(log: Log, robot: int) -> int | None:
    """First entry at which the robot has fallen, if it has."""
    fallen = np.flatnonzero(log.fallen[:, robot])
    return int(fallen[0]) if fallen.size else None


def forward_speed(log: Log, robot: int) -> Float[np.ndarray, " T"]:
    """Velocity of the base along its own x axis [m/s]: what the command asks for."""
    w, x, y, z = log.qpos[:, robot, 3:7].T
    forward = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], axis=1)
    return np.einsum("ti,ti->t", forward, log.qvel[:, robot, :3])


def smoothed(
    values: Float[np.ndarray, " T"], time: Float[np.ndarray, " T"], sigma: float
) -> Float[np.ndarray, " T"]:
    """The values, averaged with a Gaussian window of standard deviation `sigma` [s].

    The window looks both ways, so nothing is delayed; beyond its ends a course goes on as its
    mirror image through the end point, so that a straight line stays one.
    """
    period = time[-1] - time[-2]
    reach = int(np.ceil(3 * sigma / period))
    window = np.exp(-0.5 * (np.arange(-reach, reach + 1) * period / sigma) ** 2)
    padded = np.pad(values, reach, mode="reflect", reflect_type="odd")
    return np.convolve(padded, window / window.sum(), mode="valid")


def ground_of(log: Log) -> Terrain:
    """The terrain that the log was made on."""
    return Terrain(
        height=log.terrain_height,
        size=(float(log.terrain_size[0]), float(log.terrain_size[1])),
        origin=(float(log.terrain_origin[0]), float(log.terrain_origin[1])),
        name=log.terrain,
    )
