"""The second simulator: against mechanics, and against MuJoCo where both have to agree."""

import json
from importlib import import_module
from importlib.util import find_spec

import mujoco
import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.urdf import urdf_of
from gaitshift.sim.bullet import BulletWorld
from gaitshift.sim.bullet.body import Body, Motion
from gaitshift.sim.simulator import FRICTION, Simulator, simulator_maker
from gaitshift.sim.terrain import flat, perlin
from gaitshift.sim.world import World
from worlds import (
    GRAVITY,
    LEVEL,
    MASS,
    PERIOD,
    PHYSICS_STEP,
    ROUGH,
    STANCE,
    arrays_of,
    assert_same_bits,
    place,
    run,
    stand,
    velocity_w,
    wild_targets,
)

if not (find_spec("pybullet") and urdf_of(ANYMAL_B)):
    pytest.skip("needs pip install 'gaitshift[sim2sim]'", allow_module_level=True)

FOLDED = (np.outer([1, -1, 1, -1], [0.72, 0, 0]) + np.outer([1, 1, -1, -1], [0, 1.5, -2.4])).ravel()
"""Legs splayed and folded [rad]: the trunk lies on the ground."""


def bullets(n, *, terrain=LEVEL, **where):
    """Robots in PyBullet that stand where `worlds.robots` puts them in MuJoCo."""
    world = BulletWorld(ANYMAL_B, terrain, n)
    place(world, **where)
    return world


@pytest.fixture
def body():
    """A robot in the air over level ground."""
    urdf = urdf_of(ANYMAL_B)
    assert urdf is not None
    return Body(urdf, flat(4.0, 4.0))


def random_state(seed):
    """A base that moves and turns anyhow, joints within MuJoCo's limits, and torques."""
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    return (
        np.array([0.3, -0.2, 5.0]),
        quaternion / np.linalg.norm(quaternion),
        rng.normal(0.0, 1.0, 3),
        rng.normal(0.0, 2.0, 3),
        STANCE + rng.uniform(-0.3, 0.3, 12),
        rng.normal(0.0, 4.0, 12),
        rng.normal(0.0, 20.0, 12),
    )


def in_mujoco(position, quaternion, velocity, turning_w, angles, speeds, torque):
    """MuJoCo's model and data of a robot in this state, driven by these torques alone."""
    model = World(ANYMAL_B, LEVEL, 1).model
    data = mujoco.MjData(model)
    turning_b = np.zeros(3)
    mujoco.mju_rotVecQuat(turning_b, turning_w, quaternion * (1, -1, -1, -1))
    data.qpos[:] = np.concatenate([position, quaternion, angles])
    data.qvel[:] = np.concatenate([velocity, turning_b, speeds])
    data.qfrc_applied[6:] = torque
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_ACTUATION
    mujoco.mj_forward(model, data)
    return model, data


@pytest.mark.parametrize("seed", range(4))
def test_joint_accelerations_in_the_air_are_those_of_mujoco(body, seed):
    """Masses, inertias, axes and offsets of URDF and MJCF describe one robot."""
    position, quaternion, velocity, turning, angles, speeds, torque = random_state(seed)
    body.put(Motion(position, np.roll(quaternion, -1), velocity, turning), angles, speeds)
    body.advance(torque, np.zeros(3))
    _, data = in_mujoco(position, quaternion, velocity, turning, angles, speeds, torque)
    acceleration = (body.joints()[1] - speeds) / PHYSICS_STEP
    expected = data.qacc[6:]
    assert np.abs(expected).max() > 100.0
    error = np.abs(acceleration - expected).max() / np.abs(expected).max()
    assert error < 1e-6


@pytest.mark.parametrize("seed", range(4))
def test_feet_are_where_mujoco_has_them_and_move_as_fast(body, seed):
    position, quaternion, velocity, turning, angles, speeds, torque = random_state(seed)
    body.put(Motion(position, np.roll(quaternion, -1), velocity, turning), angles, speeds)
    _, data = in_mujoco(position, quaternion, velocity, turning, angles, speeds, torque)
    feet = body.feet()
    sensors = data.sensordata
    np.testing.assert_allclose(feet.position_w, sensors[:12].reshape(4, 3), rtol=0, atol=1e-9)
    np.testing.assert_allclose(feet.velocity_w, sensors[12:24].reshape(4, 3), rtol=0, atol=1e-9)


def test_what_is_sensed_of_a_placed_robot_is_what_mujoco_senses():
    """But for contacts and torques, which are those of a step that is yet to come."""
    rng = np.random.default_rng(5)
    where = {
        "joint_position": STANCE + rng.uniform(-0.2, 0.2, (3, 12)),
        "joint_velocity": rng.normal(0.0, 2.0, (3, 12)),
        "base_velocity_w": rng.normal(0.0, 1.0, (3, 3)),
        "base_angular_velocity_b": rng.normal(0.0, 1.0, (3, 3)),
    }
    second, first = bullets(3, terrain=ROUGH, **where), World(ANYMAL_B, ROUGH, 3)
    place(first, **where)
    of_forces = {"contact", "joint_torque", "foot_force", "body_contact", "diverged"}
    ours = arrays_of(second.sensed, second.truth)
    for name, array in arrays_of(first.sensed, first.truth).items():
        if name not in of_forces:
            np.testing.assert_allclose(ours[name], array, rtol=0, atol=1e-9, err_msg=name)


