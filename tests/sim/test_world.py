"""The world: against mechanics, a plain MuJoCo simulation and its own laws."""

import mujoco
import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.terrain import perlin, slope
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
    fly,
    plain,
    robots,
    run,
    stand,
    velocity_w,
    wild_targets,
)


def test_standing_feet_carry_the_weight():
    """Averaged over a second of standing the normal forces are m·g."""
    world = robots(2)
    stand(world, 200)
    force = [stand(world, 1)[1].foot_force.sum(axis=1) for _ in range(100)]
    np.testing.assert_allclose(np.mean(force, axis=0), MASS * GRAVITY, rtol=0.01)
    assert world.sensed.contact.all()


def test_a_thrown_robot_follows_the_parabola():
    """v·t - ½·g·t², less the ½·g·t·h of an integrator that moves by the new velocity."""
    world = robots(3, base_velocity_w=(0.4, -0.2, 3.0))
    start = world.truth.base_position_w
    for k in range(1, 56):
        sensed, truth = stand(world, 1)
        t = k * PERIOD
        fall = GRAVITY * t * (t + PHYSICS_STEP) / 2
        path = start + np.array([0.4 * t, -0.2 * t, 3.0 * t - fall])
        np.testing.assert_allclose(truth.base_position_w, path, rtol=0, atol=1e-12)
        assert not sensed.contact.any()
    np.testing.assert_allclose(truth.foot_force, 0.0)
    np.testing.assert_allclose(
        velocity_w(truth), np.tile([0.4, -0.2, 3.0 - GRAVITY * 0.55], (3, 1))
    )


def test_torque_is_the_pd_law_within_the_effort_limit():
    """At the start of the last physics step: kp·(target - q) - kd·q̇, within the motor's lines.

    They fall from 120 N·m at rest to 0 at 15 rad/s, and are cut off at 80 N·m.

    The state before the last physics step comes from a plain MuJoCo simulation, which also ends
    where the world ends.
    """
    world = fly(1, yaw=[0.3])
    limited = 0
    for target in wild_targets(1, 40, spread=0.8):
        data = plain(world)
        data.ctrl[:] = target[0]
        mujoco.mj_step(world.model, data, nstep=round(PERIOD / PHYSICS_STEP) - 1)
        angles, speeds = data.qpos[7:].copy(), data.qvel[6:].copy()
        mujoco.mj_step(world.model, data)
        sensed, _ = world.step(target)
        wanted = 80.0 * (target[0] - angles) - 2.0 * speeds
        least, most = (np.clip(120.0 * (sign - speeds / 15.0), -80, 80) for sign in (-1, 1))
        expected = np.clip(wanted, least, most)
        np.testing.assert_allclose(sensed.joint_torque[0], expected, rtol=0, atol=1e-6)
        np.testing.assert_allclose(sensed.joint_position[0], data.qpos[7:], rtol=0, atol=1e-9)
        limited += np.count_nonzero(np.abs(wanted) > 80.0)
    assert limited > 20


def test_torque_at_rest_is_stiffness_times_error():
    """Joints of a standing robot hardly move: what is left is kp·(target - q)."""
    world = robots(1)
    target = STANCE + 0.01 * np.arange(12)[None]
    for _ in range(200):
        sensed, _ = world.step(target)
    error = target - sensed.joint_position
    np.testing.assert_allclose(sensed.joint_torque, 80.0 * error, rtol=0, atol=0.15)
    assert np.abs(sensed.joint_torque).max() > 8.0


def test_a_standing_robot_stays_where_it_stands():
    world = robots(2)
    before = stand(world, 100)[1].foot_position_w
    assert np.abs(stand(world, 300)[1].foot_position_w - before).max() < 1e-3


def test_contact_tells_the_lifted_foot_from_the_others():
    """Robot i draws up leg i: 0.09 s later that foot alone is in the air.

    On level ground at 0 the height above the lowest foot is then still that of the base.
    """
    world = robots(4, xy=np.zeros((4, 2)))
    assert stand(world, 100)[0].contact.all()
    target = np.tile(STANCE, (4, 1)).reshape(4, 4, 3)
    for leg in range(4):
        target[leg, leg] += np.array([0.0, 0.4, -0.8]) * np.sign(STANCE[3 * leg + 1])
    for _ in range(9):
        sensed, truth = world.step(target.reshape(4, 12))
    lifted = np.eye(4, dtype=bool)
    np.testing.assert_array_equal(sensed.contact, ~lifted)
    np.testing.assert_array_equal(truth.foot_force > 10.0, ~lifted)
    np.testing.assert_array_equal(truth.clearance > 0.05, lifted)
    np.testing.assert_array_equal(truth.clearance < 0.01, ~lifted)
    np.testing.assert_allclose(sensed.base_height, truth.base_position_w[:, 2], atol=0.015)


