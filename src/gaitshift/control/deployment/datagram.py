"""The messages of a robot and its controller, and their encoding as datagrams (`layout`)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.control.deployment.layout import (
    COMMAND,
    COMMAND_LAYOUT,
    HAS_FORCE,
    HAS_HEADING,
    HAS_VELOCITY,
    IS_STOP,
    IS_STOPPED,
    NAME_BYTES,
    SENSORS,
    SENSORS_LAYOUT,
    SHOWS_STANCE,
    Malformed,
    blank,
    opened,
    sealed,
)
from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception

_SENSED = (
    *("joint_position", "joint_velocity", "joint_torque"),
    *("foot_position_b", "orientation", "angular_velocity_b"),
)
_OPTIONAL = {"velocity_b": HAS_VELOCITY, "specific_force_b": HAS_FORCE}
_COMMANDED = (
    *("k", "threshold"),
    *("forward_speed", "yaw_rate", "stride_frequency", "lateral_speed", "body_height"),
)


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
    lateral_speed: float = 0.0
    """Lateral speed that was commanded [m/s]."""
    body_height: float = 0.0
    """Body height that was commanded, from that of the stance [m]."""


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
    record = blank(SENSORS_LAYOUT, SENSORS, sensors.sequence, sensors.stamp)
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
    return sealed(record)


def decode_sensors(data: bytes) -> Sensors:
    """The inverse of `encode_sensors`.

    Raises:
        Malformed: it is no such datagram.
    """
    record = opened(data, SENSORS_LAYOUT, SENSORS)
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
    record = blank(COMMAND_LAYOUT, COMMAND, command.sequence, command.stamp)
    record["flags"] = IS_STOP * command.is_stop + SHOWS_STANCE * decision.stance_shown
    record["answered"], record["target"] = command.answered, command.target
    record["kp"], record["kd"] = command.kp, command.kd
    record["gait"] = gait_bytes(decision.gait)
    record["machine_state"] = decision.machine_state
    for name in _COMMANDED:
        record[name] = getattr(decision, name)
    return sealed(record)


def decode_command(data: bytes) -> Command:
    """The inverse of `encode_command`.

    Raises:
        Malformed: it is no such datagram.
    """
    record = opened(data, COMMAND_LAYOUT, COMMAND)
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
