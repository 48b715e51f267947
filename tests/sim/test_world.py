"""The world: against mechanics, a plain MuJoCo simulation, scipy's rotations and its own laws."""

from dataclasses import fields, replace
from itertools import pairwise

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.legs import LEGS
from gaitshift.robot.motion import Motion
from gaitshift.sim.terrain import flat, perlin, slope, step
from gaitshift.sim.world import PushConfig, Pusher, World
from gaitshift.sim.world.scene import build_model

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


def robots(n, *, terrain=LEVEL, threads=1, **where):
    """A world of robots that stand at different places and headings unless told otherwise."""
    world = World(ANYMAL_B, terrain, n, threads=threads)
    place(world, **where)
    return world


def place(world, *, xy=None, yaw=None, **rest):
    n = world.n
    xy = 0.3 * np.stack([np.arange(n), -np.arange(n)], axis=1) if xy is None else np.array(xy)
    yaw = 0.7 * np.arange(n) if yaw is None else np.array(yaw)
    if "base_velocity_w" in rest:
        rest["base_velocity_w"] = np.tile(rest["base_velocity_w"], (n, 1))
    world.place(np.arange(n), xy=xy.astype(float), yaw=yaw.astype(float), **rest)


def stand(world, steps):
    for _ in range(steps):
        world.step(np.tile(STANCE, (world.n, 1)))
    return world.motion


def wild_targets(n, steps, seed=0, spread=0.25):
    """Targets about the stance, different at every step, robot and joint (steps, n, 12)."""
    return STANCE + np.random.default_rng(seed).normal(0.0, spread, (steps, n, 12))


def run(world, targets):
    """The motion after driving to these targets, one a step."""
    for target in targets:
        world.step(target)
    return world.motion


def fly(n, **where):
    """A world of robots thrown up, clear of the ground and in the air for 0.5 s more."""
    world = robots(n, base_velocity_w=UP, **where)
    stand(world, 5)
    return world


def arrays_of(motion):
    return {f.name: getattr(motion, f.name) for f in fields(Motion)}


def assert_same_bits(motion, other, ids=slice(None)):
    for name, array in arrays_of(motion).items():
        np.testing.assert_array_equal(array, arrays_of(other)[name][ids], err_msg=name)


def plain(world, robot=0):
    """MuJoCo's own data of one robot, with everything computed from its state."""
    data = mujoco.MjData(world.model)
    qpos, qvel = world.state()
    data.qpos[:], data.qvel[:] = qpos[robot], qvel[robot]
    mujoco.mj_forward(world.model, data)
    mujoco.mj_subtreeVel(world.model, data)
    return data


# Mechanics


def test_standing_feet_carry_the_weight():
    """Averaged over a second of standing the normal forces are m·g."""
    world = robots(2)
    stand(world, 200)
    force = [stand(world, 1).foot_force.sum(axis=1) for _ in range(100)]
    np.testing.assert_allclose(np.mean(force, axis=0), MASS * GRAVITY, rtol=0.01)
    assert world.motion.contact.all()


def test_a_thrown_robot_follows_the_parabola():
    """v·t - ½·g·t², less the ½·g·t·h of an integrator that moves by the new velocity."""
    world = robots(3, base_velocity_w=(0.4, -0.2, 3.0))
    start = world.motion.base_position_w
    for k in range(1, 56):
        motion = stand(world, 1)
        t = k * PERIOD
        fall = GRAVITY * t * (t + PHYSICS_STEP) / 2
        path = start + np.array([0.4 * t, -0.2 * t, 3.0 * t - fall])
        np.testing.assert_allclose(motion.base_position_w, path, rtol=0, atol=1e-12)
        assert not motion.contact.any()
    np.testing.assert_allclose(motion.foot_force, 0.0)
    np.testing.assert_allclose(
        motion.base_linear_velocity_w, np.tile([0.4, -0.2, 3.0 - GRAVITY * 0.55], (3, 1))
    )


