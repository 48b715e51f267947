"""The checks of a log file: shapes, kinds, finite numbers, times."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast, get_args

import numpy as np

from gaitshift.data import check_text, located
from gaitshift.errors import GaitshiftError

_MAY_BE_NAN = ("sensed.value", "k", "threshold")
"""Arrays that may hold NaN; all others hold finite numbers."""

MOST_POSITION, MOST_REACH = 100_000.0, 100.0
"""Greatest coordinate of anything in the world, and of a foot from its base [m]; ours: the first is
that of `World`, and no leg is as long as the second."""

MOST_NUMBER, MOST_COUNT = 1e9, 1e30
"""Greatest of other numbers, in SI units, and of those without a unit: counters, values of critics;
ours: single precision holds them."""

MOST_GAITS = 64
"""Most gaits of a log; ours: eight times those of the package."""

MOST_STATES = 256
"""States of a machine are below this number; ours: more than a machine can have."""

_POSITIONS = (
    *("truth.base_position_w", "truth.foot_position_w", "truth.clearance"),
    *("terrain_height", "terrain_size", "terrain_origin"),
)

_FIRST = "sensed.contact"
"""The array whose shape gives the number of steps and robots."""

LEAST_PERIOD, MOST_PERIOD = 0.0005, 0.5
"""Least and greatest time between two entries [s]; ours: no robot is controlled faster, and slower
entries miss steps, so a value outside is not a time in seconds."""

LEAST_MASS, MOST_MASS = 0.1, 1000.0
"""Least and greatest mass of a robot [kg]; ours: no quadruped is lighter or heavier."""

RATE_TOLERANCE = 0.05
"""Largest deviation of the time between two entries from that of the first two [period]."""

_HOLDS = {"b": "true and false", "f": "numbers", "i": "whole numbers"}
"""Content of an array by its kind, for error messages."""


def checked(path: Path, values: Mapping[str, Any], declared: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of a log file, checked and with the declared shapes and kinds.

    Args:
        path: of the file, for error messages.
        values: its entries by name.
        declared: the types of the same names, as jaxtyping annotations.

    Raises:
        GaitshiftError: an array of another shape or kind, numbers that are not finite, a time that
            does not rise at one rate.
    """
    whole: dict[str, Any] = {**values, **_shaped(path, values, declared)}
    _check_numbers(path, whole)
    _check_time(path, whole["sensed.time"], whole["sensed.period"])
    return whole


def check_names(path: Path, values: Mapping[str, Any]) -> dict[str, Any]:
    """Names of robot, ground and gaits as texts; `GaitshiftError` where they are no names."""
    names: dict[str, Any] = {}
    with located(str(path)):
        for key, most in (("robot", 1), ("terrain", 1), ("gaits", MOST_GAITS)):
            array: np.ndarray = np.atleast_1d(values[key])
            if array.dtype.kind != "U" or array.ndim != 1 or not 1 <= array.size <= most:
                raise GaitshiftError(
                    f"'{key}' must be {most} text{'s or fewer' * (most > 1)}, got {array.dtype} "
                    f"of the shape {array.shape}"
                )
            texts = tuple(str(text) for text in array)
            for text in texts:
                check_text(key, text)
            names[key] = texts if key == "gaits" else texts[0]
    return names


