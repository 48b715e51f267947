"""Sensors with errors: against the closed forms of each error, and the truth without them."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.kinematics import LegKinematics
from gaitshift.robot.state import Privileged, Proprioception
from gaitshift.sim.sensor_config import ANYMAL, CHEAP, PERFECT, SensorConfig
from gaitshift.sim.sensors import Sensors
from worlds import (
    GRAVITY,
    PERIOD,
    ROUGH,
    STANCE,
    assert_same_bits,
    attitude_of,
    fly,
    robots,
    run,
    stand,
    throw_apart,
    wild_targets,
)

UNSEEN = SensorConfig(measures_velocity=False)
"""No errors, but a robot's sensors: nothing gives the velocity."""
DOWN = np.array([True, False, True, False])
"""Feet on the ground in `records`."""


def records(n, *, velocity_w=(0.0, 0.0, 0.0), attitude=None, joints=STANCE):
    """Perfect records of n robots, without a simulator; two feet bear 150 N, two are in the air."""
    attitude = Rotation.identity() if attitude is None else attitude
    quaternion = np.broadcast_to(attitude.as_quat(scalar_first=True), (n, 4)).copy()
    velocity_b = np.broadcast_to(attitude.inv().apply(velocity_w), (n, 3)).copy()
    joints = np.broadcast_to(joints, (n, 12)).copy()
    ideal = Proprioception(
        contact=np.tile(DOWN, (n, 1)),
        foot_position_b=np.zeros((n, 4, 3)),
        orientation=quaternion,
        joint_position=joints,
        joint_velocity=np.zeros((n, 12)),
        joint_torque=np.tile(np.arange(12.0), (n, 1)),
        velocity_b=velocity_b,
        angular_velocity_b=np.tile([0.1, -0.2, 0.3], (n, 1)),
        mass=30.0,
    )
    truth = Privileged(
        base_position_w=np.zeros((n, 3)),
        base_quaternion_w=quaternion,
        velocity_b=velocity_b,
        foot_position_w=np.zeros((n, 4, 3)),
        foot_velocity_w=np.zeros((n, 4, 3)),
        foot_force=np.tile(np.where(DOWN, 150.0, 0.0), (n, 1)),
        clearance=np.zeros((n, 4)),
        body_contact=np.zeros(n, dtype=bool),
        diverged=np.zeros(n, dtype=bool),
    )
    return ideal, truth


def sensors(n, config, *, seed=0, at=None):
    made = Sensors(config, ANYMAL_B, n, np.random.default_rng(seed))
    first = made.restart(np.arange(n), *(at or records(n)))
    return made, first


def watched(config, *, n=500, steps=40, seed=0):
    """What n robots that stay where they are sense in some steps (T, N)."""
    made, _ = sensors(n, config, seed=seed)
    return Proprioception.stack([made.step(*records(n)) for _ in range(steps)])


@pytest.mark.parametrize(
    ("setting", "field", "true"),
    [
        ("encoder_noise", "joint_position", STANCE),
        ("joint_velocity_noise", "joint_velocity", 0.0),
        ("gyro_noise", "angular_velocity_b", [0.1, -0.2, 0.3]),
        ("accelerometer_noise", "specific_force_b", [0.0, 0.0, GRAVITY]),
    ],
)
def test_noise_is_white_and_has_its_standard_deviation(setting, field, true):
    """On each channel alone; the other fields of a robot that stays where it is are exact."""
    seen = watched(SensorConfig(**{setting: 0.07}))
    error = getattr(seen, field) - np.asarray(true)
    count = error[..., 0].size
    np.testing.assert_allclose(error.std(axis=(0, 1)), 0.07, rtol=5 / np.sqrt(2 * count))
    np.testing.assert_allclose(error.mean(axis=(0, 1)), 0.0, atol=5 * 0.07 / np.sqrt(count))
    flat = error.reshape(-1, error.shape[-1])
    channels = np.corrcoef(flat.T) - np.eye(flat.shape[1])
    assert np.abs(channels).max() < 5 / np.sqrt(count)
    follows = (error[1:] * error[:-1]).mean() / 0.07**2
    assert abs(follows) < 5 / np.sqrt(error[1:].size)
    for other in ("joint_position", "joint_velocity", "specific_force_b"):
        if other != field:
            assert np.ptp(getattr(seen, other), axis=(0, 1)).max() < 1e-12, other