def test_standing_feet_carry_the_weight():
    world = bullets(2)
    stand(world, 100)
    force = [stand(world, 1)[1].foot_force.sum(axis=1) for _ in range(50)]
    np.testing.assert_allclose(np.mean(force, axis=0), MASS * GRAVITY, rtol=0.02)
    assert world.sensed.contact.all()
    assert not world.truth.body_contact.any()


def test_torques_of_a_standing_robot_are_those_in_mujoco():
    """Both controllers hold the same robot against the same weight."""
    second, first = bullets(1), World(ANYMAL_B, LEVEL, 1)
    target = STANCE + 0.01 * np.arange(12)[None]
    for _ in range(200):
        second.step(target)
        first.step(target)
    here, there = second.sensed.joint_torque, first.sensed.joint_torque
    np.testing.assert_allclose(here, there, rtol=0, atol=0.3)
    assert np.abs(here).max() > 8.0


def test_a_thrown_robot_follows_the_parabola():
    """v·t - ½·g·t² of the centre of mass, less the ½·g·t·h of the integrator.

    Joints are held, so the base follows it as well, but for what the legs move at the start.
    """
    velocity = np.array([0.4, -0.2, 3.0])
    world = bullets(2, base_velocity_w=velocity)
    start = world.truth.base_position_w
    for k in range(1, 51):
        sensed, truth = stand(world, 1)
        t = k * PERIOD
        fall = np.array([0.0, 0.0, GRAVITY * t * (t + PHYSICS_STEP) / 2])
        np.testing.assert_allclose(
            truth.base_position_w, start + velocity * t - fall, rtol=0, atol=1e-9
        )
        assert not sensed.contact.any()
    np.testing.assert_array_equal(truth.foot_force, 0.0)
    np.testing.assert_allclose(velocity_w(truth)[:, 2], 3.0 - GRAVITY * 0.5, atol=1e-9)


def test_a_push_changes_the_momentum_by_force_times_time():
    """In the air, where the centre of mass feels nothing else but its weight."""
    force = np.array([[60.0, -20.0, 10.0], [0.0, 0.0, 0.0]])
    world = bullets(2, base_velocity_w=(0.0, 0.0, 3.0), yaw=[0.4, 0.4])
    world.push(force)
    for _ in range(10):
        world.step(np.tile(STANCE, (2, 1)))
    pushed, free = momentum(world, 0), momentum(world, 1)
    np.testing.assert_allclose(pushed - free, force[0] * 10 * PERIOD, rtol=0.01, atol=0.01)


def momentum(world, robot):
    """Of all bodies, by MuJoCo's masses [kg·m/s]."""
    sensed, truth = world.sensed, world.truth
    model = World(ANYMAL_B, LEVEL, 1).model
    data = mujoco.MjData(model)
    data.qpos[:] = np.concatenate(
        [
            truth.base_position_w[robot],
            truth.base_quaternion_w[robot],
            sensed.joint_position[robot],
        ]
    )
    data.qvel[:] = np.concatenate(
        [velocity_w(truth)[robot], sensed.angular_velocity_b[robot], sensed.joint_velocity[robot]]
    )
    mujoco.mj_forward(model, data)
    mujoco.mj_subtreeVel(model, data)
    return data.subtree_linvel[0] * MASS


def test_the_ground_under_any_point_is_that_of_the_terrain():
    """By rays from above: cells of unequal sides, cut along the terrain's diagonals."""
    terrain = perlin(0.3, seed=3, length=6.3, width=4.1).moved(-2.0, 0.7)
    urdf = urdf_of(ANYMAL_B)
    assert urdf is not None
    body = Body(urdf, terrain)
    high, upright = np.array([0.0, 0.0, 9.0]), np.array([0.0, 0.0, 0.0, 1.0])
    body.put(Motion(high, upright, *np.zeros((2, 3))), STANCE, np.zeros(12))  # out of the way
    x0, x1, y0, y1 = terrain.extent
    xy = np.random.default_rng(0).uniform((x0, y0), (x1, y1), (500, 2))
    xy = xy[terrain.contains(xy, margin=0.05)]
    above, below = (np.column_stack([xy, np.full(len(xy), z)]).tolist() for z in (2.0, -2.0))
    hits = import_module("pybullet").rayTestBatch(above, below, physicsClientId=body.client)
    height = np.array([hit[3][2] for hit in hits])
    np.testing.assert_allclose(height, terrain.height_at(xy), rtol=0, atol=1e-6)


@pytest.mark.parametrize(("share", "slides"), [(0.85, False), (1.15, True)])
def test_a_robot_that_lies_slides_under_a_push_above_friction_times_weight(share, slides):
    """Coulomb's law with the friction of the MuJoCo model, on the trunk as on the feet."""
    world = bullets(1, yaw=[0.0])
    lie_down(world, steps=150)
    before = world.truth.base_position_w[0, 0]
    world.push(np.array([[share * FRICTION * MASS * GRAVITY, 0.0, 0.0]]))
    for _ in range(100):
        world.step(FOLDED[None])
    moved = world.truth.base_position_w[0, 0] - before
    assert (moved > 0.15) == slides
    assert slides or moved < 0.05