def test_a_push_gives_the_mass_centre_its_force_over_mass():
    """100 N along world x for 0.3 s of flight, whatever the heading and whatever the legs do.

    Within 0.02 m/s: the integrator's error, which halves with its step.
    """
    force, duration = np.array([100.0, 0.0, 0.0]), 0.3
    world = fly(3, yaw=[0.0, 1.0, -2.0])
    before = [plain(world, i).subtree_linvel[1].copy() for i in range(3)]
    world.push(np.tile(force, (3, 1)))
    run(world, wild_targets(3, round(duration / PERIOD)))
    weight = np.array([0.0, 0.0, -MASS * GRAVITY])
    for i in range(3):
        gained = plain(world, i).subtree_linvel[1] - before[i]
        np.testing.assert_allclose(gained, (force + weight) / MASS * duration, rtol=0, atol=0.02)


def test_a_push_acts_at_the_base_origin():
    """It turns the robot by its lever arm about the mass centre, 2.6 cm below the origin."""
    force = np.array([60.0, 100.0, 30.0])
    world = fly(2, yaw=[0.5, -2.0])
    turned = np.zeros((2, 3))
    world.push(np.tile(force, (2, 1)))
    for _ in range(10):
        for i in range(2):
            data = plain(world, i)
            turned[i] += np.cross(data.xpos[1] - data.subtree_com[1], force) * PERIOD
        stand(world, 1)
    for i in range(2):
        np.testing.assert_allclose(plain(world, i).subtree_angmom[1], turned[i], atol=0.005)
    assert np.linalg.norm(turned, axis=1).min() > 0.3


def test_pushes_last_20_steps_200_apart_and_begin_anywhere_in_the_first_180():
    """One robot in 180 is pushed in the very first step; binomial, five standard deviations."""
    n = 10_000
    pusher = Pusher(PushConfig(force=50.0), n, np.random.default_rng(7))
    pushed = np.array([pusher.step().any(axis=1) for _ in range(400)])
    first = pushed.argmax(axis=0)
    step_of = (np.arange(400)[:, None] - first) % 200
    np.testing.assert_array_equal(pushed, (np.arange(400)[:, None] >= first) & (step_of < 20))
    assert (first.min(), first.max()) == (0, 179)
    share, deviation = 1 / 180, np.sqrt(1 / 180 * 179 / 180 / n)
    shares = np.bincount(first, minlength=180) / n
    assert np.abs(shares - share).max() < 5 * deviation
    assert abs(pushed[0].mean() - share) < 5 * deviation


def test_a_push_ends_with_the_next_call():
    pushed, alone = (robots(2, base_velocity_w=UP) for _ in range(2))
    pushed.push(np.full((2, 3), 50.0))
    pushed.push(np.zeros((2, 3)))
    assert_same_bits(stand(pushed, 10), stand(alone, 10))


