"""State of robots: proprioception, and privileged state that only a simulator knows.

Both records have any number of leading axes: a step of N robots is (N, …), a log of T steps is
(T, N, …), and `log[t]` is a step. Frames: `_w` world (z up), `_b` body (base origin, x forward,
y left, z up). Legs are in the order of `gaitshift.robot.legs.LEGS`, joints are legs × HAA HFE KFE.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cache, cached_property
from typing import Any, ClassVar, Self, cast, get_args

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import COMMAND_PARTS, CONTROL_PERIOD

GRAVITY = 9.81
"""[m/s²]"""

CONTACT_FORCE = 1.0
"""A foot is down when its summed normal force exceeds this [N]; ours: 0.3 % of the weight, and the
value of legged_gym."""


class Batch:
    """A frozen dataclass of arrays that share their leading axes, `*batch` in their shapes.

    Other fields (a time, a name) apply to all entries. Fields may be `Batch`es themselves.
    """

    apart: ClassVar[frozenset[str]] = frozenset()
    """Fields from which no cached property is computed."""

    def __getitem__(self, index: Any) -> Self:
        """Every array at this index of its first axis: one or several steps of a log."""

        def at(trailing: int, array: np.ndarray) -> Any:
            del trailing
            return array[index]

        return self._map(at, also_time=True)

    def robots(self, ids: Int[np.ndarray, " K"] | slice) -> Self:
        """Some of the robots, in the order of `ids`; robots are the last of the leading axes."""

        def chosen(trailing: int, array: np.ndarray) -> np.ndarray:
            axis = array.ndim - trailing - 1
            return array[(*(slice(None),) * axis, ids)]

        return self._map(chosen)

    def with_robots(self, ids: Int[np.ndarray, " K"], part: Self) -> Self:
        """A copy in which the robots `ids` of a step are those of `part`."""
        values = dict[str, Any]()
        for name, trailing in trailing_axes(type(self)).items():
            value = getattr(self, name)
            if isinstance(value, np.ndarray) and trailing is not None:
                values[name] = value.copy()
                values[name][ids] = getattr(part, name)
        return replace(cast(Any, self), **values)

    def having(self, **values: Any) -> Self:
        """A copy with these values of fields; it shares what was computed, where that still holds.

        That is where a field was None before, or where nothing is computed from it (`apart`).
        """
        before = self.__dict__
        holds = all(name in self.apart or before[name] is None for name in values)
        kept = before if holds else {name: before[name] for name in trailing_axes(type(self))}
        copy = object.__new__(type(self))  # `replace` takes ten times as long
        copy.__dict__.update(kept)
        copy.__dict__.update(values)
        return copy

    def as_type(self, precision: type[np.floating[Any]]) -> Self:
        """A copy with all real numbers in this precision."""

        def cast_to(trailing: int, array: np.ndarray) -> np.ndarray:
            del trailing
            return array.astype(precision) if array.dtype.kind == "f" else array

        return self._map(cast_to)

    @classmethod
    def stack(cls, steps: Sequence[Self]) -> Self:
        """Steps stacked along a new first axis."""
        first, values = steps[0], dict[str, Any]()
        for name, trailing in trailing_axes(cls).items():
            rows = [getattr(step, name) for step in steps]
            if isinstance(rows[0], Batch):
                values[name] = type(rows[0]).stack(rows)
            elif rows[0] is not None and (trailing is not None or name == "time"):
                values[name] = np.stack(rows)
        return replace(cast(Any, first), **values)

    def _map(self, change: Callable[[int, np.ndarray], Any], *, also_time: bool = False) -> Self:
        """The record with `change(trailing axes, array)` in place of each of its arrays."""
        changed = object.__new__(type(self))  # `replace` takes three times as long
        for name, trailing in trailing_axes(type(self)).items():
            value: Any = getattr(self, name)
            if trailing is not None and value is not None:
                value = change(trailing, value)
            elif isinstance(value, Batch):
                value = value._map(change, also_time=also_time)
            elif also_time and name == "time" and isinstance(value, np.ndarray):
                time = change(0, cast(Any, value))
                value = time if time.ndim else float(time)
            changed.__dict__[name] = value
        return changed


class Moving(Batch):
    """A record with the velocity of a base, `velocity_b`."""

    def need(self, name: str, by: str) -> Any:
        """The optional field `name`.

        Raises:
            GaitshiftError: the field is None; the message names `by`, which needs it.
        """
        value = getattr(self, name)
        if value is None:
            raise GaitshiftError(f"'{by}' needs '{name}', which is not given")
        return value

    @cached_property
    def forward_speed(self) -> Float[np.ndarray, "*batch"]:
        """Velocity of the base along the body's x axis [m/s]."""
        return self.need("velocity_b", "forward speed")[..., 0]


