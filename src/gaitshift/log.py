"""What a run of N robots left behind, step by step: the one format of `--log FILE.npz`."""

import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError

_TIMELESS = ("gaits", "robot", "terrain")
"""What the names of fields begin with whose first axis is not time."""

_FINITE = ("time", "qpos", "qvel", "torque", "foot_position_w", "command")
"""Arrays that hold numbers at all times, and so does the ground; heights of feet that never
touched, and what conditions make of a robot that lies, may be anything."""

LEAST_PERIOD, MOST_PERIOD = 0.0005, 0.5
"""Between two entries [s]; ours: no robot is controlled faster, and no step is seen slower, so what
lies outside is no time in seconds."""

RATE_TOLERANCE = 0.05
"""By how much of a period two entries may be nearer or further apart than the first two."""

_HOLDS = {"b": "true and false", "f": "numbers", "i": "whole numbers"}
"""What an array of this kind holds, in words."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """T control steps of N robots. Time comes first, then the robot, then the leg or joint.

    Entry t is the motion after control step t: what the controllers saw before their next action.
    Positions, velocities, torques and heights may be kept in single precision: 4 µm at 50 m.
    """

    time: Float[np.ndarray, " T"]
    """[s] from the start of the run."""
    qpos: Float[np.ndarray, "T N 19"]
    """MuJoCo's positions: base position [m], base quaternion (w, x, y, z), joint angles [rad]."""
    qvel: Float[np.ndarray, "T N 18"]
    """Base velocity, world frame [m/s]; its angular velocity, body frame, and joints [rad/s]."""
    torque: Float[np.ndarray, "T N 12"]
    """Joint torques [N·m]."""
    contact: Bool[np.ndarray, "T N 4"]
    """Whether each foot touches."""
    foot_position_w: Float[np.ndarray, "T N 4 3"]
    """Lowest point of each foot, world frame [m]."""
    clearance: Float[np.ndarray, "T N 4"]
    """Height of that point above the ground under it [m]."""
    foot_height: Float[np.ndarray, "T N 4"]
    """The condition's h_i: height of each foot at its last touch, in the condition's frame [m]."""
    k: Float[np.ndarray, "T N"]
    """The shift condition's counter, before a firing sets it back to 0."""
    threshold: Float[np.ndarray, "T N"]
    """β (or the reverse rule's) that k is held against."""
    gait: Int[np.ndarray, "T N"]
    """Index into `gaits` of the gait that acts next."""
    machine_state: Int[np.ndarray, "T N"]
    """State of that gait's machine."""
    stance_shown: Bool[np.ndarray, "T N"]
    """Whether the contacts are a stance set of that gait's machine."""
    fallen: Bool[np.ndarray, "T N"]
    """Whether the robot has fallen by now; it lies where it fell, and counts no more."""
    command: Float[np.ndarray, "T N 3"]
    """Commanded forward speed [m/s], yaw rate [rad/s] and stride frequency [Hz]."""
    gaits: tuple[str, ...]
    """Names of the gaits."""
    robot: str
    """Name of the robot."""
    terrain: str
    """Spec of the ground."""
    terrain_height: Float[np.ndarray, "rows cols"]
    """Heights of the ground, rows along +y, columns along +x [m]; the first one's where robots
    stood on several."""
    terrain_size: Float[np.ndarray, " 2"]
    """Length along x and width along y of the ground [m]."""
    terrain_origin: Float[np.ndarray, " 2"]
    """World x, y of its first sample [m]."""
    value: Float[np.ndarray, "T N"] | None = None
    """What the policy's critic expected from what robots acted on; None where nobody asked."""

    def part(self, entries: slice) -> "Log":
        """The same robots in some of the entries; arrays are shared."""
        return replace(self, time=self.time[entries], **self._courses((entries,)))

    def robots(self, ids: slice) -> "Log":
        """Some of the robots over the whole time; arrays are shared."""
        return replace(self, **self._courses((slice(None), ids)))

    def _courses(self, where: tuple[slice, ...]) -> dict[str, Any]:
        """All arrays over time and robots, there."""
        names = (f.name for f in fields(self) if not f.name.startswith((*_TIMELESS, "time")))
        given = ((name, getattr(self, name)) for name in names)
        return {name: rows[where] for name, rows in given if rows is not None}

    def save(self, path: Path) -> None:
        """Writes a compressed npz file, whole or not at all."""
        part = path.with_suffix(".part.npz")
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        given: dict[str, Any] = {k: np.asarray(v) for k, v in values.items() if v is not None}
        np.savez_compressed(part, **given)
        part.replace(path)

    @classmethod
    def load(cls, path: Path) -> "Log":
        """Reads what `save` wrote.

        Other arrays in the file are passed over.

        Raises:
            GaitshiftError: no such file, not an npz file, or an array is missing or is not what a
                log has: of another shape, not finite, a time that does not rise at one rate.
        """
        names = [f.name for f in fields(cls)]
        try:
            with path.open("rb") as file:
                entries = np.load(file)
                if not isinstance(entries, np.lib.npyio.NpzFile):
                    raise ValueError("it holds one array alone")
                values: dict[str, Any] = {name: entries[name] for name in names if name in entries}
        except FileNotFoundError as error:
            raise GaitshiftError(f"no log file {path}") from error
        except (OSError, EOFError, ValueError, zipfile.BadZipFile, zlib.error) as error:
            raise GaitshiftError(f"{path} is not a whole npz file: {error}") from error
        missing = [name for name in names if name not in values and name != "value"]
        if missing:
            raise GaitshiftError(f"{path} is no log of gaitshift: it lacks '{missing[0]}'")
        for name in ("robot", "terrain"):
            values[name] = str(values[name])
        values["gaits"] = tuple(str(name) for name in np.atleast_1d(values["gaits"]))
        values |= _shaped(path, values)
        _check_numbers(path, values)
        _check_time(path, values["time"])
        return cls(**values)


