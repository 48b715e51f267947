"""One robot on its ground, in a PyBullet client of its own."""

import ctypes
import os
import sys
import weakref
from collections.abc import Generator
from contextlib import contextmanager
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import JOINTS, LEGS
from gaitshift.robot.state import GRAVITY
from gaitshift.robot.urdf import LEGS_BY_URDF
from gaitshift.sim.bullet.ground import add_ground
from gaitshift.sim.simulator import FRICTION
from gaitshift.sim.terrain import Terrain

PHYSICS_STEP = 0.0025
"""Time step [s]; that of the robot's MuJoCo model."""

EXTRA = "pip install 'gaitshift[sim2sim]'"
"""What installs PyBullet and the URDF."""

_TRUNK = ("base", "base_inertia", "imu_link")
"""Links of the base: their contacts are contacts of the body."""


class Motion(NamedTuple):
    """Where a robot's base is and how it moves."""

    position_w: Float[np.ndarray, " 3"]
    """Of the base origin [m]."""
    quaternion: Float[np.ndarray, " 4"]
    """Body to world (x, y, z, w), as PyBullet has it."""
    velocity_w: Float[np.ndarray, " 3"]
    """Of the base origin [m/s]."""
    angular_velocity_w: Float[np.ndarray, " 3"]
    """[rad/s]"""


class Feet(NamedTuple):
    """The centres of the four spheres."""

    position_w: Float[np.ndarray, "4 3"]
    """[m]"""
    velocity_w: Float[np.ndarray, "4 3"]
    """[m/s]"""


