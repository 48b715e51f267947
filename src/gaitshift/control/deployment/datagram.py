"""The two datagrams between a robot and its controller: their layout, encoding and decoding.

Both are packed little-endian structures that begin with one header and end in a CRC-32 of all
bytes before it. Reals are in double precision, so that a controller behind a socket computes the
bits that it computes inside a simulation. Nothing here has a state or reads a clock.
"""

import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import MOST_GAIN
from gaitshift.robot.state import Proprioception

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
        *_END,
    ]
)
"""What the controller sends. All from `gait` on is for the robot's log alone."""

_SENSED = (
    *("joint_position", "joint_velocity", "joint_torque"),
    *("foot_position_b", "orientation", "angular_velocity_b"),
)
_OPTIONAL = {"velocity_b": HAS_VELOCITY, "specific_force_b": HAS_FORCE}
_COMMANDED = ("k", "threshold", "forward_speed", "yaw_rate", "stride_frequency")


class Malformed(Exception):  # noqa: N818, a datagram that is malformed is no error of the program
    """Bytes are no datagram of this kind, or one of its fields is out of range."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Sensors:
    """What a robot measured at the end of a control step."""

    sequence: int
    """Number of the datagram, from 1 on; 0 stands for none."""
    stamp: int
    """The robot's clock, from any origin [ns]."""
    acknowledged: int
    """Sequence of the command that the robot followed in this step; 0: none."""
    sensed: Proprioception
    """The measurements of one robot, without time and commands."""
    is_stopped: bool = False
    """Whether the robot has stopped by its own watchdog."""


@dataclass(frozen=True, kw_only=True)
class Decision:
    """What the controller decided on the sensors that it answers, for the log of the robot."""

    gait: str
    """Name of the gait that acts next."""
    machine_state: int
    """State of that gait's machine."""
    stance_shown: bool
    """Whether the contacts are a stance of that gait."""
    k: float
    """The shift condition's counter [counts]."""
    threshold: float
    """Its β [counts]."""
    forward_speed: float
    """Speed that was commanded in the step that ended [m/s]."""
    yaw_rate: float
    """Yaw rate that was commanded [rad/s]."""
    stride_frequency: float
    """Stride frequency that was commanded [Hz]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Command:
    """Joint targets for the next control step: torque = kp · (target - q) - kd · q̇."""

    sequence: int
    """Number of the datagram, from 1 on."""
    stamp: int
    """The controller's clock, from any origin [ns]."""
    answered: int
    """Sequence of the sensors that it answers."""
    target: Float[np.ndarray, " 12"]
    """Joint targets [rad]."""
    kp: float
    """[N·m/rad]"""
    kd: float
    """[N·m·s/rad]"""
    is_stop: bool
    """Whether it belongs to a stop, after which there are no more commands."""
    decision: Decision
    """For the log."""


def encode_sensors(sensors: Sensors) -> bytes:
    """The datagram; `GaitshiftError` where a signal is missing or out of range."""
    sensed = sensors.sensed
    record = _record(SENSORS_LAYOUT, SENSORS, sensors.sequence, sensors.stamp)
    record["acknowledged"] = sensors.acknowledged
    record["contact"] = sensed.contact[0]
    for name in _SENSED:
        record[name] = sensed.need(name, "a datagram of sensors")[0]
    flags = HAS_HEADING * sensed.has_heading + IS_STOPPED * sensors.is_stopped
    for name, flag in _OPTIONAL.items():
        value = getattr(sensed, name)
        if value is not None:
            record[name], flags = value[0], flags + flag
    record["flags"] = flags
    return _sealed(record)


