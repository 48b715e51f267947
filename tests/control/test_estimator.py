"""The estimated velocity against closed forms, physics and symmetries."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitshift.control import Estimator, EstimatorConfig
from gaitshift.control.observation import JOINT_MIRROR
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.legs import MIRRORED_LEGS
from gaitshift.robot.state import Proprioception
from sensing import DOWN, FEET, PERIOD, random_sensed, standing, tilted

REST = np.array([0.0, 0.0, 9.81])
"""What an accelerometer shows at rest on level ground [m/s²]."""
ESTIMATOR = Estimator(robot=ANYMAL_B)
IN_THE_AIR = np.zeros(4, dtype=bool)


def sensed_of(n=1, **given):
    """Robots that stand still, unless told otherwise, on legs that differ."""
    still = {
        "specific_force_b": np.tile(REST, (n, 1)),
        "angular_velocity_b": np.zeros((n, 3)),
        "joint_position": np.tile(0.1 * np.arange(12.0), (n, 1)),
    }
    return replace(standing(n), **(still | given))


def estimates(steps, *, estimator=ESTIMATOR):
    """Estimated velocities [m/s] and their deviations, a row for each step of these robots."""
    state, seen = None, []
    for sensed in steps:
        state = estimator.begin(len(sensed.contact)) if state is None else state
        state, after = estimator.step(state, sensed)
        seen.append((after.velocity_b, state.velocity_deviation))
    velocity, deviation = zip(*seen, strict=True)
    return np.array(velocity), np.array(deviation)


def wandering(seed=0, n=6, steps=30):
    """Robots of which nothing is like anything else, and none knows its velocity."""
    rng = np.random.default_rng(seed)
    for step in range(steps):
        sensed = random_sensed(rng, n, step)
        yield replace(
            sensed,
            velocity_b=None,
            foot_position_b=FEET + 0.01 * rng.normal(size=(n, 4, 3)),
            joint_position=0.3 * rng.normal(size=(n, 12)),
            specific_force_b=REST + rng.normal(size=(n, 3)),
        )


def test_a_free_fall_is_as_fast_as_gravity_makes_it():
    """An accelerometer shows nothing: v = -g t."""
    falling = sensed_of(contact=IN_THE_AIR[None], specific_force_b=np.zeros((1, 3)))
    velocity, _ = estimates([falling] * 50)
    fallen = -9.81 * PERIOD * np.arange(1, 51)
    np.testing.assert_allclose(velocity[:, 0, 2], fallen, rtol=1e-12)
    np.testing.assert_array_equal(velocity[:, 0, :2], 0.0)


def test_a_tumbling_body_in_free_fall_falls_straight_down():
    """In the body frame the fall turns; scipy turns it back. Within 1 mm/s of 4.9 m/s."""
    rate = np.array([1.0, -2.0, 3.0])
    turned = [Rotation.from_rotvec(rate * PERIOD * k) for k in range(1, 51)]
    steps = [
        sensed_of(
            contact=IN_THE_AIR[None],
            specific_force_b=np.zeros((1, 3)),
            angular_velocity_b=rate[None],
            orientation=turn.as_quat(scalar_first=True)[None],
        )
        for turn in turned
    ]
    velocity, _ = estimates(steps)
    fall = [turn.apply(seen) for turn, seen in zip(turned, velocity[:, 0], strict=True)]
    expected = np.outer(np.arange(1, 51), [0.0, 0.0, -9.81 * PERIOD])
    np.testing.assert_allclose(fall, expected, rtol=0, atol=1e-3)


def test_standing_robots_with_a_noisy_inertial_unit_do_not_drift():
    """An accelerometer that is wrong by 0.1 m/s² alone would show 2 m/s after 20 s."""
    rng, n = np.random.default_rng(0), 5
    bias = np.array([0.1, -0.1, 0.1])
    steps = (
        sensed_of(
            n,
            specific_force_b=REST + bias + 0.15 * rng.normal(size=(n, 3)),
            angular_velocity_b=0.03 * rng.normal(size=(n, 3)),
        )
        for _ in range(2000)
    )
    velocity, _ = estimates(steps)
    assert np.abs(velocity).max() < 0.05
    assert np.abs(velocity[1000:].mean(axis=0)).max() < 0.01


def swaying(seconds=3.0):
    """A base that sways and pitches over feet that stand and shanks that do not turn.

    Feet and the specific force follow from its path x(t) and pitch; HFE turns back what it pitches.
    """
    feet_w = FEET + np.array([0.0, 0.0, 0.5])
    pace = np.array([7.0, 5.0, 6.0])
    size, pitch_size = np.array([0.04, 0.03, 0.02]), 0.1
    forward = np.array([0.2, 0.0, 0.0])

    def body(time):
        pitch = pitch_size * np.sin(4.0 * time)
        return pitch, Rotation.from_euler("y", pitch)

    for k in range(1, round(seconds / PERIOD)):
        time, middle = k * PERIOD, (k - 0.5) * PERIOD
        base = [0.0, 0.0, 0.5] + forward * time + size * np.sin(pace * time)
        velocity = forward + size * pace * np.cos(pace * time)
        acceleration = -size * pace**2 * np.sin(pace * middle)
        pitch, turn = body(time)
        joints = np.zeros((4, 3))
        joints[:, 1] = -pitch
        yield (
            turn.inv().apply(velocity),
            sensed_of(
                foot_position_b=turn.inv().apply(feet_w - base)[None],
                orientation=turn.as_quat(scalar_first=True)[None],
                angular_velocity_b=np.array([[0.0, 0.4 * np.cos(4.0 * time), 0.0]]),
                specific_force_b=body(middle)[1].inv().apply(acceleration + REST)[None],
                joint_position=joints.reshape(1, 12),
            ),
        )


def test_a_base_that_sways_over_standing_feet_is_as_fast_as_its_path_says():
    """Within 1 mm/s of up to 0.5 m/s, once the first 0.5 s have shown the velocity."""
    truth, steps = zip(*swaying(), strict=True)
    velocity, _ = estimates(steps)
    np.testing.assert_allclose(velocity[50:, 0], truth[50:], rtol=0, atol=1e-3)


@pytest.mark.parametrize("radius", [0.031, 0.02])
def test_feet_that_roll_without_slip_show_the_velocity_of_the_base(radius):
    """A sphere that turns forward at Ω rolls forward at Ω r, and one that turns left moves right.

    Each foot turns by another joint; abducted by a, HFE and KFE turn it forward by cos a of theirs.
    """
    estimator = Estimator(robot=replace(ANYMAL_B, foot_radius=radius))
    moves = np.array([0.4, -0.1, 0.0])
    rates = np.zeros((4, 3))
    rates[0, 1], rates[1, 2], rates[2, 0], rates[3] = 3.0, -4.0, 2.0, (0.0, 1.0, 2.0)
    angles = np.zeros((4, 3))
    angles[3, 0] = 0.5
    rolls = radius * np.array(
        [[3.0, 0.0, 0.0], [-4.0, 0.0, 0.0], [0.0, -2.0, 0.0], [3.0 * np.cos(0.5), 0.0, 0.0]]
    )
    steps = [
        sensed_of(
            foot_position_b=(FEET + (rolls - moves) * PERIOD * k)[None],
            joint_position=(angles + rates * PERIOD * k).reshape(1, 12),
        )
        for k in range(300)
    ]
    velocity, _ = estimates(steps, estimator=estimator)
    np.testing.assert_allclose(velocity[-1, 0], moves, rtol=0, atol=1e-6)


def test_a_wheel_of_a_base_that_turns_with_it_rolls_as_far_as_its_rim():
    """A rigid robot that pitches at ω rolls on its feet: the base at height h moves at ω h."""
    rate, radius = 0.5, ANYMAL_B.foot_radius
    centre = FEET[0] + np.array([0.0, 0.0, radius])  # of the sphere, from the base
    steps, truth = [], []
    for k in range(100):
        turn = Rotation.from_euler("y", rate * PERIOD * k)
        arm = -turn.apply(centre)  # from the sphere's centre to the base
        velocity_w = np.array([radius * rate, 0.0, 0.0]) + np.cross([0.0, rate, 0.0], arm)
        truth.append(turn.inv().apply(velocity_w))
        up = turn.inv().apply([0.0, 0.0, 1.0])
        feet = np.tile(centre - radius * up, (4, 1))
        spin = np.cross([0.0, rate, 0.0], np.cross([0.0, rate, 0.0], arm))  # to the centre
        steps.append(
            sensed_of(
                foot_position_b=feet[None],
                orientation=turn.as_quat(scalar_first=True)[None],
                angular_velocity_b=np.array([[0.0, rate, 0.0]]),
                specific_force_b=turn.inv().apply(spin + REST)[None],
            )
        )
    velocity, _ = estimates(steps)
    np.testing.assert_allclose(velocity[50:, 0], truth[50:], rtol=0, atol=2e-3)


@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0])
@pytest.mark.parametrize("foot", range(4))
def test_a_foot_that_slips_is_rejected(foot, speed):
    """A quarter of its speed would be the mean of the four feet."""
    steps = []
    for k in range(160):
        feet = FEET.copy()
        feet[foot, 0] += speed * PERIOD * max(0, k - 100)
        steps.append(sensed_of(foot_position_b=feet[None]))
    velocity, _ = estimates(steps)
    assert np.abs(velocity).max() < 0.05


def test_a_foot_in_the_air_that_seems_to_touch_is_rejected():
    """After a second FR swings to and fro at 2.5 m/s, and is felt in two of three steps."""
    steps = []
    for k in range(200):
        feet, contact = FEET.copy(), np.ones(4, dtype=bool)
        if k > 100:
            feet[1, 0] += 2.5 * PERIOD * abs((k % 20) - 10)
            contact[1] = k % 3 < 2
        steps.append(sensed_of(foot_position_b=feet[None], contact=contact[None]))
    velocity, _ = estimates(steps)
    assert np.abs(velocity).max() < 0.05


def test_the_deviation_grows_in_the_air_and_shrinks_on_the_ground():
    up, down = sensed_of(contact=IN_THE_AIR[None]), sensed_of()
    _, deviation = estimates([down] * 100 + [up] * 50 + [down] * 50)
    assert (np.diff(deviation[100:150, 0]) > 0.0).all()
    assert deviation[-1, 0] < deviation[149, 0] / 2
    assert deviation[99, 0] < EstimatorConfig().start / 5


def test_the_covariance_stays_symmetric_and_positive():
    state = ESTIMATOR.begin(6)
    for sensed in wandering(steps=300):
        state, _ = ESTIMATOR.step(state, sensed)
    swapped = np.swapaxes(state.covariance, 1, 2)
    np.testing.assert_allclose(state.covariance, swapped, rtol=0, atol=1e-12)
    assert (np.linalg.eigvalsh(state.covariance) > 0.0).all()


def test_a_turn_about_the_vertical_changes_nothing():
    turn = Rotation.from_euler("z", 2.0)

    def turned(sensed):
        attitude = turn * Rotation.from_quat(sensed.orientation, scalar_first=True)
        return replace(sensed, orientation=attitude.as_quat(scalar_first=True))

    velocity, _ = estimates(wandering())
    elsewhere, _ = estimates(turned(sensed) for sensed in wandering())
    np.testing.assert_allclose(elsewhere, velocity, rtol=0, atol=1e-12)


def test_the_order_of_robots_changes_no_bit():
    order = np.array([4, 0, 5, 2, 1, 3])
    velocity, deviation = estimates(wandering())
    ordered = estimates(sensed.robots(order) for sensed in wandering())
    np.testing.assert_array_equal(ordered[0], velocity[:, order])
    np.testing.assert_array_equal(ordered[1], deviation[:, order])


def test_the_mirror_image_of_a_robot_has_the_mirror_image_of_its_velocity():
    legs, across = list(MIRRORED_LEGS), np.array([1.0, -1.0, 1.0])
    joints, signs = map(list, JOINT_MIRROR)

    def mirrored(sensed):
        return Proprioception(
            contact=sensed.contact[:, legs],
            foot_position_b=across * sensed.foot_position_b[:, legs],
            orientation=np.array([1.0, -1.0, 1.0, -1.0]) * sensed.orientation,
            joint_position=np.array(signs) * sensed.joint_position[:, joints],
            angular_velocity_b=-across * sensed.angular_velocity_b,
            specific_force_b=across * sensed.specific_force_b,
        )

    velocity, _ = estimates(wandering())
    image, _ = estimates(mirrored(sensed) for sensed in wandering())
    np.testing.assert_allclose(image, across * velocity, rtol=0, atol=1e-12)
    assert np.abs(velocity[..., 1]).max() > 0.1


def test_a_robot_that_restarts_is_as_good_as_new_and_the_others_go_on():
    steps, ids = list(wandering(steps=20)), np.array([1, 4])
    state = ESTIMATOR.begin(6)
    for sensed in steps[:10]:
        state, _ = ESTIMATOR.step(state, sensed)
    state = state.with_robots(ids, ESTIMATOR.begin(2))
    for sensed in steps[10:]:
        state, after = ESTIMATOR.step(state, sensed)
    unbroken, _ = estimates(steps)
    new, _ = estimates(sensed.robots(ids) for sensed in steps[10:])
    others = np.setdiff1d(np.arange(6), ids)
    np.testing.assert_array_equal(after.velocity_b[others], unbroken[-1, others])
    np.testing.assert_allclose(after.velocity_b[ids], new[-1], rtol=0, atol=1e-12)


def test_a_step_changes_neither_the_state_nor_what_was_sensed():
    first, second = list(wandering(steps=2))
    state, _ = ESTIMATOR.step(ESTIMATOR.begin(6), first)
    kept = {name: np.copy(value) for name, value in vars(state).items()}
    after, _ = ESTIMATOR.step(state, second)
    after.covariance[:] = after.velocity_b[:] = after.foot_b[:] = 7.0
    for name, value in kept.items():
        np.testing.assert_array_equal(getattr(state, name), value, err_msg=name)
    assert second.velocity_b is None


def test_a_tilted_robot_at_rest_is_at_rest():
    """Its accelerometer shows g along the vertical, wherever that is in the body."""
    gravity = DOWN + np.array([0.3, -0.2, 0.0])
    gravity /= np.linalg.norm(gravity)
    resting = sensed_of(specific_force_b=-9.81 * gravity[None])
    velocity, _ = estimates([tilted(resting, gravity[None])] * 100)
    np.testing.assert_allclose(velocity, 0.0, atol=1e-12)


@pytest.mark.parametrize("name", ["specific_force_b", "angular_velocity_b", "joint_position"])
def test_what_it_needs_is_named(name):
    with pytest.raises(GaitshiftError, match=name):
        ESTIMATOR.step(ESTIMATOR.begin(1), sensed_of(**{name: None}))


def test_noise_out_of_range_is_refused():
    with pytest.raises(GaitshiftError, match="gate"):
        EstimatorConfig(gate=0.0)