def test_torque_is_the_pd_law_within_the_effort_limit():
    """At the start of the last physics step: kp·(target - q) - kd·q̇, at most 80 N·m.

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
        motion = world.step(target)
        wanted = 80.0 * (target[0] - angles) - 2.0 * speeds
        np.testing.assert_allclose(
            motion.joint_torque[0], np.clip(wanted, -80.0, 80.0), rtol=0, atol=1e-6
        )
        np.testing.assert_allclose(motion.joint_position[0], data.qpos[7:], rtol=0, atol=1e-9)
        limited += np.count_nonzero(np.abs(wanted) > 80.0)
    assert limited > 20


def test_torque_at_rest_is_stiffness_times_error():
    """Joints of a standing robot hardly move: what is left is kp·(target - q)."""
    world = robots(1)
    target = STANCE + 0.01 * np.arange(12)[None]
    for _ in range(200):
        motion = world.step(target)
    error = target - motion.joint_position
    np.testing.assert_allclose(motion.joint_torque, 80.0 * error, rtol=0, atol=0.15)
    assert np.abs(motion.joint_torque).max() > 8.0


def test_a_standing_robot_stays_where_it_stands():
    world = robots(2)
    before = stand(world, 100).foot_position_w
    assert np.abs(stand(world, 300).foot_position_w - before).max() < 1e-3


# Contacts


def test_contact_tells_the_lifted_foot_from_the_others():
    """Robot i draws up leg i: 0.09 s later that foot alone is in the air.

    On level ground at 0 the height above the lowest foot is then still that of the base.
    """
    world = robots(4, xy=np.zeros((4, 2)))
    assert stand(world, 100).contact.all()
    target = np.tile(STANCE, (4, 1)).reshape(4, 4, 3)
    for leg in range(4):
        target[leg, leg] += np.array([0.0, 0.4, -0.8]) * np.sign(STANCE[3 * leg + 1])
    for _ in range(9):
        motion = world.step(target.reshape(4, 12))
    lifted = np.eye(4, dtype=bool)
    np.testing.assert_array_equal(motion.contact, ~lifted)
    np.testing.assert_array_equal(motion.foot_force > 10.0, ~lifted)
    np.testing.assert_array_equal(motion.clearance > 0.05, lifted)
    np.testing.assert_array_equal(motion.clearance < 0.01, ~lifted)
    np.testing.assert_allclose(motion.base_height, motion.base_position_w[:, 2], atol=0.015)


def test_body_contact_holds_on_the_belly_and_not_on_the_feet():
    """Legs splayed and folded let the trunk down; robot 1 goes on standing."""
    world = robots(2)
    folded = np.outer([1, -1, 1, -1], [0.72, 0, 0]) + np.outer([1, 1, -1, -1], [0, 1.5, -2.4])
    for share in np.minimum(np.arange(150) / 50, 1.0):
        down = STANCE + share * (folded.ravel() - STANCE)
        motion = world.step(np.array([down, STANCE]))
        assert not motion.body_contact[1]
    np.testing.assert_array_equal(motion.body_contact, [True, False])


@pytest.mark.parametrize("degrees", [-7.0, 6.0])
def test_feet_on_a_ramp_stand_on_the_plane_of_its_slope(degrees):
    """The ground under a foot is tan(slope)·x, and feet in contact are within 3 mm of it.

    A ball that touches a slope has its lowest point r·(1/cos - 1) above it, here at most 0.2 mm;
    the rest is how deep feet sink in.
    """
    angle = np.radians(degrees)
    ramp = slope(degrees, length=6.0, width=6.0).moved(-3.0, 0.0)
    world = robots(3, terrain=ramp, xy=[(0.0, 0.0), (0.5, -0.2), (-0.7, 0.4)])
    motion = stand(world, 150)
    foot = motion.foot_position_w
    ground = np.tan(angle) * (foot[..., 0] + 3.0)
    np.testing.assert_allclose(motion.clearance, foot[..., 2] - ground, rtol=0, atol=1e-12)
    assert motion.contact.all()
    np.testing.assert_allclose(motion.clearance, 0.0, rtol=0, atol=3e-3)


# Motion: frames, freshness, ownership


def turned_motions(n=40):
    """Motions of random attitude, velocity and feet; what is measured otherwise stays at zero."""
    rng = np.random.default_rng(3)
    quaternion = rng.normal(size=(n, 4))
    return Motion(
        joint_position=np.zeros((n, 12)),
        joint_velocity=np.zeros((n, 12)),
        joint_torque=np.zeros((n, 12)),
        base_position_w=rng.normal(size=(n, 3)),
        base_quaternion_w=quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True),
        base_linear_velocity_w=rng.normal(size=(n, 3)),
        base_angular_velocity_b=rng.normal(size=(n, 3)),
        foot_position_w=rng.normal(size=(n, 4, 3)),
        foot_velocity_w=rng.normal(size=(n, 4, 3)),
        foot_force=np.zeros((n, 4)),
        contact=np.zeros((n, 4), dtype=bool),
        clearance=np.zeros((n, 4)),
        body_contact=np.zeros(n, dtype=bool),
    )


def rotation_of(motion):
    return Rotation.from_quat(motion.base_quaternion_w, scalar_first=True)


def test_rotation_agrees_with_scipy():
    motion = turned_motions()
    np.testing.assert_allclose(motion.rotation_wb, rotation_of(motion).as_matrix(), atol=1e-14)


def test_body_frame_quantities_agree_with_scipy():
    motion = turned_motions()
    into_body = rotation_of(motion).inv()
    velocity, gravity = motion.base_linear_velocity_w, np.tile([0.0, 0.0, -1.0], (40, 1))
    np.testing.assert_allclose(
        motion.base_linear_velocity_b, into_body.apply(velocity), rtol=0, atol=1e-14
    )
    np.testing.assert_allclose(motion.gravity_b, into_body.apply(gravity), rtol=0, atol=1e-14)
    for leg in range(4):
        offset = motion.foot_position_w[:, leg] - motion.base_position_w
        np.testing.assert_allclose(
            motion.foot_position_b[:, leg], into_body.apply(offset), rtol=0, atol=1e-14
        )
    heading = rotation_of(motion).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(motion.yaw, heading, rtol=0, atol=1e-12)


def test_body_frame_quantities_do_not_see_heading_and_place():
    """Turned about the vertical and moved along the ground, only yaw changes, by the turn."""
    motion = turned_motions()
    turn, shift = Rotation.from_euler("Z", 2.0), np.array([30.0, -7.0, 0.0])
    feet = turn.apply(motion.foot_position_w.reshape(-1, 3)).reshape(-1, 4, 3)
    seen = replace(
        motion,
        base_position_w=turn.apply(motion.base_position_w) + shift,
        base_quaternion_w=(turn * rotation_of(motion)).as_quat(scalar_first=True),
        base_linear_velocity_w=turn.apply(motion.base_linear_velocity_w),
        foot_position_w=feet + shift,
    )
    for name in ("base_linear_velocity_b", "gravity_b", "foot_position_b", "base_height"):
        np.testing.assert_allclose(
            getattr(seen, name), getattr(motion, name), rtol=0, atol=1e-12, err_msg=name
        )
    difference = seen.yaw - motion.yaw - 2.0
    np.testing.assert_allclose(np.sin(difference / 2), 0.0, atol=1e-12)


HEADING_FREE = (
    "joint_position",
    "joint_velocity",
    "joint_torque",
    "base_angular_velocity_b",
    "base_linear_velocity_b",
    "gravity_b",
    "foot_position_b",
    "clearance",
    "contact",
)
"""What a robot's heading and place on level ground must not change."""