@cache
def trailing_axes(record: type[Any]) -> dict[str, int | None]:
    """Number of axes of each field of a record after `*batch`; None for other fields."""
    trailing: dict[str, int | None] = {}
    for field in fields(record):
        types: tuple[Any, ...] = (field.type, *get_args(field.type))
        shapes = [str(of.dim_str) for of in types if hasattr(of, "dim_str")]
        axes = shapes[0].split() if shapes else []
        trailing[field.name] = len(axes) - 1 if axes[:1] == ["*batch"] else None
    return trailing


@dataclass(frozen=True, kw_only=True, eq=False)
class Proprioception(Moving):
    """Measurements of robots, from encoders, inertial unit, foot contacts and clock.

    Conditions and policies read only this record. The first three fields are required; the others
    are None where a robot does not measure them, and code that needs one raises an error.
    """

    _commands = tuple(f"{name}_command" for name in COMMAND_PARTS)
    apart = frozenset(("time", "period", "mass", "value", *_commands))

    contact: Bool[np.ndarray, "*batch 4"]
    """Whether each foot is in contact with the ground."""
    foot_position_b: Float[np.ndarray, "*batch 4 3"]
    """The lowest point of each foot relative to the base origin, by kinematics [m]."""
    orientation: Float[np.ndarray, "*batch 4"]
    """Rotation from the body to a level frame, unit quaternion (w, x, y, z)."""
    has_heading: bool = True
    """Whether the yaw of `orientation` is measured; it may have any origin and drift."""
    joint_position: Float[np.ndarray, "*batch 12"] | None = None
    """Joint angles [rad]."""
    joint_velocity: Float[np.ndarray, "*batch 12"] | None = None
    """Joint velocities [rad/s]."""
    joint_torque: Float[np.ndarray, "*batch 12"] | None = None
    """Joint torques [N·m]."""
    velocity_b: Float[np.ndarray, "*batch 3"] | None = None
    """Estimated velocity of the base origin [m/s]."""
    angular_velocity_b: Float[np.ndarray, "*batch 3"] | None = None
    """Angular velocity of the base [rad/s]."""
    specific_force_b: Float[np.ndarray, "*batch 3"] | None = None
    """Acceleration of the base origin less gravity, the mean over the step as an accelerometer
    shows it, in the frame at its middle: (0, 0, 9.81) at rest on level ground [m/s²]."""
    time: Float[np.ndarray, " steps"] | float = 0.0
    """Time since the start [s]."""
    period: float = CONTROL_PERIOD
    """Time of a step [s]."""
    mass: float | None = None
    """Of the robot, by its description [kg]."""
    forward_speed_command: Float[np.ndarray, "*batch"] | None = None
    """Commanded velocity along body x [m/s]."""
    yaw_rate_command: Float[np.ndarray, "*batch"] | None = None
    """Commanded angular velocity about body z [rad/s]."""
    stride_frequency_command: Float[np.ndarray, "*batch"] | None = None
    """Commanded cycles of the gait per second [Hz]."""
    lateral_speed_command: Float[np.ndarray, "*batch"] | None = None
    """Commanded velocity along body y [m/s]."""
    body_height_command: Float[np.ndarray, "*batch"] | None = None
    """Commanded height of the base above that of the robot's stance [m]."""
    value: Float[np.ndarray, "*batch"] | None = None
    """Value of the active policy's critic."""

    @cached_property
    def rotation(self) -> Float[np.ndarray, "*batch 3 3"]:
        """Rotation matrices from the body to the level frame."""
        return rotation_of(self.orientation)

    @cached_property
    def gravity_b(self) -> Float[np.ndarray, "*batch 3"]:
        """Unit vector of the direction of gravity, (0, 0, -1) when level."""
        return -self.rotation[..., 2, :]

    @cached_property
    def yaw(self) -> Float[np.ndarray, "*batch"]:
        """Heading of the body's x axis about the vertical, in (-π, π] [rad]."""
        return np.arctan2(self.rotation[..., 1, 0], self.rotation[..., 0, 0])

    @cached_property
    def power(self) -> Float[np.ndarray, "*batch"]:
        """Mechanical power Σ|τ q̇| over the joints [W]."""
        torque, velocity = (self.need(f"joint_{name}", "power") for name in ("torque", "velocity"))
        return np.abs(torque * velocity).sum(axis=-1)

    @cached_property
    def foot_height(self) -> Float[np.ndarray, "*batch 4"]:
        """Height of each foot's lowest point above the base origin, along the vertical [m].

        It is -p·g, negative below the base, and independent of yaw.
        """
        # Written out, so that one robot gives the same bits alone and in a batch.
        x, y, z = (self.foot_position_b[..., axis] for axis in range(3))
        gx, gy, gz = (self.gravity_b[..., axis, None] for axis in range(3))
        return -(x * gx + y * gy + z * gz)

    @cached_property
    def foot_position_upright(self) -> Float[np.ndarray, "*batch 4 3"]:
        """Feet from the base with z along the vertical, and x, y turned by the yaw [m].

        Where there is no heading, x is the body's heading.
        """
        px, py, pz = (self.foot_position_b[..., axis] for axis in range(3))
        ux, uy, uz = (-self.gravity_b[..., axis, None] for axis in range(3))
        level = np.sqrt(np.maximum(1.0 - ux * ux, 1e-12))  # of the body's x axis in the horizontal
        # Rows of the rotation: the heading, the horizontal to its left, and up.
        x = level * px - ux * (uy * py + uz * pz) / level
        y = (uz * py - uy * pz) / level
        z = ux * px + uy * py + uz * pz
        if self.has_heading:
            c, s = np.cos(self.yaw)[..., None], np.sin(self.yaw)[..., None]
            x, y = c * x - s * y, s * x + c * y
        return np.stack([x, y, z], axis=-1)

    @cached_property
    def base_height(self) -> Float[np.ndarray, "*batch"]:
        """Height of the base origin above the lowest foot [m].

        On level ground with a foot down it is the paper's body height z.
        """
        return -self.foot_height.min(axis=-1)


