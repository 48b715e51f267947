"""Recordings from files: npz logs of this package, and tables (CSV, Parquet) of any robot."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.labelled_run import LabelledRun, Way, rough_ground
from gaitshift.lab.log import Log
from gaitshift.lab.log_check import (
    LEAST_PERIOD,
    MOST_PERIOD,
    RATE_TOLERANCE,
    check_mass,
    limit_of,
)
from gaitshift.robot.legs import JOINTS, LEGS
from gaitshift.robot.state import Proprioception, orientation_of
from gaitshift.shift import LegOdometry
from gaitshift.table import STREAMED, stream

_AXES = ("x", "y", "z")
CONTACTS = tuple(f"contact_{leg}" for leg in LEGS)
FEET = tuple(f"foot_{leg}_{axis}" for leg in LEGS for axis in _AXES)
REQUIRED = ("time", *CONTACTS, *FEET, "rough")
"""Columns of every log: time [s], contacts (0 or 1), feet in the body frame [m], rough (0 or 1)."""

ATTITUDES = (tuple(f"gravity_{axis}" for axis in _AXES), ("roll", "pitch"))
"""One of them is required: the direction of gravity in the body frame, or two angles [rad]."""

VECTORS = {"velocity_b": "velocity", "angular_velocity_b": "angular_velocity"}
"""Optional signals of three columns: `velocity_x` and so on, body frame [m/s], [rad/s]."""

SCALARS = {
    "forward_speed_command": "speed_command",
    "stride_frequency_command": "stride_frequency",
    "value": "value",
}
"""Optional signals of one column each [m/s], [Hz]; `yaw` [rad] and `mass` [kg] are optional too."""

_JOINTS = ("joint_position", "joint_velocity", "joint_torque")
"""Optional signals of twelve columns: `joint_torque_FL_HAA` and so on [rad], [rad/s], [N·m]."""

LONGEST = 60_000
"""Largest number of rows of a passage; a longer stretch is cut."""

_LEAST_GRAVITY = 1e-6
"""Length below which a gravity vector has no direction, in any unit."""

_NUMBERS = (
    "time",
    *FEET,
    *(name for names in ATTITUDES for name in names),
    "yaw",
    "mass",
    *SCALARS.values(),
    *(f"{prefix}_{axis}" for prefix in VECTORS.values() for axis in _AXES),
    *(f"{prefix}_{leg}_{joint}" for prefix in _JOINTS for leg in LEGS for joint in JOINTS),
)
_FLAGS = (*CONTACTS, "rough")
"""Columns that may hold true and false."""

_SEED = re.compile(r"-\d+$")


def columns_of(signal: str) -> tuple[str, ...]:
    """Columns of an optional signal."""
    if signal in VECTORS:
        return tuple(f"{VECTORS[signal]}_{axis}" for axis in _AXES)
    if signal in _JOINTS:
        return tuple(f"{signal}_{leg}_{joint}" for leg in LEGS for joint in JOINTS)
    return (SCALARS.get(signal, signal),)


def check_sources(paths: Sequence[Path]) -> None:
    """`GaitshiftError` unless all files have a readable format; called before any work."""
    for path in paths:
        if not path.is_file():
            raise GaitshiftError(f"no log file {path}")
        if path.suffix not in (".npz", *STREAMED):
            raise GaitshiftError(
                f"{path}: the name of a log must end in .npz, {' or '.join(STREAMED)}"
            )


def recordings(paths: Sequence[Path], way: Way = "rough") -> Iterator[LabelledRun]:
    """The recordings in the files, file by file; tables are split into passages for this way.

    A recording has the name of its file without a seed at its end.

    Raises:
        GaitshiftError: a file cannot be read; the message says why.
    """
    for path in paths:
        if path.suffix in STREAMED:
            yield from passages(path, way)
            continue
        log = Log.load(path)
        if not log.sensed.contact.any():
            raise GaitshiftError(
                f"{path}: 'contact' must be true where a foot is down, got no contact at all"
            )
        yield LabelledRun.from_log(log, _SEED.sub("", path.stem), rough_ground(log))


def passages(path: Path, way: Way = "rough") -> Iterator[LabelledRun]:
    """The passages of a log: each is smooth ground followed by rough ground.

    On the way back each is rough ground followed by smooth ground. Rough ground at the start of a
    log is left out if smooth ground follows, because its beginning is not in the log. A file is
    read in batches, so that gigabytes need no more memory than a passage.

    Raises:
        GaitshiftError: the file lacks a column or has a wrong value, with its row.
    """
    columns: dict[str, list[np.ndarray]] = {}
    rows, before, period, touched, down = 0, np.nan, np.nan, False, 0.0
    may_begin_rough = way == "rough"
    for batch in stream(path, numbers=_NUMBERS, flags=_FLAGS):
        _check_columns(path, batch)
        period = _check_values(path, batch, rows, before, period)
        before = float(batch["time"][-1])
        down += _down(path, batch, rows, down)
        touched = touched or any(batch[name].any() for name in CONTACTS)
        rows += len(batch["time"])
        for name, values in batch.items():
            columns.setdefault(name, []).append(values)
        whole = {name: np.concatenate(parts) for name, parts in columns.items()}
        rough = whole["rough"] > 0.5
        start = 0
        for end in _ends(rough if way == "rough" else ~rough):
            not_come_to = may_begin_rough and rough[start:end].all() and not rough[end]
            may_begin_rough = False
            if end - start > 1 and not not_come_to:
                yield _recording(path, whole, slice(start, end))
            start = end
        columns = {name: [values[start:]] for name, values in whole.items()}
    if rows < 2:
        raise GaitshiftError(
            f"{path}: must have two rows or more, one for each control step, got {rows}"
        )
    if not touched:
        raise GaitshiftError(
            f"{path}: contact columns must be 1 where a foot is down, got no contact at all"
        )
    whole = {name: np.concatenate(parts) for name, parts in columns.items()}
    if len(whole["time"]) > 1:
        yield _recording(path, whole, slice(0, len(whole["time"])))


def _check_columns(path: Path, batch: dict[str, np.ndarray]) -> None:
    missing = [name for name in REQUIRED if name not in batch]
    if missing:
        legs = ", ".join(LEGS)
        raise GaitshiftError(
            f"{path} lacks the column '{missing[0]}'; a table needs time, rough, contact_LEG and "
            f"foot_LEG_x, _y, _z for the legs {legs}"
        )
    if not any(all(name in batch for name in names) for names in ATTITUDES):
        raise GaitshiftError(
            f"{path} lacks the attitude; a table needs gravity_x, _y, _z, or roll and pitch"
        )


def _check_values(
    path: Path, batch: dict[str, np.ndarray], rows: int, before: float, period: float
) -> float:
    """Raises `GaitshiftError` for NaN or uneven times; returns the time between two rows [s]."""
    for name, values in batch.items():
        bad = np.flatnonzero(~np.isfinite(values))
        if bad.size:
            raise GaitshiftError(
                f"{path}: row {rows + bad[0] + 1}, '{name}' must be a finite number"
            )
        most = limit_of(name)
        far = np.flatnonzero(np.abs(values) > most)
        if far.size:
            raise GaitshiftError(
                f"{path}: row {rows + far[0] + 1}, '{name}' must be {-most:g} to {most:g}, got "
                f"{values[far[0]]:.3g}"
            )
    apart = np.diff(batch["time"], prepend=before)
    wrong = np.flatnonzero(apart <= 0)
    if wrong.size:
        raise GaitshiftError(
            f"{path}: row {rows + wrong[0] + 1}, 'time' must rise from row to row, got "
            f"{apart[wrong[0]]:.4g} s after the row before"
        )
    if np.isnan(period):
        known = apart[np.isfinite(apart)]
        period = float(known[0]) if known.size else np.nan
        if known.size and not LEAST_PERIOD <= period <= MOST_PERIOD:
            raise GaitshiftError(
                f"{path}: rows must be {LEAST_PERIOD:g} to {MOST_PERIOD:g} s apart in 'time', got "
                f"{period:.4g}; the unit is seconds"
            )
    changed = np.flatnonzero(np.abs(apart - period) > RATE_TOLERANCE * period)
    if changed.size:
        raise GaitshiftError(
            f"{path}: rows must be equally spaced in 'time', got {period:.4g} s at first and "
            f"{apart[changed[0]]:.4g} s before row {rows + changed[0] + 1}"
        )
    return period


def _down(path: Path, batch: dict[str, np.ndarray], rows: int, before: float) -> float:
    """Sum of the vertical components of gravity so far; `before` is the sum of the rows before.

    Raises:
        GaitshiftError: gravity has no direction in a row, or points up on average.
    """
    vector, angles = ATTITUDES
    names = vector if all(name in batch for name in vector) else angles
    if names is vector:
        length = np.linalg.norm(np.stack([batch[name] for name in vector]), axis=0)
        none = np.flatnonzero(length < _LEAST_GRAVITY)
        if none.size:
            raise GaitshiftError(
                f"{path}: row {rows + none[0] + 1}, gravity_x, _y, _z must be a direction, (0, 0, "
                "-1) on level ground, got 0, 0, 0"
            )
    down = float(_gravity(batch)[:, 2].sum())
    if before + down > 0.0:
        right = "gravity_z -1" if names is vector else "roll and pitch 0 rad"
        raise GaitshiftError(
            f"{path}: {', '.join(names)} must point gravity down, {right} on level ground, got "
            "gravity up on average"
        )
    return down


def _ends(rough: np.ndarray) -> list[int]:
    """Rows where rough ground ends, or where a stretch is too long."""
    ends = [int(last) + 1 for last in np.flatnonzero(rough[:-1] & ~rough[1:])]
    start, cuts = 0, list[int]()
    for end in [*ends, len(rough)]:
        cuts += range(start + LONGEST, end, LONGEST)
        start = end
    return sorted([*ends, *cuts])


def _recording(path: Path, columns: dict[str, np.ndarray], rows: slice) -> LabelledRun:
    """One robot over these rows."""
    cut = {name: values[rows] for name, values in columns.items()}
    optional = dict[str, Any]()
    for signal in (*SCALARS, *VECTORS, *_JOINTS):
        names = columns_of(signal)
        if all(name in cut for name in names):
            values = np.stack([cut[name] for name in names], axis=1)
            optional[signal] = values if signal in SCALARS else values[:, None]
    if "mass" in cut:
        optional["mass"] = float(cut["mass"][0])
        check_mass(path, optional["mass"])
    steps, time = len(cut["time"]), cut["time"]
    sensed = Proprioception(
        contact=np.stack([cut[name] > 0.5 for name in CONTACTS], axis=1)[:, None],
        foot_position_b=np.stack([cut[name] for name in FEET], axis=1).reshape(steps, 1, 4, 3),
        orientation=orientation_of(_gravity(cut), cut.get("yaw", 0.0))[:, None],
        has_heading="yaw" in cut,
        time=time,
        period=float(time[1] - time[0]),
        **optional,
    )
    return LabelledRun(
        name=path.name,
        sensed=sensed,
        rough=cut["rough"][:, None] > 0.5,
        alive=np.ones((steps, 1), dtype=bool),
        distance=_distance(sensed),
    )


def _gravity(columns: dict[str, np.ndarray]) -> Float[np.ndarray, "T 3"]:
    """Direction of gravity in the body frame, from its columns or from roll and pitch."""
    vector, angles = ATTITUDES
    if all(name in columns for name in vector):
        gravity = np.stack([columns[name] for name in vector], axis=1)
        return gravity / np.linalg.norm(gravity, axis=1, keepdims=True)
    roll, pitch = (columns[name] for name in angles)
    level = np.cos(pitch)
    return np.stack([np.sin(pitch), -np.sin(roll) * level, -np.cos(roll) * level], axis=1)


def _distance(sensed: Proprioception) -> Float[np.ndarray, "T 1"]:
    """Distance that one robot has walked, by leg odometry [m]."""
    odometry, steps = LegOdometry(), len(sensed.contact)
    state, base = odometry.start(1), np.empty((steps, 2))
    for t in range(steps):
        state, _ = odometry.step(state, sensed[t])
        base[t] = state.base[0, :2]
    step = np.linalg.norm(np.diff(base, axis=0, prepend=base[:1]), axis=1)
    return step.cumsum()[:, None]