def test_body_contact_holds_on_the_belly_and_not_on_the_feet():
    """Legs splayed and folded let the trunk down; robot 1 goes on standing."""
    world = robots(2)
    folded = np.outer([1, -1, 1, -1], [0.72, 0, 0]) + np.outer([1, 1, -1, -1], [0, 1.5, -2.4])
    for share in np.minimum(np.arange(150) / 50, 1.0):
        down = STANCE + share * (folded.ravel() - STANCE)
        _, truth = world.step(np.array([down, STANCE]))
        assert not truth.body_contact[1]
    np.testing.assert_array_equal(truth.body_contact, [True, False])


@pytest.mark.parametrize("degrees", [-7.0, 6.0])
def test_feet_on_a_ramp_stand_on_the_plane_of_its_slope(degrees):
    """The ground under a foot is tan(slope)·x, and feet in contact are within 3 mm of it.

    A ball that touches a slope has its lowest point r·(1/cos - 1) above it, here at most 0.2 mm;
    the rest is how deep feet sink in.
    """
    angle = np.radians(degrees)
    ramp = slope(degrees, length=6.0, width=6.0).moved(-3.0, 0.0)
    world = robots(3, terrain=ramp, xy=[(0.0, 0.0), (0.5, -0.2), (-0.7, 0.4)])
    sensed, truth = stand(world, 150)
    foot = truth.foot_position_w
    ground = np.tan(angle) * (foot[..., 0] + 3.0)
    np.testing.assert_allclose(truth.clearance, foot[..., 2] - ground, rtol=0, atol=1e-12)
    assert sensed.contact.all()
    np.testing.assert_allclose(truth.clearance, 0.0, rtol=0, atol=3e-3)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e30, -21.0])
def test_a_target_that_is_no_number_is_refused_and_nothing_moves(value):
    world, twin = (robots(3) for _ in range(2))
    targets = wild_targets(3, 4)
    for each in (world, twin):
        run(each, targets[:2])
    before, measured = world.state(), (world.sensed, world.truth)
    bad = targets[2].copy()
    bad[2, 7] = value
    with pytest.raises(GaitshiftError) as error:
        world.step(bad)
    assert str(error.value) == (
        f"joint targets must be -20 to 20 rad, got {value:g} for BL_HFE of robot 2"
    )
    np.testing.assert_array_equal(before[0], world.state()[0])
    np.testing.assert_array_equal(before[1], world.state()[1])
    assert (world.sensed, world.truth) == measured
    assert_same_bits(run(world, targets[2:]), run(twin, targets[2:]))


def test_a_world_without_robots_is_refused():
    with pytest.raises(GaitshiftError, match="robots must be 1 or more, got 0"):
        World(ANYMAL_B, LEVEL, 0)


def test_robots_of_a_batch_move_as_each_would_alone():
    """Bit for bit, with different places, headings, targets and pushes."""
    n, targets = 5, wild_targets(5, 30)
    forces = np.random.default_rng(4).normal(0.0, 60.0, (n, 3))
    batch = robots(n, terrain=ROUGH)
    batch.push(forces)
    last = run(batch, targets)
    for i in range(n):
        alone = robots(1, terrain=ROUGH, xy=[(0.3 * i, -0.3 * i)], yaw=[0.7 * i])
        alone.push(forces[i : i + 1])
        assert_same_bits(run(alone, targets[:, i : i + 1]), last, ids=slice(i, i + 1))


@pytest.mark.parametrize("threads", [1, 2])
def test_the_same_inputs_give_the_same_bits_on_any_number_of_threads(threads):
    targets = wild_targets(7, 30)
    once = run(robots(7, terrain=ROUGH), targets)
    again = run(robots(7, terrain=ROUGH, threads=threads), targets)
    assert_same_bits(once, again)


def test_placing_a_robot_leaves_the_others_alone():
    world, twin = (robots(4) for _ in range(2))
    targets = wild_targets(4, 10)
    for each in (world, twin):
        each.push(np.full((4, 3), 30.0))
        run(each, targets[:5])
    ids = np.array([1, 3])
    world.place(ids, xy=np.array([(5.0, 6.0), (7.0, 8.0)]), yaw=np.array([0.4, -2.0]))
    np.testing.assert_array_equal(world.truth.base_position_w[ids, :2], [(5, 6), (7, 8)])
    np.testing.assert_allclose(world.sensed.yaw[ids], [0.4, -2.0], atol=1e-12)
    others = np.array([0, 2])
    after, expected = (run(each, targets[5:]) for each in (world, twin))
    for name, array in arrays_of(*after).items():
        np.testing.assert_array_equal(array[others], arrays_of(*expected)[name][others], name)


def test_placed_robots_rest_upright_with_the_lowest_foot_on_the_ground():
    joints = wild_targets(4, 1)[0]
    world = robots(4, terrain=ROUGH, joint_position=joints)
    sensed = world.sensed
    np.testing.assert_allclose(world.truth.clearance.min(axis=1), 0.0, atol=1e-12)
    np.testing.assert_array_equal(sensed.joint_position, joints)
    np.testing.assert_array_equal(sensed.joint_velocity, np.zeros((4, 12)))
    np.testing.assert_allclose(sensed.gravity_b, np.tile([0, 0, -1], (4, 1)), atol=1e-15)