def lie_down(world, steps, standing=0):
    """The records of each step in which robot 0 lets its trunk down beside robots that stand."""
    records = []
    for share in np.minimum(np.arange(steps) / 50, 1.0):
        down = STANCE + share * (FOLDED - STANCE)
        records.append(world.step(np.array([down, *[STANCE] * standing])))
    return records


def test_contact_tells_the_lifted_foot_from_the_others():
    """Robot i draws up leg i: 0.09 s later that foot alone is in the air."""
    world = bullets(4, xy=np.zeros((4, 2)))
    assert stand(world, 100)[0].contact.all()
    target = np.tile(STANCE, (4, 1)).reshape(4, 4, 3)
    for leg in range(4):
        target[leg, leg] += np.array([0.0, 0.4, -0.8]) * np.sign(STANCE[3 * leg + 1])
    for _ in range(9):
        sensed, truth = world.step(target.reshape(4, 12))
    lifted = np.eye(4, dtype=bool)
    np.testing.assert_array_equal(sensed.contact, ~lifted)
    np.testing.assert_array_equal(truth.clearance > 0.05, lifted)
    np.testing.assert_array_equal(truth.clearance < 0.01, ~lifted)


def test_body_contact_holds_on_the_belly_and_not_on_the_feet():
    """Legs splayed and folded let the trunk down; robot 1 goes on standing."""
    world = bullets(2)
    for _, truth in lie_down(world, steps=150, standing=1):
        assert not truth.body_contact[1]
    np.testing.assert_array_equal(truth.body_contact, [True, False])


def test_robots_move_as_each_would_alone_and_the_same_way_again():
    """Bit for bit, with different places, headings, targets, pushes and grounds."""
    grounds, n = [ROUGH, LEVEL], 3
    targets = wild_targets(n, 20)
    forces = np.random.default_rng(4).normal(0.0, 60.0, (n, 3))
    world = bullets(n, terrain=grounds)
    world.push(forces)
    last = run(world, targets)
    for i in range(n):
        where = {"xy": [(0.3 * i, -0.3 * i)], "yaw": [0.7 * i]}
        alone = bullets(1, terrain=grounds[i % 2], **where)
        alone.push(forces[i : i + 1])
        assert_same_bits(run(alone, targets[:, i : i + 1]), last, ids=slice(i, i + 1))


def test_a_robot_that_is_far_too_fast_has_diverged_and_is_set_down_again():
    """10 kN speed up 30 kg by 330 m/s in a second; the other robot goes on standing."""
    world = bullets(2)
    world.push(np.array([[0.0, 0.0, 10_000.0], [0.0, 0.0, 0.0]]))
    stance = np.tile(STANCE, (2, 1))
    for _ in range(150):
        sensed, truth = world.step(stance)
        if truth.diverged.any():
            break
    np.testing.assert_array_equal(truth.diverged, [True, False])
    np.testing.assert_allclose(truth.clearance[0].min(), 0.0, atol=1e-9)
    np.testing.assert_array_equal(sensed.joint_velocity[0], 0.0)
    world.push(np.zeros((2, 3)))
    for _ in range(100):
        sensed, truth = world.step(stance)
    assert sensed.contact.all()
    assert not truth.diverged.any()


def test_both_simulators_are_simulators_by_name():
    for name in ("mujoco", "pybullet"):
        assert isinstance(simulator_maker(name)(ANYMAL_B, LEVEL, 1), Simulator)


def test_values_out_of_range_are_refused_and_nothing_moves():
    world = bullets(2)
    before = arrays_of(world.sensed, world.truth)
    bad = np.tile(STANCE, (2, 1))
    bad[1, 7] = np.nan
    for call in (lambda: world.step(bad), lambda: world.push(np.full((2, 3), 1e6))):
        with pytest.raises(GaitshiftError, match="robot"):
            call()
    for name, array in arrays_of(world.sensed, world.truth).items():
        np.testing.assert_array_equal(array, before[name], name)


def test_too_many_robots_are_refused():
    with pytest.raises(GaitshiftError, match="257"):
        BulletWorld(ANYMAL_B, LEVEL, 257)


@pytest.mark.learned
def test_a_shipped_trot_is_a_clean_trot_here_as_well_and_stdout_holds_its_figures_alone(capfd):
    """At fd level, because PyBullet writes to C's stdout."""
    command = ["evaluate", "trot", "--simulator", "pybullet", "--episodes", "2", "--seconds", "4"]
    main([*command, "--json"])
    figures = json.loads(capfd.readouterr().out)
    assert figures["simulator"] == "pybullet"
    assert figures["verdict"]["gait"] == "trot"
    assert figures["verdict"]["clean"]
    assert figures["survival"] == 1.0
    assert figures["speed_mean"] == pytest.approx(1.2, abs=0.06)
