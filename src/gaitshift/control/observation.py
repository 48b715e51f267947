"""The observation S × U as named slices (paper III-D), and its mirror image.

The paper's S is (u, δ, q, q̇, z, φ, v, ω, f). `PAPER_SLICES` is exactly that; `DEFAULT_SLICES` adds
the command and the last action, which enter the default reward, and the heights at which the feet
last touched, by which a policy can tell rough ground from flat.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Float32, Int

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.robot.command import Command
from gaitshift.robot.legs import MIRRORED_LEGS
from gaitshift.robot.state import Batch, Proprioception


@dataclass(frozen=True, kw_only=True, eq=False)
class GaitState(Batch):
    """Gait state of N robots: the paper's u and δ, the last action and the last touch heights."""

    machine_state: Int[np.ndarray, "*batch"]
    """u, the state of the gait's machine."""
    steps_in_state: Int[np.ndarray, "*batch"]
    """δ, control steps since its last change."""
    last_action: Float[np.ndarray, "*batch 12"]
    """The action that led here, zero after a reset."""
    touch_height: Float[np.ndarray, "*batch 4"]
    """Height of each foot above the base when it last touched, along the vertical [m].

    The paper's h (III-E), by which a policy can tell rough ground from flat."""


class _Instant(NamedTuple):
    """The parts of an observation of N robots at one instant."""

    state: GaitState
    sensed: Proprioception
    command: Command
    stance: Float[np.ndarray, " 12"]


@dataclass(frozen=True)
class _Slice:
    size: int
    read: Callable[[_Instant], np.ndarray]
    mirror: tuple[tuple[int, ...], tuple[int, ...]]
    """Order and signs of the entries as seen in a mirror (left and right changed)."""


_JOINT_ORDER = tuple(3 * leg + joint for leg in MIRRORED_LEGS for joint in range(3))
_JOINT_SIGNS = (-1, 1, 1) * 4
JOINT_MIRROR = (_JOINT_ORDER, _JOINT_SIGNS)
"""Mirror image of a joint vector: legs change sides, hip abduction changes sign."""

STEP_SCALE = 0.05
"""δ is observed in units of 20 control steps, at most 5 units: ours, to keep inputs near 1."""


HEIGHT_SCALE = 10.0
"""Commanded heights and differences of touch heights are observed in units of 10 cm, the latter at
most 4 units: ours."""


def _sensed(s: _Instant, name: str) -> np.ndarray:
    return s.sensed.need(name, "the policy")


def _touch_differences(s: _Instant) -> np.ndarray:
    difference = s.state.touch_height - s.state.touch_height.mean(axis=1, keepdims=True)
    return np.clip(HEIGHT_SCALE * difference, -4.0, 4.0)


def _machine_slice(machine: RewardMachine) -> _Slice:
    count = len(machine.states)
    one_hot = np.eye(count)
    mirrored = machine.mirrored_states() or tuple(range(count))
    return _Slice(count, lambda s: one_hot[s.state.machine_state], (mirrored, (1,) * count))


def _wait_slice(machine: RewardMachine) -> _Slice:
    def read(s: _Instant) -> np.ndarray:
        dwell = machine.dwell_for(s.command.stride)
        return STEP_SCALE * machine.wait(s.state.machine_state, s.state.steps_in_state, dwell)

    return _column(read)


def _column(read: Callable[[_Instant], np.ndarray], sign: int = 1) -> _Slice:
    return _Slice(1, lambda s: read(s)[:, None], ((0,), (sign,)))


_COMMANDS: dict[str, tuple[Callable[[Command], np.ndarray], int]] = {
    "forward_speed_command": (lambda command: command.forward_speed, 1),
    "yaw_rate_command": (lambda command: command.yaw_rate, -1),
    "stride_command": (lambda command: STEP_SCALE * command.stride, 1),
    "lateral_speed_command": (lambda command: command.lateral_speed, -1),
    "body_height_command": (lambda command: HEIGHT_SCALE * command.body_height, 1),
}
"""Slices that are parts of the command, and their signs as seen in a mirror."""


def _commanded(read: Callable[[Command], np.ndarray], sign: int) -> _Slice:
    return _column(lambda s: read(s.command), sign)


def _vector(read: Callable[[_Instant], np.ndarray], *signs: int) -> _Slice:
    return _Slice(len(signs), read, (tuple(range(len(signs))), signs))