def _shaped(
    path: Path, values: Mapping[str, Any], types: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """The arrays with their declared shapes and kinds."""
    declared = {name: _declared(of) for name, of in types.items()}
    sizes, shaped = dict[str, int](), dict[str, np.ndarray]()
    for name in sorted((n for n, of in declared.items() if of is not None), key=_FIRST.__ne__):
        array: np.ndarray = values[name]
        wanted, kind = declared[name] or ((), "")
        known = [int(dim) if dim.isdigit() else sizes.get(dim) for dim in wanted]
        if array.ndim != len(known) or any(
            size not in (None, n) for size, n in zip(known, array.shape, strict=True)
        ):
            right = ", ".join(str(sizes.get(dim, dim)) for dim in wanted)
            right += "," if len(wanted) == 1 else ""
            raise GaitshiftError(
                f"{path}: '{name}' must have the shape ({right}), got {array.shape}"
            )
        given = {"u": "i"}.get(array.dtype.kind, array.dtype.kind)
        if given != kind and (given, kind) != ("i", "f"):
            raise GaitshiftError(f"{path}: '{name}' must hold {_HOLDS[kind]}, got {array.dtype}")
        if 0 in array.shape:
            raise GaitshiftError(f"{path}: '{name}' must not be empty, got the shape {array.shape}")
        sizes |= zip(wanted, array.shape, strict=True)
        as_it_is = array.dtype.kind == kind
        shaped[name] = array if as_it_is else array.astype({"f": float, "i": np.int64}[kind])
    return shaped


def _declared(annotation: Any) -> tuple[tuple[str, ...], str] | None:
    """Axes and kind of the arrays of a field; None for a field without arrays."""
    of: Any = annotation if hasattr(annotation, "dim_str") else (*get_args(annotation), None)[0]
    if not hasattr(of, "dim_str"):
        return None
    kinds = {np.dtype(name).kind for name in ("bool", "int64", "float64") if name in of.dtypes}
    axes = of.dim_str.replace("*batch", "T N").replace("steps", "T")
    return tuple(axes.split()), kinds.pop()


def _check_numbers(path: Path, values: Mapping[str, Any]) -> None:
    """Raises `GaitshiftError` for impossible values."""
    for name, value in values.items():
        if not isinstance(value, np.ndarray) or value.dtype.kind != "f":
            continue
        finite: np.ndarray = np.isfinite(cast(Any, value))
        if not finite.all() and name not in _MAY_BE_NAN:
            raise GaitshiftError(
                f"{path}: '{name}' must be finite, got NaN or infinity{_where(~finite, name)}"
            )
        most = limit_of(name)
        wrong: np.ndarray = finite & (np.abs(cast(Any, value)) > most)
        if wrong.any():
            raise GaitshiftError(
                f"{path}: '{name}' must be {-most:g} to {most:g}, got "
                f"{value[wrong][0]:.3g}{_where(wrong, name)}"
            )
    for name in ("sensed.orientation", "truth.base_quaternion_w"):
        length = np.linalg.norm(values[name], axis=-1)
        wrong = np.abs(length - 1.0) > 0.01
        if wrong.any():
            raise GaitshiftError(
                f"{path}: quaternions of '{name}' must have length 1, got {length[wrong][0]:.3g}"
                f"{_where(wrong, name)}"
            )
    check_mass(path, values.get("sensed.mass", 1.0))
    if min(values["terrain_height"].shape) < 2 or not values["terrain_size"].min() > 0:
        raise GaitshiftError(
            f"{path}: the ground must have two or more rows and columns and a size above 0, got "
            f"{values['terrain_height'].shape} on {values['terrain_size'].tolist()} m"
        )
    state = values["machine_state"]
    if state.min() < 0 or state.max() >= MOST_STATES:
        raise GaitshiftError(
            f"{path}: 'machine_state' must be 0 to {MOST_STATES - 1}, got {state.min()} to "
            f"{state.max()}"
        )
    gait, names = values["gait"], values["gaits"]
    if gait.min() < 0 or gait.max() >= len(names):
        raise GaitshiftError(
            f"{path}: 'gait' must be 0 to {len(names) - 1}, an index into 'gaits', got "
            f"{gait.min()} to {gait.max()}"
        )


def limit_of(name: str) -> float:
    """Greatest number of an array of a log file, or of a column of a table."""
    if {name, f"sensed.{name}"} & {*_MAY_BE_NAN, "sensed.time"}:  # the period says more on times
        return MOST_COUNT
    if name == "sensed.foot_position_b" or name.startswith("foot_"):
        return MOST_REACH
    return MOST_POSITION if name in _POSITIONS else MOST_NUMBER


def check_mass(path: Path, mass: float) -> None:
    """Raises `GaitshiftError` unless it is the mass of a robot [kg]."""
    if not LEAST_MASS <= mass <= MOST_MASS:
        raise GaitshiftError(
            f"{path}: 'mass' must be {LEAST_MASS:g} to {MOST_MASS:g} kg, got {mass:.4g}"
        )


def _where(wrong: np.ndarray, name: str) -> str:
    """The first place where an array is wrong, for error messages."""
    if name.startswith("terrain_"):
        return ""
    step, *robot = np.argwhere(wrong)[0][:2]
    return f" at entry {step}" + "".join(f" of robot {number}" for number in robot)


def _check_time(path: Path, time: np.ndarray, stated: float) -> None:
    """Raises `GaitshiftError` unless the time rises at one rate, by `stated` [s] per entry."""
    apart = np.diff(time)
    if not apart.size:
        return
    standing = np.flatnonzero(apart <= 0.0)
    if standing.size:
        raise GaitshiftError(
            f"{path}: 'sensed.time' must rise from entry to entry, got "
            f"{time[standing[0] + 1]:.4g} s after {time[standing[0]]:.4g} s at entry "
            f"{standing[0] + 1}"
        )
    period = float(apart[0])
    if not LEAST_PERIOD <= period <= MOST_PERIOD:
        raise GaitshiftError(
            f"{path}: entries of 'sensed.time' must be {LEAST_PERIOD:g} to {MOST_PERIOD:g} s "
            f"apart, got {period:.4g}; the unit is seconds"
        )
    if not abs(stated - period) <= RATE_TOLERANCE * period:
        raise GaitshiftError(
            f"{path}: 'sensed.period' must be the time between two entries, {period:.4g} s, got "
            f"{stated:.4g}"
        )
    changed = np.flatnonzero(np.abs(apart - period) > RATE_TOLERANCE * period)
    if changed.size:
        at = changed[0]
        raise GaitshiftError(
            f"{path}: entries of 'sensed.time' must be equally spaced, got {period:.4g} s at first "
            f"and {apart[at]:.4g} s at entry {at + 1}"
        )
