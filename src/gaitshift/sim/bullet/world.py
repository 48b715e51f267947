"""N robots in PyBullet, one after the other: joint targets in, proprioception and truth out."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from jaxtyping import Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.state import Privileged, Proprioception, rotation_of, turned
from gaitshift.robot.urdf import urdf_of
from gaitshift.sim.bullet.body import EXTRA, PHYSICS_STEP, Body, Motion
from gaitshift.sim.hardware import Hardware
from gaitshift.sim.limits import (
    MOST_ANGLE,
    MOST_DISTANCE,
    MOST_FORCE,
    MOST_YAW,
    check_within,
)
from gaitshift.sim.measurement import POSE, TWIST, Feet, measured
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.terrain import Fields, Terrain

FASTEST = 99.0
"""Greatest velocity of a base or joint [m/s, rad/s]; PyBullet itself holds them below 100."""

MOST_ROBOTS = 256
"""Most robots of a world; ours: each has a client of its own, which takes 45 MB."""


class BulletWorld:
    """N robots, each alone on its terrain, as in `gaitshift.sim.world.World`.

    The torque of each physics step is kp (target - q) - kd q̇ within the limits of the motor, at the
    state before that step. Forces and torques in `sensed` and `truth` are those of the last physics
    step; after `place` there are none until the next step.
    """

    def __init__(
        self,
        robot: Robot,
        terrain: Terrain | Sequence[Terrain],
        n: int,
        *,
        gains: str = "default",
        sensors: SensorConfig = PERFECT,
        seed: int = 0,
    ) -> None:
        """Builds the world with all robots in their stance at the origin.

        Args:
            robot: whose public URDF is simulated.
            terrain: one for all robots, or several among which they are divided.
            n: number of robots.
            gains: preset of joint gains in `robot.gains`.
            sensors: errors of the sensors and of the link to the joints.
            seed: of these errors.

        Raises:
            GaitshiftError: PyBullet or the URDF is not installed, the robot is another than ANYmal
                B, or there are too many.
        """
        if not 1 <= n <= MOST_ROBOTS:
            raise GaitshiftError(f"robots in PyBullet must be 1 to {MOST_ROBOTS}, got {n}")
        self.robot, self.n = robot, n
        terrains = (terrain,) if isinstance(terrain, Terrain) else tuple(terrain)
        if not terrains:
            raise GaitshiftError("there must be at least one terrain, got none")
        self.terrains: tuple[Terrain, ...] = terrains[:n]
        self._fields = Fields(self.terrains, n)
        self._gains = robot.gains_of(gains)
        urdf = _urdf(robot)
        self._bodies = [Body(urdf, self.terrains[i % len(self.terrains)]) for i in range(n)]
        self._hardware = Hardware(sensors, robot, n, seed=seed)
        self._hardware.run_at(PHYSICS_STEP)
        self._force_w = np.zeros((n, 3))
        self._torque = np.zeros((n, 12))
        self._angles, self._speeds = np.zeros((n, 12)), np.zeros((n, 12))
        self._foot_force, self._touches = np.zeros((n, 4)), np.zeros(n, dtype=bool)
        self.place(np.arange(n), xy=np.zeros((n, 2)), yaw=np.zeros(n))

    def place(
        self,
        ids: Int[np.ndarray, " K"],
        *,
        xy: Float[np.ndarray, "K 2"],
        yaw: Float[np.ndarray, " K"],
        joint_position: Float[np.ndarray, "K 12"] | None = None,
        joint_velocity: Float[np.ndarray, "K 12"] | None = None,
        base_velocity_w: Float[np.ndarray, "K 3"] | None = None,
        base_angular_velocity_b: Float[np.ndarray, "K 3"] | None = None,
    ) -> None:
        """Sets robots down upright with the lowest foot on the ground, at rest in their stance.

        Args:
            ids: which, in rising order.
            xy: of the base [m].
            yaw: that the base is turned by [rad].
            joint_position: [rad]; the stance if not given.
            joint_velocity: [rad/s]; 0 if not given, as are the velocities of the base.
            base_velocity_w: [m/s].
            base_angular_velocity_b: [rad/s].

        Raises:
            GaitshiftError: a value is outside its range; the state is then unchanged.
        """
        check_within("xy of robots", "m", xy, MOST_DISTANCE, ids)
        check_within("yaw of robots", "rad", yaw, MOST_YAW, ids)
        count = len(ids)
        stance = np.tile(self.robot.stance_angles, (count, 1))
        angles = stance if joint_position is None else joint_position
        check_within("joint positions", "rad", angles, MOST_ANGLE, ids)
        still = np.zeros((count, 3))
        speeds = np.zeros((count, 12)) if joint_velocity is None else joint_velocity
        velocity = still if base_velocity_w is None else base_velocity_w
        turning = still if base_angular_velocity_b is None else base_angular_velocity_b
        for values in (speeds, velocity, turning):
            check_within("velocities", "m/s or rad/s", values, FASTEST, ids)
        quaternion = turned(np.tile((1.0, 0.0, 0.0, 0.0), (count, 1)), yaw)
        turning_w = np.einsum("kij,kj->ki", rotation_of(quaternion), turning)
        for row, robot in enumerate(ids.tolist()):
            motion = Motion(
                np.array([*xy[row], 0.0]),
                np.roll(quaternion[row], -1),
                velocity[row],
                turning_w[row],
            )
            self._set_down(robot, motion, angles[row], speeds[row])
        self._angles[ids], self._speeds[ids] = angles, speeds
        self._force_w[ids], self._torque[ids] = 0.0, 0.0
        self._foot_force[ids], self._touches[ids] = 0.0, False
        ideal = self._measure()
        self.sensed = self._hardware.restart(ids, ideal, self.truth, angles)

    def push(self, force_w: Float[np.ndarray, "N 3"]) -> None:
        """Forces on the base origins, world frame [N], until the next call or `place`.

        Raises:
            GaitshiftError: a force is outside ± `MOST_FORCE`; the state is then unchanged.
        """
        check_within("forces", "N", force_w, MOST_FORCE)
        self._force_w[:] = force_w

    def step(self, target: Float[np.ndarray, "N 12"]) -> tuple[Proprioception, Privileged]:
        """One control step of 10 ms in which the joints are driven to `target` [rad].

        Returns `sensed` and `truth`.

        Raises:
            GaitshiftError: a target is outside ± `MOST_ANGLE`; the state is then unchanged.
        """
        check_within("joint targets", "rad", target, MOST_ANGLE, names=self.robot.joint_names)
        before = self.truth
        for steps, followed in self._hardware.followed(target):
            for _ in range(steps):
                self._advance(followed)
        for i, body in enumerate(self._bodies):
            self._foot_force[i], self._touches[i] = body.contacts()
        ideal = self._measure()
        self.sensed = self._hardware.sense(ideal, self.truth)
        self._restart_diverged(before)
        return self.sensed, self.truth

    def _advance(self, target: Float[np.ndarray, "N 12"]) -> None:
        """One step of the physics in which the joints are driven to `target` [rad]."""
        wanted = self._gains.kp * (target - self._angles) - self._gains.kd * self._speeds
        self._torque = np.clip(wanted, *self.robot.motor.torque_range(self._speeds))
        for i, body in enumerate(self._bodies):
            body.advance(self._torque[i], self._force_w[i])
            self._angles[i], self._speeds[i] = body.joints()

    def _set_down(
        self,
        robot: int,
        motion: Motion,
        angles: Float[np.ndarray, " 12"],
        speeds: Float[np.ndarray, " 12"],
    ) -> None:
        """Puts one robot into this state, moved vertically until its lowest foot is down."""
        body = self._bodies[robot]
        body.put(motion, angles, speeds)
        feet = body.feet().position_w[None]
        ground = self._fields.height_at(feet[..., :2], np.array([robot]))
        below = (feet[..., 2] - self.robot.foot_radius - ground).min()
        position = motion.position_w - np.array([0.0, 0.0, below])
        body.put(motion._replace(position_w=position), angles, speeds)

    def _measure(self) -> Proprioception:
        """Updates `truth`, and gives what perfect sensors show."""
        motions = [body.motion() for body in self._bodies]
        position, quaternion, velocity, turning = map(np.array, zip(*motions, strict=True))
        quaternion = np.roll(quaternion, 1, axis=1)
        feet, foot_velocity = (
            np.array(part) for part in zip(*(body.feet() for body in self._bodies), strict=True)
        )
        feet[..., 2] -= self.robot.foot_radius
        qpos, qvel = np.empty((self.n, POSE + 12)), np.empty((self.n, TWIST + 12))
        qpos[:, :3], qpos[:, 3:POSE], qpos[:, POSE:] = position, quaternion, self._angles
        qvel[:, :3], qvel[:, TWIST:] = velocity, self._speeds
        qvel[:, 3:TWIST] = np.einsum("nij,ni->nj", rotation_of(quaternion), turning)
        self.truth, ideal = measured(
            self.robot,
            self._fields,
            qpos=qpos,
            qvel=qvel,
            torque=self._torque.copy(),
            feet=Feet(feet, foot_velocity, self._foot_force.copy()),
            body_contact=self._touches.copy(),
        )
        self._fastest = np.abs(qvel).max(axis=1)
        return ideal

    def _restart_diverged(self, before: Privileged) -> None:
        """Sets robots down where they were if they are too fast or their state is no number."""
        ids = np.flatnonzero(~(self._fastest <= FASTEST))
        if not ids.size:
            return
        terrains = self.terrains
        for robot in ids.tolist():  # a client whose state is no number stays so
            self._bodies[robot] = Body(_urdf(self.robot), terrains[robot % len(terrains)])
        xy = np.clip(before.base_position_w[ids, :2], -MOST_DISTANCE, MOST_DISTANCE)
        self.place(ids, xy=xy, yaw=before.yaw[ids])
        mask = np.zeros(self.n, dtype=bool)
        mask[ids] = True
        self.truth = replace(self.truth, diverged=mask)


def _urdf(robot: Robot) -> Path:
    """The robot's public URDF, or an error in one line."""
    if robot.name != ANYMAL_B.name:
        raise GaitshiftError(
            f"the simulator 'pybullet' has the robot '{ANYMAL_B.name}' only, got '{robot.name}'"
        )
    urdf = urdf_of(robot)
    if urdf is None:
        raise GaitshiftError(f"the URDF of '{robot.name}' is not installed: {EXTRA}")
    return urdf