def test_robots_placed_on_their_way_go_on_alike_whichever_way_they_head():
    """Mechanics know no heading: turned by ψ, all that follows is turned by ψ."""
    rng, turn = np.random.default_rng(3), np.array([0.0, 0.9, -2.2])
    same = {
        "joint_position": STANCE + rng.normal(0.0, 0.1, 12),
        "joint_velocity": rng.normal(0.0, 2.0, 12),
        "base_angular_velocity_b": rng.normal(0.0, 0.5, 3),
    }
    tilt = np.array([np.cos(0.15), 0.6 * np.sin(0.15), 0.8 * np.sin(0.15), 0.0])
    velocity = np.array([1.1, -0.2, 0.3])
    forward, left = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    across = (velocity[0] * forward + velocity[1] * left).T
    world = robots(3, xy=np.zeros((3, 2)), yaw=turn)
    world.place(
        np.arange(3),
        xy=np.zeros((3, 2)),
        yaw=turn,
        attitude=np.tile(tilt, (3, 1)),
        base_velocity_w=np.column_stack([across, np.full(3, velocity[2])]),
        **{name: np.tile(given, (3, 1)) for name, given in same.items()},
    )
    sensed, truth = world.sensed, world.truth
    np.testing.assert_allclose(sensed.joint_velocity, np.tile(same["joint_velocity"], (3, 1)))
    np.testing.assert_allclose(truth.clearance.min(axis=1), 0.0, atol=1e-12)
    # A turn by 0.3 rad about (0.6, 0.8, 0) takes the body's vertical along with it.
    upright = sensed.rotation[0, :, 2]
    np.testing.assert_allclose(
        upright, [0.8 * np.sin(0.3), -0.6 * np.sin(0.3), np.cos(0.3)], atol=1e-12
    )
    for target in np.repeat(wild_targets(1, 8), 3, axis=1):
        sensed, truth = world.step(target)
    ahead, aside = (
        np.einsum("in,ni->n", axis, truth.base_position_w[:, :2]) for axis in (forward, left)
    )
    np.testing.assert_allclose(ahead, ahead[0], atol=1e-4)
    np.testing.assert_allclose(aside, aside[0], atol=1e-4)
    assert ahead[0] > 0.03
    for name in ("joint_position", "velocity_b", "gravity_b", "foot_position_b"):
        array = getattr(sensed, name)
        np.testing.assert_allclose(array, np.broadcast_to(array[0], array.shape), atol=1e-3)


def test_robots_share_several_terrains_out_in_turn():
    """Robot i moves as it would alone on terrain i mod K, and K may exceed N."""
    grounds = [slope(8.0, length=6.0, width=6.0).moved(-3.0, 0.0), LEVEL, ROUGH]
    targets = wild_targets(5, 20)
    for n in (2, 5):
        world = robots(n, terrain=grounds)
        assert_same_bits_alone(world, grounds, targets[:, :n])
    heights = robots(3, terrain=grounds, xy=np.zeros((3, 2))).truth.base_position_w[:, 2]
    assert np.diff(np.sort(heights)).min() > 1e-3


def assert_same_bits_alone(world, grounds, targets):
    last = run(world, targets)
    for i in range(world.n):
        ground = grounds[i % len(grounds)]
        alone = robots(1, terrain=ground, xy=[(0.3 * i, -0.3 * i)], yaw=[0.7 * i])
        assert_same_bits(run(alone, targets[:, i : i + 1]), last, ids=slice(i, i + 1))


def test_robots_go_on_as_they_moved_on_new_ground():
    """Set down so that no foot is deeper than before, and none higher than that asks for."""
    world = robots(5, terrain=ROUGH)
    before = run(world, wild_targets(5, 20))
    world.set_terrain(perlin(0.1, seed=9, length=8.0, width=8.0).moved(-4.0, 0.0))
    after = world.sensed, world.truth
    for name in ("joint_position", "joint_velocity", "orientation", "angular_velocity_b"):
        np.testing.assert_array_equal(getattr(after[0], name), getattr(before[0], name), name)
    before, after = before[1], after[1]
    for name in ("base_quaternion_w", "velocity_b"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name), name)
    np.testing.assert_array_equal(after.base_position_w[:, :2], before.base_position_w[:, :2])
    raised = after.clearance - before.clearance
    np.testing.assert_allclose(raised.min(axis=1), 0.0, rtol=0, atol=1e-12)
    assert np.abs(raised).max() > 0.01


def test_new_ground_carries_robots_where_it_lies():
    world = robots(2)
    stand(world, 50)
    ramp = slope(8.0, length=10.0, width=10.0).moved(-5.0, 0.0)
    world.set_terrain(ramp)
    sensed, truth = stand(world, 100)
    height = np.tan(np.radians(8.0)) * (truth.foot_position_w[..., 0] + 5.0)
    assert sensed.contact.all()
    np.testing.assert_allclose(truth.foot_position_w[..., 2], height, rtol=0, atol=3e-3)