def test_rounding_of_angles_is_uniform_with_a_variance_of_a_twelfth_of_the_step_squared():
    """Of angles at random, on all joints."""
    step, n = 0.02, 4000
    joints = np.random.default_rng(8).uniform(-1.0, 1.0, (n, 12))
    _, seen = sensors(n, SensorConfig(encoder_step=step), at=records(n, joints=joints))
    error = seen.joint_position - joints
    assert np.abs(error).max() <= step / 2 + 1e-15
    np.testing.assert_allclose(error.var(axis=0), step**2 / 12, rtol=0.1)
    np.testing.assert_allclose(error.var(), step**2 / 12, rtol=0.02)
    whole = seen.joint_position / step
    np.testing.assert_allclose(whole, np.round(whole), rtol=0, atol=1e-9)


def test_the_bias_of_the_gyro_walks_with_a_variance_that_grows_as_time():
    """b² + σ² t on each axis, after 0, 0.3 and 0.6 s."""
    start, walk, n = 0.02, 0.05, 3000
    made, first = sensors(n, SensorConfig(gyro_bias=start, gyro_bias_walk=walk))
    ideal, truth = records(n)
    seen = [first] + [made.step(ideal, truth) for _ in range(60)]
    for step in (0, 30, 60):
        bias = seen[step].angular_velocity_b - ideal.angular_velocity_b
        expected = start**2 + walk**2 * step * PERIOD
        np.testing.assert_allclose(bias.var(axis=0), expected, rtol=5 * np.sqrt(2 / n))


def test_the_bias_of_the_accelerometer_stays_and_differs_from_robot_to_robot():
    n = 2000
    made, first = sensors(n, SensorConfig(accelerometer_bias=0.3))
    bias = first.specific_force_b - [0.0, 0.0, GRAVITY]
    np.testing.assert_allclose(bias.std(axis=0), 0.3, rtol=5 / np.sqrt(2 * n))
    later = [made.step(*records(n)) for _ in range(20)][-1]
    np.testing.assert_allclose(later.specific_force_b, first.specific_force_b, rtol=0, atol=1e-12)


def test_an_accelerometer_at_rest_shows_gravity_upwards_in_the_body():
    attitude = Rotation.from_euler("ZYX", [2.0, 0.3, -0.5])
    made, first = sensors(2, UNSEEN, at=records(2, attitude=attitude))
    expected = np.tile(attitude.inv().apply([0.0, 0.0, GRAVITY]), (2, 1))
    for seen in (first, made.step(*records(2, attitude=attitude))):
        np.testing.assert_allclose(seen.specific_force_b, expected, rtol=0, atol=1e-12)


def test_an_accelerometer_in_free_fall_shows_nothing_and_in_a_push_the_push():
    made, _ = sensors(2, UNSEEN)
    for step in range(1, 5):
        fell = made.step(*records(2, velocity_w=(1.0, 0.0, -GRAVITY * step * PERIOD)))
        if step > 1:  # in the first step the forward speed jumps
            np.testing.assert_allclose(fell.specific_force_b, 0.0, atol=1e-12)
    attitude = Rotation.from_euler("Z", np.pi / 2)
    made, _ = sensors(1, UNSEEN, at=records(1, attitude=attitude))
    pushed = made.step(*records(1, velocity_w=(0.04, 0.0, 0.0), attitude=attitude))
    np.testing.assert_allclose(pushed.specific_force_b[0], [0.0, -4.0, GRAVITY], rtol=0, atol=1e-9)


def test_a_robot_in_flight_feels_no_force_but_that_of_its_own_legs():
    """With still joints the base falls freely: nothing on the accelerometer."""
    world = fly(2, sensors=UNSEEN)
    stand(world, 25)
    assert not world.sensed.contact.any()
    force = [stand(world, 1)[0].specific_force_b for _ in range(15)]
    assert np.abs(np.mean(force, axis=0)).max() < 0.1


