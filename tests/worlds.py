"""Worlds of robots that stand, fly or stagger, and what is measured in them."""

from dataclasses import fields

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.sensor_config import PERFECT
from gaitshift.sim.terrain import flat, perlin
from gaitshift.sim.world import World

MASS = 30.4754
"""Of ANYmal B in its URDF [kg]."""
GRAVITY = 9.81
PERIOD, PHYSICS_STEP = 0.01, 0.0025
"""Control step and physics step [s]."""
STANCE = ANYMAL_B.stance_angles
LEVEL = flat(4.0, 4.0)
ROUGH = perlin(0.08, seed=5, length=8.0, width=8.0).moved(-4.0, 0.0)
UP = (0.0, 0.0, 3.0)
"""Thrown up like this [m/s], a robot stays in the air for 0.61 s."""


def robots(n, *, terrain=LEVEL, threads=1, sensors=PERFECT, seed=0, **where):
    """A world of robots that stand at different places and headings unless told otherwise."""
    world = World(ANYMAL_B, terrain, n, threads=threads, sensors=sensors, seed=seed)
    place(world, **where)
    return world


def place(world, *, xy=None, yaw=None, **rest):
    n = world.n
    xy = 0.3 * np.stack([np.arange(n), -np.arange(n)], axis=1) if xy is None else np.array(xy)
    yaw = 0.7 * np.arange(n) if yaw is None else np.array(yaw)
    if "base_velocity_w" in rest:
        rest["base_velocity_w"] = np.broadcast_to(rest["base_velocity_w"], (n, 3)).copy()
    world.place(np.arange(n), xy=xy.astype(float), yaw=yaw.astype(float), **rest)


def throw_apart(world, robot, torque=1e30):
    """Turns a robot in the next step by a torque [N·m] that the checks of the world refuse."""
    world._applied[robot, 3] = torque


def stand(world, steps):
    """What is sensed, and the truth, after standing for these control steps."""
    for _ in range(steps):
        world.step(np.tile(STANCE, (world.n, 1)))
    return world.sensed, world.truth


def wild_targets(n, steps, seed=0, spread=0.25):
    """Targets about the stance, different at every step, robot and joint (steps, n, 12)."""
    return STANCE + np.random.default_rng(seed).normal(0.0, spread, (steps, n, 12))


def run(world, targets):
    """What is sensed, and the truth, after driving to these targets, one a step."""
    for target in targets:
        world.step(target)
    return world.sensed, world.truth


def fly(n, **where):
    """A world of robots thrown up, clear of the ground and in the air for 0.5 s more."""
    world = robots(n, base_velocity_w=UP, **where)
    stand(world, 5)
    return world


def arrays_of(*records):
    """The arrays of records by name."""
    named = ((f.name, getattr(record, f.name)) for record in records for f in fields(record))
    return {name: value for name, value in named if isinstance(value, np.ndarray)}


def assert_same_bits(records, others, ids=slice(None)):
    """What is sensed, and the truth, are the same as of these robots of another world."""
    for record, other in zip(records, others, strict=True):
        for name, array in arrays_of(record).items():
            np.testing.assert_array_equal(array, arrays_of(other)[name][ids], err_msg=name)


def plain(world, robot=0):
    """MuJoCo's own data of one robot, with everything computed from its state."""
    data = mujoco.MjData(world.model)
    qpos, qvel = world.state()
    data.qpos[:], data.qvel[:] = qpos[robot], qvel[robot]
    mujoco.mj_forward(world.model, data)
    mujoco.mj_subtreeVel(world.model, data)
    return data


def attitude_of(truth):
    """Rotations from the bodies to the world."""
    return Rotation.from_quat(truth.base_quaternion_w, scalar_first=True)


def velocity_w(truth):
    """Velocities of the base origins in the world [m/s]."""
    return attitude_of(truth).apply(truth.velocity_b)