@dataclass(frozen=True, kw_only=True, eq=False)
class Privileged(Moving):
    """State that only a simulator knows, for the reward, the trials and figures."""

    base_position_w: Float[np.ndarray, "*batch 3"]
    """Base origin [m]."""
    base_quaternion_w: Float[np.ndarray, "*batch 4"]
    """Rotation from body to world, unit quaternion (w, x, y, z)."""
    velocity_b: Float[np.ndarray, "*batch 3"]
    """True velocity of the base origin [m/s]."""
    foot_position_w: Float[np.ndarray, "*batch 4 3"]
    """The lowest point of each foot, which touches level ground first [m]."""
    foot_velocity_w: Float[np.ndarray, "*batch 4 3"]
    """Velocity of each foot's centre [m/s]."""
    foot_force: Float[np.ndarray, "*batch 4"]
    """Normal force on each foot, summed over its contacts, in the last physics step [N]."""
    clearance: Float[np.ndarray, "*batch 4"]
    """Height of each foot's lowest point above the ground under it [m]."""
    body_contact: Bool[np.ndarray, "*batch"]
    """Whether the base touches the ground, which ends an episode in the paper."""
    diverged: Bool[np.ndarray, "*batch"]
    """Whether the simulation diverged in the step that ended here: the robot has failed, and the
    other fields describe it after it was set down again."""

    @cached_property
    def yaw(self) -> Float[np.ndarray, "*batch"]:
        """Heading of the body's x axis about the world's z axis, in (-π, π] [rad]."""
        rotation = rotation_of(self.base_quaternion_w)
        return np.arctan2(rotation[..., 1, 0], rotation[..., 0, 0])

    @cached_property
    def foot_contact(self) -> Bool[np.ndarray, "*batch 4"]:
        """Whether each foot bears on the ground."""
        return self.foot_force > CONTACT_FORCE


def rotation_of(quaternion: Float[np.ndarray, "*batch 4"]) -> Float[np.ndarray, "*batch 3 3"]:
    """Rotation matrices of unit quaternions (w, x, y, z)."""
    w, x, y, z = (quaternion[..., i] for i in range(4))
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz, wx, wy, wz = x * y, x * z, y * z, w * x, w * y, w * z
    rows = (
        (1 - 2 * (yy + zz), 2 * (xy - wz), 2 * (xz + wy)),
        (2 * (xy + wz), 1 - 2 * (xx + zz), 2 * (yz - wx)),
        (2 * (xz - wy), 2 * (yz + wx), 1 - 2 * (xx + yy)),
    )
    rotation = np.empty((*w.shape, 3, 3))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            rotation[..., i, j] = entry
    return rotation


def orientation_of(
    gravity_b: Float[np.ndarray, "*batch 3"], yaw: Float[np.ndarray, "*batch"] | float = 0.0
) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions (w, x, y, z) of bodies with this direction of gravity and this heading.

    `gravity_b` is a unit vector, (0, 0, -1) when level; `yaw` [rad] is about the vertical.
    """
    x, y, z = np.moveaxis(-gravity_b, -1, 0)
    roll, pitch = np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))
    cr, sr, cp, sp = np.cos(roll / 2), np.sin(roll / 2), np.cos(pitch / 2), np.sin(pitch / 2)
    tilt = np.stack((cr * cp, sr * cp, cr * sp, -sr * sp), axis=-1)
    return turned(tilt, np.broadcast_to(yaw, x.shape))


def turned(
    quaternion: Float[np.ndarray, "*batch 4"], yaw: Float[np.ndarray, "*batch"]
) -> Float[np.ndarray, "*batch 4"]:
    """Unit quaternions (w, x, y, z) turned by `yaw` about world z [rad]."""
    w, x, y, z = np.moveaxis(quaternion, -1, 0)
    c, s = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.stack((c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w), axis=-1)