def test_the_accelerometer_integrates_to_the_velocity_of_the_base():
    """In the world, over a run with wild targets on rough ground, each at its step's middle."""
    world = robots(3, terrain=ROUGH, sensors=UNSEEN)
    before = attitude_of(world.truth)
    velocity = before.apply(world.truth.velocity_b)
    for target in wild_targets(3, 80):
        sensed, truth = world.step(target)
        after = attitude_of(truth)
        turn = (before.inv() * after).as_rotvec()
        middle = before * Rotation.from_rotvec(0.5 * turn)
        force_w = middle.apply(sensed.specific_force_b)
        velocity = velocity + (force_w - [0.0, 0.0, GRAVITY]) * PERIOD
        before = after
    true = after.apply(truth.velocity_b)
    assert np.abs(true).max() > 0.05
    np.testing.assert_allclose(velocity, true, rtol=0, atol=1e-4)


def test_an_attitude_filter_at_rest_ends_with_the_measured_force_as_its_vertical():
    """A tilt of bias over gravity, after 8 s with time constant 0.5 s, whatever the bias."""
    made, _ = sensors(50, SensorConfig(accelerometer_bias=0.2, attitude_time=0.5))
    for _ in range(800):
        seen = made.step(*records(50))
    force = seen.specific_force_b
    up = force / np.linalg.norm(force, axis=1, keepdims=True)
    np.testing.assert_allclose(-seen.gravity_b, up, rtol=0, atol=1e-5)
    assert up[:, :2].std() == pytest.approx(0.2 / GRAVITY, rel=0.3)


def test_the_yaw_drifts_by_the_bias_of_the_gyro():
    made, first = sensors(50, SensorConfig(gyro_bias=0.02))
    for _ in range(300):
        seen = made.step(*records(50))
    bias = first.angular_velocity_b - [0.1, -0.2, 0.3]
    level = np.abs(bias[:, :2]).max(axis=1) < 0.02  # a tumble about other axes is no yaw
    np.testing.assert_allclose(seen.yaw[level], 3.0 * bias[level, 2], rtol=0, atol=3e-3)
    assert level.sum() > 10
    assert seen.has_heading


@pytest.mark.parametrize("lasting", [0.01, 0.04])
def test_contacts_are_missed_and_false_at_their_rates_and_for_their_time(lasting):
    """Shares within five standard errors of as many independent errors; runs of the mean length."""
    missed, false, n, steps = 0.05, 0.02, 400, 250
    config = SensorConfig(contact_missed=missed, contact_false=false, contact_error_time=lasting)
    made, _ = sensors(n, config)
    seen = np.stack([made.step(*records(n)).contact for _ in range(steps)])
    wrong = seen != DOWN
    length = lasting / PERIOD
    for feet, share in ((DOWN, missed), (~DOWN, false)):
        errors = wrong[..., feet]
        begun = (errors[1:] & ~errors[:-1]).sum()
        deviation = np.sqrt(share * 2 * length / errors.size)
        assert errors.mean() == pytest.approx(share, abs=5 * deviation)
        if length > 1:  # else an error can begin as another ends
            assert errors[1:].sum() / begun == pytest.approx(length, rel=0.1)
        assert errors[0].mean() == pytest.approx(share, abs=5 * np.sqrt(share / errors[0].size))


def test_a_foot_is_felt_above_the_threshold():
    made, _ = sensors(1, SensorConfig(contact_threshold=20.0))
    ideal, truth = records(1)
    weak = replace(truth, foot_force=np.array([[19.9, 20.1, 0.0, 400.0]]))
    np.testing.assert_array_equal(made.step(ideal, weak).contact, [[False, True, False, True]])


def test_sensors_without_errors_show_the_truth_without_the_velocity():
    """Through kinematics and integrated turns, on rough ground with wild targets."""
    world, perfect = (robots(4, terrain=ROUGH, sensors=s) for s in (UNSEEN, PERFECT))
    for target in wild_targets(4, 60):
        sensed, expected = world.step(target)[0], perfect.step(target)[0]
    assert sensed.velocity_b is None
    for name in (
        "joint_position",
        "joint_velocity",
        "joint_torque",
        "angular_velocity_b",
        "contact",
    ):
        np.testing.assert_array_equal(getattr(sensed, name), getattr(expected, name), err_msg=name)
    for name in ("rotation", "foot_position_b", "foot_height", "yaw"):
        seen, true = getattr(sensed, name), getattr(expected, name)
        np.testing.assert_allclose(seen, true, rtol=0, atol=1e-9, err_msg=name)
    assert sensed.mass == expected.mass