def spread_of(motion, name):
    """Largest difference between robot 0 and the others."""
    value = getattr(motion, name).astype(float)
    return np.abs(value - value[:1]).max()


def test_flight_does_not_depend_on_heading_and_place():
    """Same targets, four headings: the same in the body frame, turned in the world frame."""
    yaw, xy = [0.0, 0.3, 1.9, -2.5], [(0, 0), (30, -20), (-4, 9), (1, 1)]
    world = fly(4, xy=xy, yaw=yaw)
    motion = run(world, np.tile(wild_targets(1, 35), (1, 4, 1)))
    for name in HEADING_FREE:
        assert spread_of(motion, name) < 1e-9, name
    turn = Rotation.from_rotvec(np.outer(yaw, [0, 0, 1]))
    for name in ("foot_velocity_w", "foot_position_w"):
        value = getattr(motion, name)
        value = value - np.array([[*p, 0.0] for p in xy])[:, None] * (name == "foot_position_w")
        expected = np.stack([turn.apply(np.tile(v, (4, 1))) for v in value[0]], axis=1)
        np.testing.assert_allclose(value, expected, rtol=0, atol=1e-9, err_msg=name)
    assert not motion.contact.any()


def test_standing_does_not_depend_on_quarter_turns_and_place():
    """Within 1e-3 [rad, m, m/s]: friction is solved to a tolerance, and slides amplify it.

    Forces and torques follow from the tiny penetrations and are left out.
    """
    yaw = np.array([0.0, 0.5, 1.0, -0.5]) * np.pi
    world = robots(4, xy=[(0, 0), (30, -20), (-4, 9), (1, 1)], yaw=yaw)
    motion = stand(world, 50)
    for name in ("joint_position", "gravity_b", "foot_position_b", "clearance", "contact"):
        assert spread_of(motion, name) < 1e-3, name


def test_standing_does_not_depend_on_any_turn():
    motion = stand(robots(4, xy=np.zeros((4, 2)), yaw=[0.0, 0.3, 0.785, -2.0]), 100)
    assert spread_of(motion, "joint_position") < 1e-3


