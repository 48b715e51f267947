"""The bytes of the two datagrams between a robot and its controller: layouts, header, checks.

Both are packed little-endian structures that begin with one header and end in a CRC-32 of all
bytes before it. Reals are in double precision, so that a controller behind a socket computes the
bits that it computes inside a simulation. Nothing here has a state or reads a clock.
"""

import zlib
from functools import cache
from math import sqrt
from typing import Any, cast

import numpy as np

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import MOST_GAIN

MAGIC = b"GAIT"
"""First four bytes of every datagram."""

VERSION = 1
"""Increased when an earlier datagram could be misread."""

SENSORS, COMMAND = 1, 2
"""Kinds of datagrams: from the robot, and from its controller."""

HAS_VELOCITY, HAS_FORCE, HAS_HEADING, IS_STOPPED = 1, 2, 4, 8
"""Flags of sensors: the base velocity, the specific force and the yaw are measured; the robot has
stopped by its own watchdog and follows no command any more."""

IS_STOP, SHOWS_STANCE = 1, 2
"""Flags of a command: the controller stops, so that silence afterwards is no fault; the contacts
are a stance of the gait."""

NAME_BYTES = 32
"""Longest name of a gait in UTF-8 [bytes]; ours: four times that of the package's."""

MOST_TARGET = 20.0
"""Greatest joint angle or joint target [rad]; ours: that of the simulated world."""

MOST_QUATERNION_ERROR = 0.01
"""Greatest difference of a quaternion's length from 1; ours: that of a log."""

RANGES = {
    "joint_position": MOST_TARGET,
    "joint_velocity": 1000.0,
    "joint_torque": 10_000.0,
    "foot_position_b": 10.0,
    "orientation": 1.0 + MOST_QUATERNION_ERROR,
    "angular_velocity_b": 1000.0,
    "specific_force_b": 10_000.0,
    "velocity_b": 1000.0,
    "target": MOST_TARGET,
    "kp": MOST_GAIN,
    "kd": MOST_GAIN,
    "k": 1e30,
    "threshold": 1e30,
    "forward_speed": 1000.0,
    "yaw_rate": 1000.0,
    "stride_frequency": 1000.0,
    "lateral_speed": 1000.0,
    "body_height": 10.0,
}
"""Greatest magnitude of each real number [its unit]; ours: beyond what any robot that walks shows,
and what a simulated one can show before it counts as diverged."""

_MAY_BE_NAN = ("k", "threshold")
"""Numbers of a statistic, which may be unknown."""

_HEADER = [
    ("magic", "S4"),
    ("version", "u1"),
    ("kind", "u1"),
    ("flags", "<u2"),
    ("sequence", "<u8"),
    ("stamp", "<u8"),
]
_END = [("crc", "<u4")]

SENSORS_LAYOUT = np.dtype(
    [
        *_HEADER,
        ("acknowledged", "<u8"),
        ("contact", "u1", 4),
        ("joint_position", "<f8", 12),
        ("joint_velocity", "<f8", 12),
        ("joint_torque", "<f8", 12),
        ("foot_position_b", "<f8", (4, 3)),
        ("orientation", "<f8", 4),
        ("angular_velocity_b", "<f8", 3),
        ("specific_force_b", "<f8", 3),
        ("velocity_b", "<f8", 3),
        *_END,
    ]
)
"""What the robot sends. Without their flag, the last two vectors are 0."""

COMMAND_LAYOUT = np.dtype(
    [
        *_HEADER,
        ("answered", "<u8"),
        ("target", "<f8", 12),
        ("kp", "<f8"),
        ("kd", "<f8"),
        ("gait", f"S{NAME_BYTES}"),
        ("machine_state", "u1"),
        ("k", "<f8"),
        ("threshold", "<f8"),
        ("forward_speed", "<f8"),
        ("yaw_rate", "<f8"),
        ("stride_frequency", "<f8"),
        ("lateral_speed", "<f8"),
        ("body_height", "<f8"),
        *_END,
    ]
)
"""What the controller sends. All from `gait` on is for the robot's log alone."""


class Malformed(Exception):  # noqa: N818, a datagram that is malformed is no error of the program
    """Bytes are no datagram of this kind, or one of its fields is out of range."""


def blank(layout: np.dtype[Any], kind: int, sequence: int, stamp: int) -> Any:
    """A record of this layout with its header, all other fields 0."""
    record: Any = np.zeros((), layout)
    record["magic"], record["version"], record["kind"] = MAGIC, VERSION, kind
    record["sequence"], record["stamp"] = sequence, stamp
    return record


def sealed(record: Any) -> bytes:
    """The bytes of a record with its CRC; `GaitshiftError` where a number is out of range."""
    name = _wrong(record)
    if name is not None:
        raise GaitshiftError(
            f"'{name}' of a datagram must be {-RANGES[name]:g} to {RANGES[name]:g}, got "
            f"{np.ravel(record[name]).tolist()}"
        )
    record["crc"] = zlib.crc32(record.tobytes()[:-4])
    return record.tobytes()


def opened(data: bytes, layout: np.dtype[Any], kind: int) -> Any:
    """The record in a datagram, its header, CRC and numbers checked."""
    if len(data) != layout.itemsize:
        raise Malformed("length")
    record: Any = np.frombuffer(data, layout)[0]
    if (record["magic"], record["version"], record["kind"]) != (MAGIC, VERSION, kind):
        raise Malformed("header")
    if record["crc"] != zlib.crc32(data[:-4]):
        raise Malformed("crc")
    if record["sequence"] == 0:
        raise Malformed("sequence")
    name = _wrong(record)
    if name is not None:
        raise Malformed(name)
    return record


@cache
def _reals(layout: np.dtype[Any]) -> tuple[tuple[str, ...], np.ndarray, np.ndarray, np.ndarray]:
    """All real numbers of a layout: their names, bytes, greatest magnitudes, and if NaN may be."""
    names, places = list[str](), list[int]()
    for name in layout.names or ():
        if name in RANGES:
            field, offset = cast(Any, layout.fields)[name][:2]
            names += [name] * (field.itemsize // 8)
            places += range(offset, offset + field.itemsize)
    most = np.array([RANGES[name] for name in names])
    return tuple(names), np.array(places), most, np.isin(names, _MAY_BE_NAN)


def _wrong(record: Any) -> str | None:
    """The first number out of range, NaN among them; None where all are in range."""
    names, places, most, may_be_nan = _reals(record.dtype)
    value = np.abs(np.frombuffer(record.tobytes(), np.uint8)[places].view("<f8"))
    is_right = (value <= most) | (np.isnan(value) & may_be_nan)
    if not is_right.all():
        return names[int(is_right.argmin())]
    if "orientation" in record.dtype.names:
        w, x, y, z = record["orientation"].tolist()
        if not abs(sqrt(w * w + x * x + y * y + z * z) - 1.0) <= MOST_QUATERNION_ERROR:
            return "orientation"
    return None