def test_feet_are_where_the_measured_angles_and_the_estimated_vertical_put_them():
    """The lowest point of a ball is one radius below its middle, by what the robot believes."""
    world = robots(3, sensors=CHEAP)
    sensed, truth = run(world, wild_targets(3, 30))
    feet = LegKinematics.of(ANYMAL_B).foot_centre_b(sensed.joint_position)
    below = sensed.foot_position_b - feet
    np.testing.assert_allclose(
        below, np.repeat(0.031 * sensed.gravity_b[:, None], 4, axis=1), rtol=0, atol=1e-12
    )
    true = truth.foot_position_w - truth.base_position_w[:, None]
    error = sensed.foot_position_b - np.stack(
        [attitude_of(truth).inv().apply(true[:, leg]) for leg in range(4)], axis=1
    )
    assert 1e-4 < np.abs(error).max() < 0.05  # 0.6 m of leg times 0.006 rad, several sd


@pytest.mark.parametrize("config", [ANYMAL, CHEAP], ids=lambda config: config.name)
def test_the_same_seed_gives_the_same_bits_on_any_number_of_threads(config):
    targets = wild_targets(5, 25)
    once, again, other = (
        robots(5, terrain=ROUGH, sensors=config, threads=threads, seed=seed)
        for threads, seed in ((1, 6), (2, 6), (1, 7))
    )
    for world in (once, again, other):
        run(world, targets)
    assert_same_bits([once.sensed, once.truth], [again.sensed, again.truth])
    assert (once.sensed.joint_position != other.sensed.joint_position).any()
    assert (once.truth.base_position_w != other.truth.base_position_w).any()


def test_perfect_sensors_draw_nothing_whatever_the_seed():
    targets = wild_targets(3, 25)
    assert_same_bits(run(robots(3), targets), run(robots(3, seed=9), targets))


def test_a_robot_that_restarts_gets_another_unit_and_the_others_keep_what_they_sensed():
    """Its biases are drawn anew; nothing of the others has moved, so nothing is measured."""
    world = robots(4, sensors=replace(ANYMAL, gyro_noise=0.0, gyro_bias_walk=0.0))
    run(world, wild_targets(4, 10))
    before = world.sensed
    bias = before.angular_velocity_b - world.ideal.angular_velocity_b
    ids, others = np.array([1, 3]), np.array([0, 2])
    world.place(ids, xy=np.ones((2, 2)), yaw=np.array([0.5, -1.0]))
    assert_same_bits([world.sensed.robots(others)], [before.robots(others)])
    after = world.sensed.angular_velocity_b - world.ideal.angular_velocity_b
    np.testing.assert_allclose(after[others], bias[others], rtol=0, atol=1e-12)
    assert (np.abs(after - bias)[ids] > 1e-7).all()
    np.testing.assert_allclose(world.sensed.yaw[ids], [0.5, -1.0], rtol=0, atol=1e-12)
    force = world.sensed.specific_force_b[ids]
    assert np.abs(force - [0.0, 0.0, GRAVITY]).max() < 6 * 0.05 + 6 * 0.034


def test_a_robot_that_diverges_does_not_stop_the_sensors_of_the_others():
    """Their step goes on: without errors they show the truth, and the lost robot stands again."""
    world = robots(3, terrain=ROUGH, sensors=UNSEEN)
    targets = wild_targets(3, 40)
    run(world, targets[:20])
    throw_apart(world, 1)
    for target in targets[20:]:
        sensed, truth = world.step(target)
        np.testing.assert_allclose(
            sensed.rotation, attitude_of(truth).as_matrix(), rtol=0, atol=1e-9
        )
        assert np.isfinite(sensed.specific_force_b).all()
        assert np.abs(sensed.specific_force_b[1]).max() < 1000.0
    assert len(world.divergences) == 1