def _shaped(path: Path, values: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The arrays in the shapes and of the kinds that `Log` declares."""
    declared = {f.name: _declared(f.type) for f in fields(Log) if f.name in values}
    sizes, shaped = dict[str, int](), dict[str, np.ndarray]()
    for name in sorted((n for n, of in declared.items() if of is not None), key="qpos".__ne__):
        array: np.ndarray = values[name]
        wanted, kind = declared[name] or ((), "")
        known = [int(dim) if dim.isdigit() else sizes.get(dim) for dim in wanted]
        if array.ndim != len(known) or any(
            size not in (None, n) for size, n in zip(known, array.shape, strict=True)
        ):
            right = ", ".join(str(sizes.get(dim, dim)) for dim in wanted)
            right += "," if len(wanted) == 1 else ""
            raise GaitshiftError(
                f"{path}: '{name}' has the shape {array.shape}; ({right}) would be right"
            )
        given = {"u": "i"}.get(array.dtype.kind, array.dtype.kind)
        if given != kind and (given, kind) != ("i", "f"):
            raise GaitshiftError(
                f"{path}: '{name}' holds {array.dtype}; {_HOLDS[kind]} would be right"
            )
        if 0 in array.shape:
            raise GaitshiftError(
                f"{path}: '{name}' is empty, {array.shape}; a log has steps and robots"
            )
        sizes |= zip(wanted, array.shape, strict=True)
        as_it_is = array.dtype.kind == kind
        shaped[name] = array if as_it_is else array.astype({"f": float, "i": np.int64}[kind])
    return shaped


def _declared(annotation: Any) -> tuple[tuple[str, ...], str] | None:
    """Axes and kind of the arrays that a field of `Log` takes; None where it takes none."""
    of: Any = annotation if hasattr(annotation, "dim_str") else (*get_args(annotation), None)[0]
    if not hasattr(of, "dim_str"):
        return None
    kinds = {np.dtype(name).kind for name in ("bool", "int64", "float64") if name in of.dtypes}
    return tuple(of.dim_str.split()), kinds.pop()


def _check_numbers(path: Path, values: Mapping[str, Any]) -> None:
    """Refuses what no robot can have done."""
    for name in (*_FINITE, *(n for n in values if n.startswith("terrain_"))):
        finite = np.isfinite(values[name])
        if not finite.all():
            raise GaitshiftError(
                f"{path}: '{name}' is not finite{_where(~finite, name)}; numbers would be right"
            )
    length = np.linalg.norm(values["qpos"][..., 3:7], axis=-1)
    wrong = np.abs(length - 1.0) > 0.01
    if wrong.any():
        raise GaitshiftError(
            f"{path}: 'qpos' has a quaternion of length {length[wrong][0]:.3g}"
            f"{_where(wrong, 'qpos')}; 1 would be right"
        )
    gait, names = values["gait"], values["gaits"]
    if gait.min() < 0 or gait.max() >= len(names):
        raise GaitshiftError(
            f"{path}: 'gait' reaches from {gait.min()} to {gait.max()}; 0 to {len(names) - 1} "
            "would be right, places in 'gaits'"
        )


def _where(wrong: np.ndarray, name: str) -> str:
    """The first place where an array is wrong, in words."""
    if name.startswith(_TIMELESS):
        return ""
    step, *robot = np.argwhere(wrong)[0][:2]
    return f" at entry {step}" + "".join(f" of robot {number}" for number in robot)


def _check_time(path: Path, time: np.ndarray) -> None:
    """Refuses a time that does not rise at one rate."""
    apart = np.diff(time)
    if not apart.size:
        return
    standing = np.flatnonzero(apart <= 0.0)
    if standing.size:
        raise GaitshiftError(
            f"{path}: 'time' does not rise at entry {standing[0] + 1}; entries must be in order, "
            "each time once"
        )
    period = float(apart[0])
    if not LEAST_PERIOD <= period <= MOST_PERIOD:
        raise GaitshiftError(
            f"{path}: entries of 'time' are {period:.4g} apart; it is in seconds, and "
            f"{LEAST_PERIOD:g} to {MOST_PERIOD:g} s would be right"
        )
    changed = np.flatnonzero(np.abs(apart - period) > RATE_TOLERANCE * period)
    if changed.size:
        at = changed[0]
        raise GaitshiftError(
            f"{path}: entry {at + 1} of 'time' comes {apart[at]:.4g} s after the one before, the "
            f"first ones {period:.4g} s: one rate throughout would be right"
        )
