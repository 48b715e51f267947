"""What is measured: frames, freshness, ownership; against scipy, MuJoCo and invariances."""

from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.legs import LEGS
from worlds import (
    PERIOD,
    ROUGH,
    STANCE,
    UP,
    arrays_of,
    assert_same_bits,
    attitude_of,
    fly,
    place,
    plain,
    robots,
    run,
    stand,
    velocity_w,
    wild_targets,
)


def tumbled(turn=None, shift=(0.0, 0.0)):
    """40 robots of random attitude and velocities, all turned and moved together."""
    rng = np.random.default_rng(3)
    turn = Rotation.identity() if turn is None else turn
    xy, velocity = rng.normal(size=(40, 2)), rng.normal(size=(40, 3))
    quaternion = rng.normal(size=(40, 4))
    attitude = turn * Rotation.from_quat(quaternion, scalar_first=True)
    return robots(
        40,
        xy=turn.apply(np.column_stack([xy, np.zeros(40)]))[:, :2] + np.array(shift),
        yaw=np.zeros(40),
        attitude=attitude.as_quat(scalar_first=True),
        base_velocity_w=turn.apply(velocity),
        base_angular_velocity_b=rng.normal(size=(40, 3)),
        joint_position=STANCE + rng.normal(0.0, 0.2, (40, 12)),
    )


def test_rotation_agrees_with_scipy():
    world = tumbled()
    np.testing.assert_allclose(
        world.sensed.rotation, attitude_of(world.truth).as_matrix(), rtol=0, atol=1e-14
    )


