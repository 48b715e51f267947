"""A robot: its model, the names of its feet and joints, its stance, its gains.

Another quadruped is another `Robot` value: its MJCF needs a free joint, twelve position-controlled
joints in the order legs × (HAA, HFE, KFE), and per leg the sensors this module names.
"""

import logging
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, cast

import numpy as np
from jaxtyping import Float

from gaitshift.data import check_text
from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import JOINTS, LEGS
from gaitshift.robot.motor import Motor

if TYPE_CHECKING:
    import mujoco

MOST_GAIN = 100_000.0
"""Greatest gain of a joint [N·m/rad, N·m·s/rad]; ours: a thousand times that of a large robot."""

RANGES = {"foot_radius": (0.001, 1.0), "action_scale": (0.001, 1.0)}
"""Ranges of a robot's numbers [m, rad]; ours: far beyond any robot that walks."""

MOST_STANCE = 2 * np.pi
"""Greatest joint angle of a stance [rad]; ours: with the largest action it is a target that
`World` takes."""

_MODELS = Path(__file__).parent / "models"


@dataclass(frozen=True, kw_only=True)
class Gains:
    """Gains of the joint controllers: torque = kp · (target - q) - kd · q̇."""

    kp: float
    """[N·m/rad]"""
    kd: float
    """[N·m·s/rad]"""

    def __post_init__(self) -> None:
        if not (0 < self.kp <= MOST_GAIN and 0 <= self.kd <= MOST_GAIN):
            raise GaitshiftError(
                f"kp must be above 0 and kd 0 or more, both at most {MOST_GAIN:g}, got "
                f"{self.kp:g} and {self.kd:g}"
            )


@dataclass(frozen=True, kw_only=True)
class Robot:
    """Description of a quadruped."""

    name: str
    """Name in policy files; a policy of another robot is refused."""
    model_file: Path
    """The robot's MJCF, without any ground."""
    stance: tuple[float, ...]
    """Joint angles of the default stance, the paper's q_init (12 values) [rad]."""
    stance_height: float
    """Height of the base origin above level ground in that stance, feet just touching [m]."""
    mass: float
    """Mass of all its bodies [kg]."""
    foot_radius: float
    """Radius of the spherical feet [m]."""
    motor: Motor
    """The motor of each joint."""
    action_scale: float
    """Joint target = stance + action_scale · action [rad]."""
    gains: dict[str, Gains] = field(default_factory=dict[str, Gains])
    """Presets by name; `default` is required."""

    def __post_init__(self) -> None:
        check_text("name", self.name)
        if len(self.stance) != 12:
            raise GaitshiftError(
                f"robot {self.name}: stance must have 12 joint angles, got {len(self.stance)}"
            )
        for angle in self.stance:
            if not abs(angle) <= MOST_STANCE:
                raise GaitshiftError(
                    f"robot {self.name}: angles of the stance must be {-MOST_STANCE:.3g} to "
                    f"{MOST_STANCE:.3g} rad, got {angle:g}"
                )
        for key, (least, most) in RANGES.items():
            value: float = getattr(self, key)
            if not least <= value <= most:
                raise GaitshiftError(
                    f"robot {self.name}: {key} must be {least:g} to {most:g}, got {value:g}"
                )
        if "default" not in self.gains:
            raise GaitshiftError(
                f"robot {self.name}: gains must have a preset 'default', got {list(self.gains)}"
            )

    def check_is(self, name: str, what: str) -> None:
        """`GaitshiftError` if `what` belongs to a robot whose name `name` is not this one's."""
        if name != self.name:
            given = "no" if name == ANYMAL_B.name else "its file as"
            raise GaitshiftError(
                f"{what} is of the robot '{name}', not of '{self.name}'; give {given} --robot-file"
            )

    @property
    def joint_names(self) -> tuple[str, ...]:
        """The twelve joints, in the order of every joint axis of the package."""
        return tuple(f"{leg}_{joint}" for leg in LEGS for joint in JOINTS)

    @property
    def stance_angles(self) -> Float[np.ndarray, " 12"]:
        """`stance` as an array [rad]."""
        return np.array(self.stance)

    def gains_of(self, preset: str) -> Gains:
        """The gains of a preset, or an error that lists the presets."""
        if preset not in self.gains:
            known = ", ".join(self.gains)
            raise GaitshiftError(f"robot {self.name}: gains must be one of {known}, got '{preset}'")
        return self.gains[preset]

    def spec(self, gains: Gains) -> "mujoco.MjSpec":
        """The robot's model with its motors and these gains in their controllers, without a ground.

        MuJoCo is imported only here: a robot that runs policies needs no simulator.
        """
        import mujoco

        if mujoco.get_mju_user_warning() is None:
            # By default MuJoCo writes a file MUJOCO_LOG.TXT into the working directory.
            mujoco.set_mju_user_warning(logging.getLogger("mujoco").info)
        spec = mujoco.MjSpec.from_file(str(self.model_file))
        for actuator in cast("list[mujoco.MjsActuator]", spec.actuators):
            self.motor.drive(actuator, kp=gains.kp, kd=gains.kd)
        for joint in cast("list[mujoco.MjsJoint]", spec.joints):
            if joint.type == mujoco.mjtJoint.mjJNT_HINGE:
                joint.frictionloss += self.motor.friction
                joint.armature += self.motor.armature
        return spec


_HAA, _HFE, _KFE = 0.03, 0.4, 0.8

ANYMAL_B = Robot(
    name="anymal_b",
    model_file=_MODELS / "anymal_b.xml",
    # Stance of the RaiSim examples: knees towards each other, feet a little outside the hips.
    stance=(
        *(_HAA, _HFE, -_KFE),
        *(-_HAA, _HFE, -_KFE),
        *(_HAA, -_HFE, _KFE),
        *(-_HAA, -_HFE, _KFE),
    ),
    stance_height=0.4927,
    mass=30.475396462000006,
    foot_radius=0.031,
    # Peak torque and speed are the URDF's, the torque at rest is that of Isaac Lab's model of the
    # drive. Neither gives a rotor's inertia.
    motor=Motor(torque_limit=80.0, no_load_speed=15.0, stall_torque=120.0),
    action_scale=0.3,
    gains={
        # 80/2 is legged_gym's pair for ANYmal; the paper's 3/0.2 cannot hold 30 kg (docs/paper.md).
        "default": Gains(kp=80.0, kd=2.0),
        "paper": Gains(kp=3.0, kd=0.2),
    },
)
