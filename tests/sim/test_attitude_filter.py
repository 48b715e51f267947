"""The attitude filter: against scipy's rotations and the closed forms of its errors."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from gaitshift.sim.attitude_filter import filtered, product, quaternion_of, turn_between
from turning import rotation

GRAVITY, PERIOD = 9.81, 0.01
REST = np.array([0.0, 0.0, GRAVITY])
TILTS = np.array([[0.03, 0.0], [0.0, -0.02], [-0.015, 0.025]])
"""Roll and pitch [rad], small enough for closed forms to first order."""


def settle(orientation, rate_b, force_b, seconds, tau):
    for _ in range(round(seconds / PERIOD)):
        orientation = filtered(orientation, rate_b, force_b, time_constant=tau, period=PERIOD)
    return orientation


def angles(orientation):
    """Roll, pitch and yaw [rad]."""
    return Rotation.from_quat(orientation, scalar_first=True).as_euler("ZYX")[:, ::-1]


def level(n):
    return np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))


def tilted(tilts, yaw=0.4):
    turns = np.stack([rotation(roll, pitch, yaw) for roll, pitch in tilts])
    return Rotation.from_matrix(turns).as_quat(scalar_first=True)


def test_quaternions_are_those_of_scipy():
    rng = np.random.default_rng(1)
    first, second = Rotation.random(50, rng=rng), Rotation.random(50, rng=rng)
    one, two = (turn.as_quat(scalar_first=True) for turn in (first, second))
    both = Rotation.from_quat(product(one, two), scalar_first=True)
    np.testing.assert_allclose(both.as_matrix(), (first * second).as_matrix(), rtol=0, atol=1e-14)
    vectors = np.concatenate(
        [rng.normal(size=(40, 3)), 1e-9 * rng.normal(size=(9, 3)), [[0.0] * 3]]
    )
    made = Rotation.from_quat(quaternion_of(vectors), scalar_first=True)
    expected = Rotation.from_rotvec(vectors).as_matrix()
    np.testing.assert_allclose(made.as_matrix(), expected, rtol=0, atol=1e-14)


def test_the_turn_between_two_orientations_is_that_of_scipy():
    """Also of equal ones, of hardly different ones, and whichever sign their quaternions have."""
    rng = np.random.default_rng(2)
    first = Rotation.random(60, rng=rng)
    vectors = np.concatenate(
        [rng.normal(size=(40, 3)), 1e-8 * rng.normal(size=(19, 3)), [[0.0] * 3]]
    )
    second = first * Rotation.from_rotvec(vectors)
    signs = rng.choice([-1.0, 1.0], (60, 1))
    turn = turn_between(first.as_quat(scalar_first=True), signs * second.as_quat(scalar_first=True))
    expected = (first.inv() * second).as_rotvec()
    np.testing.assert_allclose(turn, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize("tau", [0.5, 2.0])
def test_an_error_of_tilt_at_rest_decays_with_the_time_constant(tau):
    """exp(-t/τ), at any heading, which stays."""
    start = tilted(TILTS)
    after = angles(settle(start, np.zeros((3, 3)), np.tile(REST, (3, 1)), 1.0, tau))
    np.testing.assert_allclose(after[:, :2], TILTS * np.exp(-1.0 / tau), rtol=0, atol=3e-4)
    np.testing.assert_allclose(after[:, 2], 0.4, rtol=0, atol=5e-4)


def test_a_bias_of_the_gyro_tilts_by_bias_times_time_constant_and_turns_for_ever():
    bias = np.array([[0.01, 0.0, 0.0], [0.0, -0.02, 0.0], [0.0, 0.0, 0.03]])
    tau, seconds = 0.5, 8.0
    after = angles(settle(level(3), bias, np.tile(REST, (3, 1)), seconds, tau))
    np.testing.assert_allclose(after[:2, :2], bias[:2, :2] * tau, rtol=0, atol=2e-4)
    np.testing.assert_allclose(after[2], [0.0, 0.0, 0.03 * seconds], rtol=0, atol=1e-9)


def test_a_bias_of_the_accelerometer_tilts_by_bias_over_gravity():
    """To the side that takes the specific force for the vertical."""
    bias = np.array([[0.2, 0.0, 0.0], [0.0, 0.3, 0.0]])
    after = angles(settle(level(2), np.zeros((2, 3)), REST + bias, 8.0, 0.5))
    expected = np.array([[0.0, -0.2 / GRAVITY], [0.3 / GRAVITY, 0.0]])
    np.testing.assert_allclose(after[:, :2], expected, rtol=0, atol=2e-4)


def test_accelerations_that_cancel_over_a_stride_leave_no_tilt():
    """Hard ones, in a single step of ten, and the opposite in the other nine."""
    orientation, tau = level(1), 2.0
    errors = []
    for step in range(2000):
        pushed = 27.0 if step % 10 == 0 else -3.0
        force = np.array([[pushed, -pushed, GRAVITY]])
        orientation = filtered(
            orientation, np.zeros((1, 3)), force, time_constant=tau, period=PERIOD
        )
        errors.append(angles(orientation)[0, :2])
    assert np.abs(np.mean(errors[1000:], axis=0)).max() < 1e-2 * 27.0 / GRAVITY


def test_in_free_fall_and_without_an_accelerometer_the_gyro_alone_counts():
    """A tumble at a steady rate is integrated exactly."""
    rate, steps = np.array([[1.0, -2.0, 0.5], [0.0, 3.0, 1.0]]), 150
    start = tilted(TILTS[:2])
    wrong = np.array([[5.0, -3.0, 2.0], [9.81, 0.0, 0.0]])
    spun = Rotation.from_quat(start, scalar_first=True) * Rotation.from_rotvec(
        rate * steps * PERIOD
    )
    for force, tau in ((np.zeros((2, 3)), 0.5), (wrong, np.inf)):
        after = settle(start, rate, force, steps * PERIOD, tau)
        seen = Rotation.from_quat(after, scalar_first=True).as_matrix()
        np.testing.assert_allclose(seen, spun.as_matrix(), rtol=0, atol=1e-12)
        np.testing.assert_allclose(np.linalg.norm(after, axis=1), 1.0, rtol=0, atol=1e-14)
