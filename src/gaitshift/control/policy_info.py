"""The description of a policy in its file, read with checks."""

import json
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, cast

from gaitshift.data import Table, json_of, located
from gaitshift.errors import GaitshiftError

FORMAT_VERSION = 2
"""Increased when a file of an earlier version could be misread."""


@dataclass(frozen=True, kw_only=True)
class PolicyInfo:
    """Description of a policy: all of a policy file except the network."""

    robot: str
    """Name of the robot it was trained for."""
    machine: dict[str, Any]
    """The complete reward machine (`RewardMachine.to_dict`)."""
    observation: dict[str, list[int]]
    """Start and end of each named slice of the observation."""
    action_scale: float
    """Joint target = stance + action_scale · action [rad]."""
    stance: list[float]
    """The robot's default joint angles [rad]."""
    gains: str
    """Preset of the robot's joint gains."""
    kp: float
    """[N·m/rad]"""
    kd: float
    """[N·m·s/rad]"""
    control_rate: float
    """Control steps a second [Hz]."""
    forward_speed: float
    """Nominal forward speed [m/s]."""
    speed_range: list[float]
    """Least and greatest forward speed that it was trained for [m/s]."""
    stride_frequency: float
    """Nominal stride frequency [Hz]."""
    stride_frequency_range: list[float]
    """Least and greatest stride frequency that it was trained for [Hz]."""
    training: dict[str, Any]
    """Command, seed, versions and figures of the training that made it."""
    lateral_speed: float = 0.0
    """Greatest lateral speed that it was trained for, to either side [m/s]."""
    body_height: float = 0.0
    """Nominal height of the body, from that of the stance [m]."""
    height_range: list[float] = field(default_factory=lambda: [0.0, 0.0])
    """Least and greatest body height that it was trained for, from that of the stance [m]."""
    format_version: int = FORMAT_VERSION

    def to_metadata(self) -> dict[str, str]:
        """As ONNX metadata: every value as JSON text."""
        return {f"gaitshift.{key}": json.dumps(value) for key, value in vars(self).items()}


_NAMES = tuple(PolicyInfo.__dataclass_fields__)
_ADDED: dict[str, object] = {
    "lateral_speed": 0.0,
    "body_height": 0.0,
    "height_range": [0.0, 0.0],
}
"""Values of files that were written before there were such commands."""


def read_info(path: Path, metadata: dict[str, str]) -> PolicyInfo:
    """The description in an ONNX file's metadata, each value of its type and size.

    Raises:
        GaitshiftError: the file is not a gaitshift policy, has another version, or lacks a value or
            has a wrong one.
    """
    version = metadata.get("gaitshift.format_version")
    if version is None:
        raise GaitshiftError(f"{path} is an ONNX file but not a gaitshift policy")
    if version != str(FORMAT_VERSION):
        raise GaitshiftError(
            f"{path}: format version must be {FORMAT_VERSION}, got {version}; export the policy "
            "with this version of gaitshift"
        )
    names = [name for name in _NAMES if f"gaitshift.{name}" in metadata]
    missing = [name for name in _NAMES if name not in (*names, *_ADDED)]
    if missing:
        raise GaitshiftError(
            f"{path} lacks the metadata '{missing[0]}'; export it again from its run"
        )
    try:
        return _info_of({name: _value(name, metadata[f"gaitshift.{name}"]) for name in names})
    except GaitshiftError as error:
        raise GaitshiftError(f"{path}: metadata {error}; export it again from its run") from error


def _value(name: str, text: str) -> object:
    with located(f"'{name}'"):
        return json_of(text)


def _info_of(values: dict[str, object]) -> PolicyInfo:
    """The description in plain data, each value of its type and size.

    Raises:
        GaitshiftError: a value has a wrong type or size; the message names its key.
    """
    read = Table(_ADDED | values, keys=_NAMES)
    info = PolicyInfo(
        robot=read.text("robot"),
        machine=_table(values, "machine"),
        observation={
            name: _ends(name, ends) for name, ends in _table(values, "observation").items()
        },
        action_scale=_above_0(read, "action_scale"),
        stance=_angles(read, "stance"),
        gains=read.text("gains"),
        kp=read.number("kp"),
        kd=read.number("kd"),
        control_rate=_above_0(read, "control_rate"),
        forward_speed=_from_0(read, "forward_speed"),
        speed_range=_range(read, "speed_range"),
        stride_frequency=_above_0(read, "stride_frequency"),
        stride_frequency_range=_range(read, "stride_frequency_range"),
        training=_table(values, "training"),
        lateral_speed=read.number("lateral_speed"),
        body_height=read.number("body_height"),
        height_range=list(read.numbers("height_range", 2, "two numbers, such as [-0.1, 0.0]")),
        format_version=read.whole("format_version"),
    )
    if info.stride_frequency_range[0] == 0:
        raise GaitshiftError("'stride_frequency_range' must begin above 0, got 0")
    return info


def _table(values: dict[str, object], key: str) -> dict[str, Any]:
    value = values[key]
    if not isinstance(value, dict):
        raise GaitshiftError(f"{key!r} must be a table of keys and values, got {shortened(value)}")
    return cast("dict[str, Any]", value)


def _ends(name: str, ends: object) -> list[int]:
    whole: list[int] = []
    if isinstance(ends, list):
        whole = [end for end in cast("list[object]", ends) if type(end) is int]
    if len(whole) != 2 or ends != whole:
        shown = shortened(cast(object, ends))
        raise GaitshiftError(f"'observation' must give {name!r} a start and an end, got {shown}")
    return whole


def _above_0(read: Table, key: str) -> float:
    value = read.number(key)
    if not 0 < value < inf:
        raise GaitshiftError(f"{key!r} must be a finite number above 0, got {value:g}")
    return value


def _from_0(read: Table, key: str) -> float:
    value = read.number(key)
    if not 0 <= value < inf:
        raise GaitshiftError(f"{key!r} must be a finite number from 0 up, got {value:g}")
    return value


def _angles(read: Table, key: str) -> list[float]:
    value = read.get(key)
    count = len(cast("list[object]", value)) if isinstance(value, list) else 12
    return list(read.numbers(key, count, "the angles of 12 joints"))


def _range(read: Table, key: str) -> list[float]:
    low, high = read.numbers(key, 2, "two numbers, such as [0.4, 1.6]")
    if not 0 <= low <= high < inf:
        raise GaitshiftError(
            f"{key!r} must be two finite, rising numbers from 0 up, got {low:g} to {high:g}"
        )
    return [low, high]
