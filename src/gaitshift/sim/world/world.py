"""N robots stepped on all cores: joint targets in, proprioception and privileged state out."""

from collections.abc import Sequence
from dataclasses import replace

import mujoco
import numpy as np
from jaxtyping import Float, Int
from mujoco.batch import Batch

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import Robot
from gaitshift.robot.state import Privileged, Proprioception, turned
from gaitshift.sim.hardware import Hardware
from gaitshift.sim.limits import (
    MOST_ANGLE,
    MOST_DISTANCE,
    MOST_FORCE,
    MOST_YAW,
    check_unit,
    check_within,
)
from gaitshift.sim.measurement import POSE, TWIST, Feet, measured
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.terrain import Fields, Terrain
from gaitshift.sim.world.divergence import DIVERGED, FASTEST, Divergence, History
from gaitshift.sim.world.model import Fidelity, build_model
from gaitshift.sim.world.randomisation import ALIKE, SAME, Models, Randomisation

CLEAR_OF_GROUND = 20.0
"""Height at which robots are posed before they are set on the ground [m]; ours."""


class World:
    """N robots, each alone on its terrain.

    Robots do not interact. With several terrains, robot i stands on terrain i mod K. Nothing moves
    between calls. `sensed` and `truth` always describe the present state, without delay (forces and
    torques are those of the last physics step, which led to this state); `sensed` has the errors of
    the sensors, and what it leads to may be late (`Hardware`); `ideal` is without errors.

    A robot whose simulation diverges is set down in its stance where it was before the step, and
    `truth.diverged` marks it after that step. The first of them are logged by number (`History`).
    """

    def __init__(
        self,
        robot: Robot,
        terrain: Terrain | Sequence[Terrain],
        n: int,
        *,
        gains: str = "default",
        fidelity: Fidelity = "exact",
        randomisation: Randomisation = SAME,
        threads: int = 0,
        sensors: SensorConfig = PERFECT,
        seed: int = 0,
    ) -> None:
        """Builds the world with all robots in their stance at the origin.

        Args:
            robot: whose model is simulated.
            terrain: one for all robots, or several among which they are divided.
            n: number of robots.
            gains: preset of joint gains in `robot.gains`.
            fidelity: of the contacts.
            randomisation: what `redraw` draws anew.
            threads: physics threads, 0 for all cores.
            sensors: errors of the sensors and of the link to the joints.
            seed: of these errors; starts and pushes with the same seed are independent of them.
        """
        if n < 1:
            raise GaitshiftError(f"robots must be 1 or more, got {n}")
        self.robot = robot
        self.n = n
        self._gains = robot.gains_of(gains)
        self._threads = threads
        self._randomisation = randomisation
        self._models: Models | None = None
        self._stance = robot.stance_angles
        self._hardware = Hardware(sensors, robot, n, seed=seed)
        self._history = History(n)
        self.terrains: tuple[Terrain, ...] = ()
        self.set_terrain(terrain, fidelity)
        self.place(np.arange(n), xy=np.zeros((n, 2)), yaw=np.zeros(n))

    def set_terrain(
        self, terrain: Terrain | Sequence[Terrain], fidelity: Fidelity = "exact"
    ) -> None:
        """Replaces the ground and the fidelity of its contacts.

        Robots keep their motion and are moved vertically onto the new ground.
        """
        terrains = (terrain,) if isinstance(terrain, Terrain) else tuple(terrain)
        if not terrains:
            raise GaitshiftError("there must be at least one terrain, got none")
        state = self._kept_state(terrains) if hasattr(self, "_batch") else None
        self.terrains = terrains[: self.n]
        self._fields = Fields(self.terrains, self.n)
        models = [
            build_model(self.robot, self._gains, ground, fidelity) for ground in self.terrains
        ]
        self.model = models[0]
        self._hardware.run_at(self.model.opt.timestep)
        batch = Batch(self.model, self.n, self._threads, True)
        if self._randomisation.varies:
            self._models = Models(models, self.n, self._randomisation, self._models)
            batch.set_models(self._models.each)
        elif len(models) > 1:
            batch.set_models([models[i % len(models)] for i in range(self.n)])
        self._batch = batch
        self._warned: Int[np.ndarray, "N 3"] = batch.warning[:, DIVERGED, 1]
        self._qpos, self._qvel = batch.bind("qpos"), batch.bind("qvel")
        self._ctrl, self._applied = batch.bind("ctrl"), batch.bind("qfrc_applied")
        self._sensordata, self._torque = batch.bind("sensordata"), batch.bind("actuator_force")
        if state is not None:
            self.set_state(*state)

    def redraw(
        self, ids: Int[np.ndarray, " K"], rng: np.random.Generator, share: float = 1.0
    ) -> None:
        """Draws what differs from robot to robot anew for these, without moving them.

        Draws nothing where nothing differs. `share` shrinks the ranges (`Models.draw`).
        """
        if self._models is not None:
            self._models.draw(ids, rng, share)

    @property
    def bodies(self) -> Float[np.ndarray, "N 8"]:
        """What was drawn for each robot, in the order of `Randomisation`."""
        return np.tile(ALIKE, (self.n, 1)) if self._models is None else self._models.drawn.copy()

    def reseed(self, seed: int) -> None:
        """Begins the errors of sensors and link anew with this seed, from the next `place` on."""
        self._hardware.reseed(seed)

    def set_state(self, qpos: Float[np.ndarray, "N 19"], qvel: Float[np.ndarray, "N 18"]) -> None:
        """Puts all robots into these states; joint targets are their present angles.

        Raises:
            GaitshiftError: a value is outside its range; the state is then unchanged.
        """
        check_within("positions", "m or rad", qpos, MOST_DISTANCE)
        check_within("velocities", "m/s or rad/s", qvel, FASTEST)
        self._qpos[:], self._qvel[:] = qpos, qvel
        self._settle(np.arange(self.n))

    def place(
        self,
        ids: Int[np.ndarray, " K"],
        *,
        xy: Float[np.ndarray, "K 2"],
        yaw: Float[np.ndarray, " K"],
        attitude: Float[np.ndarray, "K 4"] | None = None,
        joint_position: Float[np.ndarray, "K 12"] | None = None,
        joint_velocity: Float[np.ndarray, "K 12"] | None = None,
        base_velocity_w: Float[np.ndarray, "K 3"] | None = None,
        base_angular_velocity_b: Float[np.ndarray, "K 3"] | None = None,
    ) -> None:
        """Sets robots down with the lowest foot on the ground, at rest in their stance.

        Args:
            ids: which, in rising order.
            xy: of the base [m].
            yaw: that the base is turned by [rad].
            attitude: before that turn (w, x, y, z); upright if not given.
            joint_position: [rad]; the stance if not given.
            joint_velocity: [rad/s]; 0 if not given, as are the velocities of the base.
            base_velocity_w: [m/s].
            base_angular_velocity_b: [rad/s].

        Raises:
            GaitshiftError: a value is outside its range, or `attitude` is no unit quaternion; the
                state is then unchanged.
        """
        check_within("xy of robots", "m", xy, MOST_DISTANCE, ids)
        check_within("yaw of robots", "rad", yaw, MOST_YAW, ids)
        if joint_position is not None:
            check_within("joint positions", "rad", joint_position, MOST_ANGLE, ids)
        for values in (joint_velocity, base_velocity_w, base_angular_velocity_b):
            if values is not None:
                check_within("velocities", "m/s or rad/s", values, FASTEST, ids)
        if attitude is not None:
            check_unit(attitude, ids)
        qpos = np.zeros((len(ids), POSE + 12))
        qpos[:, :2] = xy
        qpos[:, 2] = CLEAR_OF_GROUND  # until the feet are known, so that nothing is in the ground
        upright = np.tile((1.0, 0.0, 0.0, 0.0), (len(ids), 1))
        qpos[:, 3:POSE] = turned(upright if attitude is None else attitude, yaw)
        qpos[:, POSE:] = self._stance if joint_position is None else joint_position
        self._batch.reset(ids=ids, stage=int(mujoco.mjtStage.mjSTAGE_NONE))
        self._qpos[ids] = qpos
        self._qvel[ids] = 0.0
        for part, given in (
            (slice(0, 3), base_velocity_w),
            (slice(3, TWIST), base_angular_velocity_b),
            (slice(TWIST, None), joint_velocity),
        ):
            if given is not None:
                self._qvel[ids, part] = given
        self._batch.forward(ids=ids, stage=int(mujoco.mjtStage.mjSTAGE_POS))
        feet = self._feet(self._sensordata[ids])
        below = (feet[..., 2] - self._fields.height_at(feet[..., :2], ids)).min(axis=1)
        self._qpos[ids, 2] -= below
        self._settle(ids)

    def push(self, force_w: Float[np.ndarray, "N 3"]) -> None:
        """Forces on the base origins, world frame [N], until the next call or `place`.

        Raises:
            GaitshiftError: a force is outside ± `MOST_FORCE`; the state is then unchanged.
        """
        check_within("forces", "N", force_w, MOST_FORCE)
        self._applied[:, :3] = force_w

    def step(self, target: Float[np.ndarray, "N 12"]) -> tuple[Proprioception, Privileged]:
        """One control step of 10 ms in which the joints are driven to `target` [rad].

        Returns `sensed` and `truth`.

        Raises:
            GaitshiftError: a target is outside ± `MOST_ANGLE`; the state is then unchanged.
        """
        check_within("joint targets", "rad", target, MOST_ANGLE, names=self.robot.joint_names)
        self._history.add(self._qpos, self._qvel)
        for steps, followed in self._hardware.followed(target):
            self._ctrl[:] = followed
            self._batch.step(nstep=steps, stage=int(mujoco.mjtStage.mjSTAGE_VEL))
        if self._warned.any() or not np.abs(self._qvel).max() <= FASTEST:  # true for NaN
            in_range = np.abs(self._qvel).max(axis=1) <= FASTEST
            self._restart(np.flatnonzero(self._warned.any(axis=1) | ~in_range))
        else:
            self._measure()
            self.sensed = self._hardware.sense(self.ideal, self.truth)
        return self.sensed, self.truth

    def state(self) -> tuple[Float[np.ndarray, "N 19"], Float[np.ndarray, "N 18"]]:
        """Copies of qpos and qvel."""
        return self._qpos.copy(), self._qvel.copy()

    def _restart(self, ids: Int[np.ndarray, " K"]) -> None:
        """Sets diverged robots down where they were before the step, and keeps their last second.

        In `truth`, which then describes the restarted robots, `diverged` is true for them.
        """
        for robot in map(int, ids):
            self._history.keep(robot, self.terrains[robot % len(self.terrains)])
        xy = np.clip(self.truth.base_position_w[ids, :2], -MOST_DISTANCE, MOST_DISTANCE)
        self.place(ids, xy=xy, yaw=self.truth.yaw[ids])
        self.sensed = self._hardware.sense(self.ideal, self.truth)  # for the others time goes on
        mask = np.zeros(self.n, dtype=bool)
        mask[ids] = True
        self.truth = replace(self.truth, diverged=mask)

    @property
    def divergences(self) -> list[Divergence]:
        """The first divergences, for replay; may be cleared."""
        return self._history.divergences

    def _measure(self) -> None:
        """Updates `truth` and `ideal`."""
        sensors = self._sensordata.copy()
        self.truth, self.ideal = measured(
            self.robot,
            self._fields,
            qpos=self._qpos.copy(),
            qvel=self._qvel.copy(),
            torque=self._torque.copy(),
            feet=Feet(
                lowest_w=self._feet(sensors),
                velocity_w=sensors[:, 12:24].reshape(-1, 4, 3),
                force=sensors[:, 24:28],
            ),
            body_contact=sensors[:, 28] > 0.0,
        )

    def _feet(self, sensors: Float[np.ndarray, "K S"]) -> Float[np.ndarray, "K 4 3"]:
        """Lowest points of the feet [m]: the sensors give the centres of the spheres."""
        feet = sensors[:, :12].reshape(-1, 4, 3).copy()
        feet[..., 2] -= self.robot.foot_radius
        return feet

    def _settle(self, ids: Int[np.ndarray, " K"]) -> None:
        """Updates every measured quantity of these robots."""
        self._ctrl[ids] = self._qpos[ids, POSE:]
        self._applied[ids] = 0.0
        self._history.forget(ids)
        self._batch.forward(ids=ids)
        self._measure()
        self.sensed = self._hardware.restart(ids, self.ideal, self.truth, self._ctrl[ids])

    def _kept_state(
        self, terrains: tuple[Terrain, ...]
    ) -> tuple[Float[np.ndarray, "N 19"], Float[np.ndarray, "N 18"]]:
        """The present state, moved vertically so that no foot penetrates deeper than before."""
        qpos, qvel = self.state()
        feet = self.truth.foot_position_w[..., :2]
        before, after = self._fields, Fields(terrains[: self.n], self.n)
        qpos[:, 2] += (after.height_at(feet) - before.height_at(feet)).max(axis=1)
        return qpos, qvel