class Body:
    """A robot's URDF on a terrain, without PyBullet's joint motors and damping.

    The base link weighs 1 mg and has no centre of mass of its own, so PyBullet's frame of the base,
    which is that of its principal inertia, is the link's. Fixed links stay apart: merging loses the
    origins of their inertias. Inertias are those of the file, which PyBullet ignores by default.
    """

    def __init__(self, urdf: Path, terrain: Terrain) -> None:
        if not find_spec("pybullet"):
            raise GaitshiftError(f"the simulator 'pybullet' is not installed: {EXTRA}")
        self._bullet: Any = import_module("pybullet")
        bullet = self._bullet
        self.client = client = int(bullet.connect(bullet.DIRECT))
        """Its number."""
        if client < 0:
            raise GaitshiftError("PyBullet gives no further client; run fewer robots at once")
        weakref.finalize(self, bullet.disconnect, physicsClientId=client)
        bullet.setTimeStep(PHYSICS_STEP, physicsClientId=client)
        bullet.setGravity(0.0, 0.0, -GRAVITY, physicsClientId=client)
        bullet.setPhysicsEngineParameter(deterministicOverlappingPairs=1, physicsClientId=client)
        add_ground(bullet, client, terrain)
        flags = bullet.URDF_USE_INERTIA_FROM_FILE | bullet.URDF_IGNORE_VISUAL_SHAPES
        with _quiet():  # it names the base link, whose inertia is not physical, on stdout
            self._robot = bullet.loadURDF(str(urdf), flags=flags, physicsClientId=client)
        self._of_robot = {"bodyUniqueId": self._robot, "physicsClientId": client}
        self._name_links()
        self._free()

    def _name_links(self) -> None:
        """Finds joints and feet in the package's order."""
        infos = [
            self._bullet.getJointInfo(self._robot, joint, physicsClientId=self.client)
            for joint in range(self._bullet.getNumJoints(**self._of_robot))
        ]
        joints = {info[1].decode(): int(info[0]) for info in infos}
        links = {info[12].decode(): int(info[0]) for info in infos}
        urdf_legs = {ours: urdf for urdf, ours in LEGS_BY_URDF.items()}
        self._joints = [joints[f"{urdf_legs[leg]}_{joint}"] for leg in LEGS for joint in JOINTS]
        self._feet = [links[f"{urdf_legs[leg]}_FOOT"] for leg in LEGS]
        self._trunk = {-1} | {links[name] for name in _TRUNK if name in links}
        self._links = [-1, *links.values()]
        shapes = [
            self._bullet.getCollisionShapeData(self._robot, foot, physicsClientId=self.client)
            for foot in self._feet
        ]
        self._spheres = np.array([shape[0][5] for shape in shapes])
        """Centre of each foot's sphere in the frame of its link [m]."""

    def _free(self) -> None:
        """Sets the friction, and switches off the joint motors and all damping."""
        for link in self._links:
            self._bullet.changeDynamics(
                linkIndex=link,
                lateralFriction=FRICTION,
                linearDamping=0.0,
                angularDamping=0.0,
                jointDamping=0.0,
                **self._of_robot,
            )
        self._bullet.setJointMotorControlArray(
            jointIndices=self._joints,
            controlMode=self._bullet.VELOCITY_CONTROL,
            forces=[0.0] * len(self._joints),
            **self._of_robot,
        )

    def put(
        self,
        motion: Motion,
        joint_position: Float[np.ndarray, " 12"],
        joint_velocity: Float[np.ndarray, " 12"],
    ) -> None:
        """Puts the robot into this state: rad, rad/s."""
        self._bullet.resetBasePositionAndOrientation(
            posObj=motion.position_w.tolist(),
            ornObj=motion.quaternion.tolist(),
            **self._of_robot,
        )
        robot, client = self._robot, self.client
        self._bullet.resetBaseVelocity(
            robot,
            motion.velocity_w.tolist(),
            motion.angular_velocity_w.tolist(),
            physicsClientId=client,
        )
        states = zip(self._joints, joint_position.tolist(), joint_velocity.tolist(), strict=True)
        for joint, position, velocity in states:
            self._bullet.resetJointState(robot, joint, position, velocity, physicsClientId=client)

    def advance(self, torque: Float[np.ndarray, " 12"], force_w: Float[np.ndarray, " 3"]) -> None:
        """One step of the physics with these joint torques [N·m] and this force [N].

        The force acts on the base origin, in the world frame.
        """
        self._bullet.setJointMotorControlArray(
            jointIndices=self._joints,
            controlMode=self._bullet.TORQUE_CONTROL,
            forces=torque.tolist(),
            **self._of_robot,
        )
        if force_w.any():
            self._bullet.applyExternalForce(
                self._robot,
                -1,
                force_w.tolist(),
                self.motion().position_w.tolist(),
                self._bullet.WORLD_FRAME,
                physicsClientId=self.client,
            )
        self._bullet.stepSimulation(physicsClientId=self.client)

    def joints(self) -> Float[np.ndarray, "2 12"]:
        """Joint angles [rad] and velocities [rad/s]."""
        states = self._bullet.getJointStates(jointIndices=self._joints, **self._of_robot)
        return np.array([[state[0] for state in states], [state[1] for state in states]])

    def motion(self) -> Motion:
        """Of the base."""
        position, quaternion = self._bullet.getBasePositionAndOrientation(**self._of_robot)
        linear, angular = self._bullet.getBaseVelocity(**self._of_robot)
        return Motion(*(np.array(part) for part in (position, quaternion, linear, angular)))

    def feet(self) -> Feet:
        """The spheres of the present pose."""
        states = self._bullet.getLinkStates(
            linkIndices=self._feet,
            computeLinkVelocity=1,
            computeForwardKinematics=1,
            **self._of_robot,
        )
        position, linear, angular = (np.array([state[i] for state in states]) for i in (0, 6, 7))
        matrix = self._bullet.getMatrixFromQuaternion
        turns = np.array([matrix(state[1]) for state in states]).reshape(4, 3, 3)
        offset = np.einsum("fij,fj->fi", turns, self._spheres)
        return Feet(position + offset, linear + np.cross(angular, offset))

    def contacts(self) -> tuple[Float[np.ndarray, " 4"], bool]:
        """Summed normal force on each foot in the last physics step [N]; whether the base touches.

        PyBullet also lists points without force, which touch nothing.
        """
        force = dict.fromkeys(self._links, 0.0)
        points = self._bullet.getContactPoints(bodyA=self._robot, physicsClientId=self.client)
        for point in points:
            force[point[3]] += point[9]
        on_feet = np.array([force[foot] for foot in self._feet])
        return on_feet, any(force[link] > 0.0 for link in self._trunk)


@contextmanager
def _quiet() -> Generator[None]:
    """Without what C code writes to stdout, which is for results."""
    sys.stdout.flush()
    libc = ctypes.CDLL(None) if os.name == "posix" else ctypes.CDLL("msvcrt")
    kept, nothing = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    libc.fflush(None)
    try:
        os.dup2(nothing, 1)
        yield
    finally:
        libc.fflush(None)  # what C still holds
        os.dup2(kept, 1)
        os.close(kept)
        os.close(nothing)
