"""The log of a run of N robots, step by step: the format of `--log FILE.npz`."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log_check import check_names, checked
from gaitshift.lab.npz import arrays_in
from gaitshift.robot.state import Batch, Privileged, Proprioception
from gaitshift.whole_file import replacing

FORMAT_VERSION = 2
"""Increased when an earlier file could be misread. 1 (gaitshift 0.1) held MuJoCo's qpos, qvel."""

_RECORDS: Mapping[str, type[Any]] = {"sensed": Proprioception, "truth": Privileged}
"""Records of a log; in a file their arrays are named `sensed.contact` and so on."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Log(Batch):
    """T control steps of N robots: proprioception, privileged state, and decisions.

    Axes are time, robot, then leg or joint; `log[t]` is a step, and `log[a:b]` some of the steps.
    Entry t is the state after control step t, which the controllers saw before their next action.
    Numbers may be in single precision, which resolves 4 µm at 50 m.
    """

    sensed: Proprioception
    """Proprioception and commands."""
    truth: Privileged
    """State that only the simulator knows."""
    k: Float[np.ndarray, "*batch"]
    """The shift condition's counter, before a shift sets it back to 0 [counts]."""
    threshold: Float[np.ndarray, "*batch"]
    """β of the rule that k belongs to, forward or reverse [counts]."""
    gait: Int[np.ndarray, "*batch"]
    """Index into `gaits` of the gait that acts next."""
    machine_state: Int[np.ndarray, "*batch"]
    """State of that gait's machine."""
    stance_shown: Bool[np.ndarray, "*batch"]
    """Whether the feet that are down in truth are a stance set of that gait's machine."""
    fallen: Bool[np.ndarray, "*batch"]
    """Whether the robot has fallen so far; a fallen robot stays down and no longer counts."""
    gaits: tuple[str, ...]
    """Names of the gaits."""
    robot: str
    """Name of the robot."""
    terrain: str
    """Spec of the ground."""
    terrain_height: Float[np.ndarray, "rows cols"]
    """Heights of the ground, rows along +y, columns along +x [m]; of several grounds, the
    first."""
    terrain_size: Float[np.ndarray, " 2"]
    """Length along x and width along y of the ground [m]."""
    terrain_origin: Float[np.ndarray, " 2"]
    """World x, y of its first sample [m]."""

    @property
    def time(self) -> Float[np.ndarray, " T"]:
        """Since the start of the run [s]."""
        time: Any = self.sensed.time
        return np.atleast_1d(time)

    @property
    def n(self) -> int:
        """Robots."""
        return self.k.shape[-1]

    @property
    def qpos(self) -> Float[np.ndarray, "*batch 19"]:
        """MuJoCo's positions: base position [m], base quaternion (w, x, y, z), joints [rad]."""
        joints = self.sensed.need("joint_position", "a picture")
        truth = self.truth
        return np.concatenate([truth.base_position_w, truth.base_quaternion_w, joints], axis=-1)

    @cached_property
    def touch_height(self) -> Float[np.ndarray, "T N 4"]:
        """The paper's h: height of each foot above the base at its last touch, along the vertical.

        [m]; NaN where a foot has not touched in this log.
        """
        contact = self.sensed.contact
        entry = np.where(contact, np.arange(len(contact))[:, None, None], 0)
        last = np.maximum.accumulate(entry, axis=0)
        height = np.take_along_axis(self.sensed.foot_height, last, axis=0)
        return np.where(np.logical_or.accumulate(contact, axis=0), height, np.nan)

    def save(self, path: Path) -> None:
        """Writes a compressed npz file, whole or not at all."""
        values: dict[str, Any] = {"format_version": FORMAT_VERSION}
        for name in _types():
            value: Any = self
            for attribute in name.split("."):
                value = getattr(value, attribute)
            if value is not None:
                values[name] = np.asarray(value)
        with replacing(path) as part, part.open("wb") as file:
            np.savez_compressed(file, **values)

    @classmethod
    def load(cls, path: Path) -> "Log":
        """Reads what `save` wrote.

        Other arrays in the file are ignored.

        Raises:
            GaitshiftError: no such file, not an npz file, of an earlier format, or an array is
                missing or is not what a log has: of another shape, not finite, a time that does not
                rise at one rate.
        """
        types = _types()
        values = _read(path, types)
        values |= check_names(path, values)
        plain = {"sensed.has_heading": bool, "sensed.period": float, "sensed.mass": float}
        for name, kind in plain.items():
            if name not in values:
                continue
            if np.size(values[name]) != 1:
                raise GaitshiftError(
                    f"{path}: '{name}' must be one value, got the shape {np.shape(values[name])}"
                )
            if values[name].dtype.kind not in "biuf":
                raise GaitshiftError(f"{path}: '{name}' must be a number, got {values[name].dtype}")
            values[name] = kind(np.ravel(values[name])[0])
        values = checked(path, values, {name: types[name] for name in values})
        records = {name: _record(name, made, values) for name, made in _RECORDS.items()}
        own = {name: value for name, value in values.items() if "." not in name}
        return cls(**records, **own)


def _types() -> dict[str, Any]:
    """The types of all entries of a file by name; names of record fields have a prefix."""
    types: dict[str, Any] = {}
    for field in fields(Log):
        made = _RECORDS.get(field.name)
        if made is None:
            types[field.name] = field.type
        else:
            types |= {f"{field.name}.{inner.name}": inner.type for inner in fields(made)}
    return types


def _record(name: str, made: type[Any], values: Mapping[str, Any]) -> Any:
    prefix = f"{name}."
    return made(**{key.removeprefix(prefix): v for key, v in values.items() if prefix in key})


def _read(path: Path, types: Mapping[str, Any]) -> dict[str, Any]:
    """The entries of a file that belong to a log."""
    values: dict[str, Any] = {**arrays_in(path, ("format_version", "qpos", *types))}
    version = values.pop("format_version", np.array(1))
    if version.shape != () or version.dtype.kind not in "iu":
        raise GaitshiftError(f"{path}: 'format_version' must be a whole number, got {version!r}")
    if version == 1 and "qpos" in values:
        raise GaitshiftError(
            f"{path} is a log of gaitshift 0.1, which later versions do not read; write it "
            "anew with the command that made it (demo, record or evaluate --log)"
        )
    if version not in (1, FORMAT_VERSION):
        raise GaitshiftError(
            f"{path} is a log of format {version}; this version reads format {FORMAT_VERSION}"
        )
    values.pop("qpos", None)
    missing = [name for name in types if name not in values and not _is_optional(types[name])]
    if missing:
        raise GaitshiftError(f"{path} is not a gaitshift log: it lacks '{missing[0]}'")
    return values


def _is_optional(annotation: Any) -> bool:
    return type(None) in getattr(annotation, "__args__", ())