_SLICES: dict[str, _Slice] = {
    "steps_in_state": _column(lambda s: np.minimum(STEP_SCALE * s.state.steps_in_state, 5.0)),
    "joint_position": _Slice(12, lambda s: _sensed(s, "joint_position") - s.stance, JOINT_MIRROR),
    "joint_velocity": _Slice(12, lambda s: 0.1 * _sensed(s, "joint_velocity"), JOINT_MIRROR),
    "base_height": _column(lambda s: s.sensed.base_height),
    "gravity_b": _vector(lambda s: s.sensed.gravity_b, 1, -1, 1),
    "base_linear_velocity_b": _vector(lambda s: _sensed(s, "velocity_b"), 1, -1, 1),
    "base_angular_velocity_b": _vector(lambda s: _sensed(s, "angular_velocity_b"), -1, 1, -1),
    "contact": _Slice(4, lambda s: s.sensed.contact, (MIRRORED_LEGS, (1,) * 4)),
    **{name: _commanded(read, sign) for name, (read, sign) in _COMMANDS.items()},
    "last_action": _Slice(12, lambda s: s.state.last_action, JOINT_MIRROR),
    "touch_height": _Slice(4, _touch_differences, (MIRRORED_LEGS, (1,) * 4)),
}

_MACHINE_SLICES = {"machine_state": _machine_slice, "wait": _wait_slice}
"""Slices that depend on the machine."""

PAPER_SLICES = (
    "machine_state",
    "steps_in_state",
    "joint_position",
    "joint_velocity",
    "base_height",
    "gravity_b",
    "base_linear_velocity_b",
    "base_angular_velocity_b",
    "contact",
)
"""(u, δ, q, q̇, z, φ, v, ω, f); φ is the direction of gravity, which has only roll and pitch."""

DEFAULT_SLICES = (
    *PAPER_SLICES,
    "forward_speed_command",
    "yaw_rate_command",
    "stride_command",
    "wait",
    "last_action",
    "touch_height",
)

FULL_SLICES = (*DEFAULT_SLICES, "lateral_speed_command", "body_height_command")
"""All parts of the command as well, for gaits that take them."""


def check_slices(names: tuple[str, ...]) -> None:
    """`GaitshiftError` unless all names are of slices."""
    known = (*_MACHINE_SLICES, *_SLICES)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise GaitshiftError(
            f"observation slices must be among {', '.join(known)}, got '{unknown[0]}'"
        )


@dataclass(frozen=True)
class Observation:
    """Which slices are observed, in which order, for one machine."""

    machine: RewardMachine
    stance: tuple[float, ...]
    """The robot's default joint angles, relative to which joint positions are observed [rad]."""
    names: tuple[str, ...] = DEFAULT_SLICES

    def __post_init__(self) -> None:
        check_slices(self.names)

    @cached_property
    def _parts(self) -> tuple[_Slice, ...]:
        return tuple(
            _MACHINE_SLICES[n](self.machine) if n in _MACHINE_SLICES else _SLICES[n]
            for n in self.names
        )

    @cached_property
    def slices(self) -> dict[str, slice]:
        """The place of each named slice in the observation vector."""
        ends = np.cumsum([part.size for part in self._parts])
        return {
            name: slice(int(end) - part.size, int(end))
            for name, part, end in zip(self.names, self._parts, ends, strict=True)
        }

    @property
    def size(self) -> int:
        """Length of the observation vector."""
        return sum(part.size for part in self._parts)

    def __call__(
        self, state: GaitState, sensed: Proprioception, command: Command
    ) -> Float32[np.ndarray, "N D"]:
        """The observation of N robots."""
        instant = _Instant(state, sensed, command, self.stance_angles)
        observation = np.empty((len(state.machine_state), self.size), dtype=np.float32)
        for part, where in zip(self._parts, self.slices.values(), strict=True):
            observation[:, where] = part.read(instant)
        return observation

    def of_commands(self, command: Command) -> dict[int, Float[np.ndarray, " N"]]:
        """The entries that are parts of the command, by their places in the vector."""
        return {
            where.start: _COMMANDS[name][0](command)
            for name, where in self.slices.items()
            if name in _COMMANDS
        }

    @cached_property
    def stance_angles(self) -> Float[np.ndarray, " 12"]:
        """`stance` as an array [rad]."""
        return np.array(self.stance)

    @cached_property
    def mirror(self) -> tuple[Int[np.ndarray, " D"], Float32[np.ndarray, " D"]]:
        """Order and signs such that `signs * observation[:, order]` is the mirror image."""
        order = [
            where.start + index
            for part, where in zip(self._parts, self.slices.values(), strict=True)
            for index in part.mirror[0]
        ]
        signs = [sign for part in self._parts for sign in part.mirror[1]]
        return np.array(order), np.array(signs, dtype=np.float32)
