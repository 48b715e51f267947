"""What no robot can have left behind: the checks of a log file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args

import numpy as np

from gaitshift.errors import GaitshiftError

_MAY_BE_NAN = ("sensed.value", "k", "threshold")
"""Arrays of which anything may be expected where a robot lies; all others hold finite numbers."""

_FIRST = "sensed.contact"
"""The array whose shape says how many steps and robots there are."""

LEAST_PERIOD, MOST_PERIOD = 0.0005, 0.5
"""Between two entries [s]; ours: no robot is controlled faster, and no step is seen slower, so what
lies outside is no time in seconds."""

RATE_TOLERANCE = 0.05
"""By how much of a period two entries may be nearer or further apart than the first two."""

_HOLDS = {"b": "true and false", "f": "numbers", "i": "whole numbers"}
"""What an array of this kind holds, in words."""


def checked(path: Path, values: Mapping[str, Any], declared: Mapping[str, Any]) -> dict[str, Any]:
    """What a log file holds, its arrays as they are declared, if a robot can have left it.

    Args:
        path: of the file, to name.
        values: what it holds, by name.
        declared: the types of the same names, as jaxtyping writes them.

    Raises:
        GaitshiftError: an array of another shape or kind, numbers that are not finite, a time that
            does not rise at one rate.
    """
    whole: dict[str, Any] = {**values, **_shaped(path, values, declared)}
    _check_numbers(path, whole)
    _check_time(path, whole["sensed.time"], whole["sensed.period"])
    return whole


def _shaped(
    path: Path, values: Mapping[str, Any], types: Mapping[str, Any]
) -> dict[str, np.ndarray]:
    """The arrays in the shapes and of the kinds that are declared."""
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
    """Axes and kind of the arrays that a field takes; None where it takes none."""
    of: Any = annotation if hasattr(annotation, "dim_str") else (*get_args(annotation), None)[0]
    if not hasattr(of, "dim_str"):
        return None
    kinds = {np.dtype(name).kind for name in ("bool", "int64", "float64") if name in of.dtypes}
    axes = of.dim_str.replace("*batch", "T N").replace("steps", "T")
    return tuple(axes.split()), kinds.pop()


def _check_numbers(path: Path, values: Mapping[str, Any]) -> None:
    """Refuses what no robot can have done."""
    for name, value in values.items():
        if name in _MAY_BE_NAN or not isinstance(value, np.ndarray) or value.dtype.kind != "f":
            continue
        finite = np.isfinite(np.asarray(value, dtype=float))
        if not finite.all():
            raise GaitshiftError(
                f"{path}: '{name}' must be finite, got NaN or infinity{_where(~finite, name)}"
            )
    for name in ("sensed.orientation", "truth.base_quaternion_w"):
        length = np.linalg.norm(values[name], axis=-1)
        wrong = np.abs(length - 1.0) > 0.01
        if wrong.any():
            raise GaitshiftError(
                f"{path}: quaternions of '{name}' must have length 1, got {length[wrong][0]:.3g}"
                f"{_where(wrong, name)}"
            )
    gait, names = values["gait"], values["gaits"]
    if gait.min() < 0 or gait.max() >= len(names):
        raise GaitshiftError(
            f"{path}: 'gait' must be 0 to {len(names) - 1}, an index into 'gaits', got "
            f"{gait.min()} to {gait.max()}"
        )


def _where(wrong: np.ndarray, name: str) -> str:
    """The first place where an array is wrong, in words."""
    if name.startswith("terrain_"):
        return ""
    step, *robot = np.argwhere(wrong)[0][:2]
    return f" at entry {step}" + "".join(f" of robot {number}" for number in robot)


def _check_time(path: Path, time: np.ndarray, told: float) -> None:
    """Refuses a time that does not rise at one rate, `told` as the time between two entries [s]."""
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
    if not abs(told - period) <= RATE_TOLERANCE * period:
        raise GaitshiftError(
            f"{path}: 'sensed.period' must be the time between two entries, {period:.4g} s, got "
            f"{told:.4g}"
        )
    changed = np.flatnonzero(np.abs(apart - period) > RATE_TOLERANCE * period)
    if changed.size:
        at = changed[0]
        raise GaitshiftError(
            f"{path}: entries of 'sensed.time' must be equally spaced, got {period:.4g} s at first "
            f"and {apart[at]:.4g} s at entry {at + 1}"
        )