def test_velocities_are_rates_of_positions():
    """Over one control step, against the mean of the velocities at its ends.

    The base origin and the feet in the world frame, the turn in the body frame.
    """
    world = fly(3, yaw=[0.5, 2.0, -1.0])
    time, phase = PERIOD * np.arange(40)[:, None, None], np.arange(36).reshape(3, 12)
    swings = STANCE + np.minimum(2.0 * time, 0.3) * np.sin(10.0 * time + phase)
    for before, after in pairwise(world.step(target) for target in swings):
        for position, velocity, tolerance in (
            ("base_position_w", "base_linear_velocity_w", 0.05),
            ("foot_position_w", "foot_velocity_w", 0.2),
        ):
            rate = (getattr(after, position) - getattr(before, position)) / PERIOD
            mean = (getattr(after, velocity) + getattr(before, velocity)) / 2
            np.testing.assert_allclose(rate, mean, rtol=0, atol=tolerance, err_msg=velocity)
        turn = (rotation_of(before).inv() * rotation_of(after)).as_rotvec() / PERIOD
        mean = (before.base_angular_velocity_b + after.base_angular_velocity_b) / 2
        np.testing.assert_allclose(turn, mean, rtol=0, atol=0.05)


def test_nothing_measured_is_a_step_late():
    """Positions and velocities are those that MuJoCo computes anew from the present state."""
    world = robots(2, terrain=ROUGH)
    for target in wild_targets(2, 20):
        motion = world.step(target)
        for i in range(2):
            data = plain(world, i)
            np.testing.assert_array_equal(motion.joint_position[i], data.qpos[7:])
            np.testing.assert_array_equal(motion.joint_velocity[i], data.qvel[6:])
            np.testing.assert_array_equal(motion.base_position_w[i], data.xpos[1])
            for leg, name in enumerate(LEGS):
                lowest = data.site(f"{name}_foot").xpos - (0.0, 0.0, ANYMAL_B.foot_radius)
                np.testing.assert_allclose(
                    motion.foot_position_w[i, leg], lowest, rtol=0, atol=1e-12
                )
                velocity = data.sensor(f"{name}_velocity").data
                np.testing.assert_allclose(
                    motion.foot_velocity_w[i, leg], velocity, rtol=0, atol=1e-12
                )


def test_a_motion_does_not_change_when_the_world_moves_on():
    world = robots(3)
    motion = run(world, wild_targets(3, 5))
    kept = {name: array.copy() for name, array in arrays_of(motion).items()}
    world.push(np.full((3, 3), 40.0))
    run(world, wild_targets(3, 5, seed=1))
    place(world, base_velocity_w=UP)
    world.set_terrain(ROUGH)
    run(world, wild_targets(3, 5, seed=2))
    for name, array in arrays_of(motion).items():
        np.testing.assert_array_equal(array, kept[name], err_msg=name)


def test_a_world_does_not_change_when_a_motion_is_written_to():
    spoilt, untouched = (robots(2) for _ in range(2))
    for array in (*arrays_of(stand(spoilt, 5)).values(), *spoilt.state()):
        array[:] = 1
    stand(untouched, 5)
    assert_same_bits(stand(spoilt, 5), stand(untouched, 5))


# Refusals


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_target_that_is_no_number_is_refused_and_nothing_moves(value):
    world, twin = (robots(3) for _ in range(2))
    targets = wild_targets(3, 4)
    for each in (world, twin):
        run(each, targets[:2])
    before, motion = world.state(), world.motion
    bad = targets[2].copy()
    bad[2, 7] = value
    with pytest.raises(GaitshiftError) as error:
        world.step(bad)
    assert str(error.value) == (
        "joint targets must be numbers, got NaN or infinity for BL_HFE of robot 2"
    )
    np.testing.assert_array_equal(before[0], world.state()[0])
    np.testing.assert_array_equal(before[1], world.state()[1])
    assert world.motion is motion
    assert_same_bits(run(world, targets[2:]), run(twin, targets[2:]))


def test_a_world_without_robots_is_refused():
    with pytest.raises(GaitshiftError, match="robots must be 1 or more, got 0"):
        World(ANYMAL_B, LEVEL, 0)