def decode_sensors(data: bytes) -> Sensors:
    """The inverse of `encode_sensors`.

    Raises:
        Malformed: it is no such datagram.
    """
    record = _opened(data, SENSORS_LAYOUT, SENSORS)
    flags = int(record["flags"])
    contact = np.array(record["contact"])
    if flags > HAS_VELOCITY + HAS_FORCE + HAS_HEADING + IS_STOPPED or contact.max() > 1:
        raise Malformed("flags or contacts")
    given: dict[str, Any] = {name: np.array(record[name])[None] for name in _SENSED}
    given |= {n: np.array(record[n])[None] for n, flag in _OPTIONAL.items() if flags & flag}
    sensed = Proprioception(
        contact=contact[None] == 1, has_heading=bool(flags & HAS_HEADING), **given
    )
    return Sensors(
        sequence=int(record["sequence"]),
        stamp=int(record["stamp"]),
        acknowledged=int(record["acknowledged"]),
        sensed=sensed,
        is_stopped=bool(flags & IS_STOPPED),
    )


def encode_command(command: Command) -> bytes:
    """The datagram; `GaitshiftError` where a number is out of range, or a name is too long."""
    decision = command.decision
    record = _record(COMMAND_LAYOUT, COMMAND, command.sequence, command.stamp)
    record["flags"] = IS_STOP * command.is_stop + SHOWS_STANCE * decision.stance_shown
    record["answered"], record["target"] = command.answered, command.target
    record["kp"], record["kd"] = command.kp, command.kd
    record["gait"] = gait_bytes(decision.gait)
    record["machine_state"] = decision.machine_state
    for name in _COMMANDED:
        record[name] = getattr(decision, name)
    return _sealed(record)


def decode_command(data: bytes) -> Command:
    """The inverse of `encode_command`.

    Raises:
        Malformed: it is no such datagram.
    """
    record = _opened(data, COMMAND_LAYOUT, COMMAND)
    flags = int(record["flags"])
    if flags > IS_STOP + SHOWS_STANCE or record["kp"] < 0 or record["kd"] < 0:
        raise Malformed("flags or gains")
    try:
        gait = bytes(record["gait"]).decode()
    except UnicodeDecodeError:
        raise Malformed("gait") from None
    if not gait.isprintable():
        raise Malformed("gait")
    return Command(
        sequence=int(record["sequence"]),
        stamp=int(record["stamp"]),
        answered=int(record["answered"]),
        target=np.array(record["target"]),
        kp=float(record["kp"]),
        kd=float(record["kd"]),
        is_stop=bool(flags & IS_STOP),
        decision=Decision(
            gait=gait,
            machine_state=int(record["machine_state"]),
            stance_shown=bool(flags & SHOWS_STANCE),
            **{name: float(record[name]) for name in _COMMANDED},
        ),
    )


def gait_bytes(gait: str) -> bytes:
    """The name of a gait as it is sent; `GaitshiftError` where it is too long."""
    name = gait.encode()
    if len(name) > NAME_BYTES:
        raise GaitshiftError(
            f"names of gaits must have {NAME_BYTES} bytes or fewer in a datagram, got '{gait}'"
        )
    return name


def _record(layout: np.dtype[Any], kind: int, sequence: int, stamp: int) -> Any:
    record: Any = np.zeros((), layout)
    record["magic"], record["version"], record["kind"] = MAGIC, VERSION, kind
    record["sequence"], record["stamp"] = sequence, stamp
    return record


def _sealed(record: Any) -> bytes:
    """The bytes of a record with its CRC; `GaitshiftError` where a number is out of range."""
    name = _wrong(record)
    if name is not None:
        raise GaitshiftError(
            f"'{name}' of a datagram must be {-RANGES[name]:g} to {RANGES[name]:g}, got "
            f"{np.ravel(record[name]).tolist()}"
        )
    record["crc"] = zlib.crc32(record.tobytes()[:-4])
    return record.tobytes()


def _opened(data: bytes, layout: np.dtype[Any], kind: int) -> Any:
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


def _wrong(record: Any) -> str | None:
    """The first number out of range, NaN among them; None where all are in range."""
    for name in record.dtype.names:
        most = RANGES.get(name)
        if most is None:
            continue
        value: np.ndarray = np.abs(record[name])
        if not ((value <= most) | (np.isnan(value) & (name in _MAY_BE_NAN))).all():
            return name
        if name == "orientation":
            length = float(np.linalg.norm(record[name]))
            if not abs(length - 1.0) <= MOST_QUATERNION_ERROR:
                return name
    return None