def test_body_frame_quantities_agree_with_scipy():
    world = tumbled()
    sensed, truth, (qpos, qvel) = world.sensed, world.truth, world.state()
    into_body = Rotation.from_quat(qpos[:, 3:7], scalar_first=True).inv()
    velocity, gravity = into_body.apply(qvel[:, :3]), np.tile([0.0, 0.0, -1.0], (40, 1))
    np.testing.assert_allclose(truth.velocity_b, velocity, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(sensed.velocity_b, truth.velocity_b)
    np.testing.assert_allclose(sensed.gravity_b, into_body.apply(gravity), rtol=0, atol=1e-14)
    for leg in range(4):
        offset = truth.foot_position_w[:, leg] - truth.base_position_w
        np.testing.assert_allclose(
            sensed.foot_position_b[:, leg], into_body.apply(offset), rtol=0, atol=1e-14
        )
    heading = attitude_of(truth).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(sensed.yaw, heading, rtol=0, atol=1e-12)


def test_heights_of_the_feet_are_their_heights_in_the_world_above_the_base():
    """Within 1e-12: through the body's frame and back."""
    world = tumbled()
    above = world.truth.foot_position_w[..., 2] - world.truth.base_position_w[:, 2, None]
    np.testing.assert_allclose(world.sensed.foot_height, above, rtol=0, atol=1e-12)
    np.testing.assert_allclose(world.sensed.base_height, -above.min(axis=1), rtol=0, atol=1e-12)


def test_body_frame_quantities_do_not_see_heading_and_place():
    """Turned about the vertical and moved along the ground, only yaw changes, by the turn."""
    world = tumbled()
    moved = tumbled(Rotation.from_euler("Z", 2.0), (30.0, -7.0))
    for name in ("velocity_b", "gravity_b", "foot_position_b", "base_height"):
        seen, expected = getattr(moved.sensed, name), getattr(world.sensed, name)
        np.testing.assert_allclose(seen, expected, rtol=0, atol=1e-12, err_msg=name)
    difference = moved.sensed.yaw - world.sensed.yaw - 2.0
    np.testing.assert_allclose(np.sin(difference / 2), 0.0, atol=1e-12)


HEADING_FREE = (
    "joint_position",
    "joint_velocity",
    "joint_torque",
    "angular_velocity_b",
    "velocity_b",
    "gravity_b",
    "foot_position_b",
    "clearance",
    "contact",
)
"""What a robot's heading and place on level ground must not change."""


def spread_of(world, name):
    """Largest difference between robot 0 and the others."""
    value = getattr(world.truth if name == "clearance" else world.sensed, name).astype(float)
    return np.abs(value - value[:1]).max()


def test_flight_does_not_depend_on_heading_and_place():
    """Same targets, four headings: the same in the body frame, turned in the world frame."""
    yaw, xy = [0.0, 0.3, 1.9, -2.5], [(0, 0), (30, -20), (-4, 9), (1, 1)]
    world = fly(4, xy=xy, yaw=yaw)
    sensed, truth = run(world, np.tile(wild_targets(1, 35), (1, 4, 1)))
    for name in HEADING_FREE:
        assert spread_of(world, name) < 1e-9, name
    turn = Rotation.from_rotvec(np.outer(yaw, [0, 0, 1]))
    for name in ("foot_velocity_w", "foot_position_w"):
        value = getattr(truth, name)
        value = value - np.array([[*p, 0.0] for p in xy])[:, None] * (name == "foot_position_w")
        expected = np.stack([turn.apply(np.tile(v, (4, 1))) for v in value[0]], axis=1)
        np.testing.assert_allclose(value, expected, rtol=0, atol=1e-9, err_msg=name)
    assert not sensed.contact.any()


def test_standing_does_not_depend_on_quarter_turns_and_place():
    """Within 1e-3 [rad, m, m/s]: friction is solved to a tolerance, and slides amplify it.

    Forces and torques follow from the tiny penetrations and are left out.
    """
    yaw = np.array([0.0, 0.5, 1.0, -0.5]) * np.pi
    world = robots(4, xy=[(0, 0), (30, -20), (-4, 9), (1, 1)], yaw=yaw)
    stand(world, 50)
    for name in ("joint_position", "gravity_b", "foot_position_b", "clearance", "contact"):
        assert spread_of(world, name) < 1e-3, name


def test_standing_does_not_depend_on_any_turn():
    world = robots(4, xy=np.zeros((4, 2)), yaw=[0.0, 0.3, 0.785, -2.0])
    stand(world, 100)
    assert spread_of(world, "joint_position") < 1e-3


def test_velocities_are_rates_of_positions():
    """Over one control step, against the mean of the velocities at its ends.

    The base origin and the feet in the world frame, the turn in the body frame.
    """
    world = fly(3, yaw=[0.5, 2.0, -1.0])
    time, phase = PERIOD * np.arange(40)[:, None, None], np.arange(36).reshape(3, 12)
    swings = STANCE + np.minimum(2.0 * time, 0.3) * np.sin(10.0 * time + phase)
    for (sensed, before), (later, after) in pairwise(world.step(target) for target in swings):
        for position, velocity, tolerance in (
            (lambda t: t.base_position_w, velocity_w, 0.05),
            (lambda t: t.foot_position_w, lambda t: t.foot_velocity_w, 0.2),
        ):
            rate = (position(after) - position(before)) / PERIOD
            mean = (velocity(after) + velocity(before)) / 2
            np.testing.assert_allclose(rate, mean, rtol=0, atol=tolerance)
        turn = (attitude_of(before).inv() * attitude_of(after)).as_rotvec() / PERIOD
        mean = (sensed.angular_velocity_b + later.angular_velocity_b) / 2
        np.testing.assert_allclose(turn, mean, rtol=0, atol=0.05)


def test_nothing_measured_is_a_step_late():
    """Positions and velocities are those that MuJoCo computes anew from the present state."""
    world = robots(2, terrain=ROUGH)
    for target in wild_targets(2, 20):
        sensed, truth = world.step(target)
        for i in range(2):
            data = plain(world, i)
            np.testing.assert_array_equal(sensed.joint_position[i], data.qpos[7:])
            np.testing.assert_array_equal(sensed.joint_velocity[i], data.qvel[6:])
            np.testing.assert_array_equal(truth.base_position_w[i], data.xpos[1])
            for leg, name in enumerate(LEGS):
                lowest = data.site(f"{name}_foot").xpos - (0.0, 0.0, ANYMAL_B.foot_radius)
                np.testing.assert_allclose(
                    truth.foot_position_w[i, leg], lowest, rtol=0, atol=1e-12
                )
                velocity = data.sensor(f"{name}_velocity").data
                np.testing.assert_allclose(
                    truth.foot_velocity_w[i, leg], velocity, rtol=0, atol=1e-12
                )


def test_what_was_measured_does_not_change_when_the_world_moves_on():
    world = robots(3)
    measured = run(world, wild_targets(3, 5))
    kept = {name: array.copy() for name, array in arrays_of(*measured).items()}
    world.push(np.full((3, 3), 40.0))
    run(world, wild_targets(3, 5, seed=1))
    place(world, base_velocity_w=UP)
    world.set_terrain(ROUGH)
    run(world, wild_targets(3, 5, seed=2))
    for name, array in arrays_of(*measured).items():
        np.testing.assert_array_equal(array, kept[name], err_msg=name)


def test_a_world_does_not_change_when_what_it_measured_is_written_to():
    spoilt, untouched = (robots(2) for _ in range(2))
    for array in (*arrays_of(*stand(spoilt, 5)).values(), *spoilt.state()):
        array[:] = 1
    stand(untouched, 5)
    assert_same_bits(stand(spoilt, 5), stand(untouched, 5))