# Many robots, threads, terrains


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
    np.testing.assert_array_equal(world.motion.base_position_w[ids, :2], [(5, 6), (7, 8)])
    np.testing.assert_allclose(world.motion.yaw[ids], [0.4, -2.0], atol=1e-12)
    others = np.array([0, 2])
    after, expected = (run(each, targets[5:]) for each in (world, twin))
    for name, array in arrays_of(after).items():
        np.testing.assert_array_equal(array[others], arrays_of(expected)[name][others], name)


def test_placed_robots_rest_upright_with_the_lowest_foot_on_the_ground():
    joints = wild_targets(4, 1)[0]
    world = robots(4, terrain=ROUGH, joint_position=joints)
    motion = world.motion
    np.testing.assert_allclose(motion.clearance.min(axis=1), 0.0, atol=1e-12)
    np.testing.assert_array_equal(motion.joint_position, joints)
    np.testing.assert_array_equal(motion.joint_velocity, np.zeros((4, 12)))
    np.testing.assert_allclose(motion.gravity_b, np.tile([0, 0, -1], (4, 1)), atol=1e-15)


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
    motion = world.motion
    np.testing.assert_allclose(motion.joint_velocity, np.tile(same["joint_velocity"], (3, 1)))
    np.testing.assert_allclose(motion.clearance.min(axis=1), 0.0, atol=1e-12)
    # A turn by 0.3 rad about (0.6, 0.8, 0) takes the body's vertical along with it.
    upright = motion.rotation_wb[0, :, 2]
    np.testing.assert_allclose(
        upright, [0.8 * np.sin(0.3), -0.6 * np.sin(0.3), np.cos(0.3)], atol=1e-12
    )
    for target in np.repeat(wild_targets(1, 8), 3, axis=1):
        motion = world.step(target)
    ahead, aside = (
        np.einsum("in,ni->n", axis, motion.base_position_w[:, :2]) for axis in (forward, left)
    )
    np.testing.assert_allclose(ahead, ahead[0], atol=1e-4)
    np.testing.assert_allclose(aside, aside[0], atol=1e-4)
    assert ahead[0] > 0.03
    for name in ("joint_position", "base_linear_velocity_b", "gravity_b", "foot_position_b"):
        array = getattr(motion, name)
        np.testing.assert_allclose(array, np.broadcast_to(array[0], array.shape), atol=1e-3)


def test_a_robot_that_lies_on_an_edge_has_memory_for_all_of_its_contacts():
    edge = step(0.1, length=4.0, width=4.0).moved(-2.0, 0.0)
    model = build_model(ANYMAL_B, ANYMAL_B.gains_of("default"), edge)
    data, rng, most = mujoco.MjData(model), np.random.default_rng(0), 0
    full = [mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL]
    for _ in range(100):
        mujoco.mj_resetData(model, data)
        data.qpos[:3] = rng.uniform((-0.3, 0.0, -0.05), (0.3, 0.0, 0.15))
        data.qpos[3:] = rng.normal(0.0, 0.7, model.nq - 3)
        mujoco.mj_forward(model, data)
        most = max(most, data.ncon)
        assert all(data.warning[int(kind)].number == 0 for kind in full)
    assert most > 450, "431 were seen when memory ran out"


def test_robots_share_several_terrains_out_in_turn():
    """Robot i moves as it would alone on terrain i mod K, and K may exceed N."""
    grounds = [slope(8.0, length=6.0, width=6.0).moved(-3.0, 0.0), LEVEL, ROUGH]
    targets = wild_targets(5, 20)
    for n in (2, 5):
        world = robots(n, terrain=grounds)
        assert_same_bits_alone(world, grounds, targets[:, :n])
    heights = robots(3, terrain=grounds, xy=np.zeros((3, 2))).motion.base_position_w[:, 2]
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
    after = world.motion
    for name in (
        "joint_position",
        "joint_velocity",
        "base_quaternion_w",
        "base_linear_velocity_w",
        "base_angular_velocity_b",
    ):
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
    motion = stand(world, 100)
    height = np.tan(np.radians(8.0)) * (motion.foot_position_w[..., 0] + 5.0)
    assert motion.contact.all()
    np.testing.assert_allclose(motion.foot_position_w[..., 2], height, rtol=0, atol=3e-3)
