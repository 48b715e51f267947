"""Leg odometry against where the base went, and against a body in free flight."""

from dataclasses import replace

import numpy as np

from gaitshift.shift import LegOdometry
from sensing import FEET, PERIOD, standing, strolling

ALL_DOWN = np.ones((1, 4), dtype=bool)


def test_odometry_by_the_standing_feet_is_where_the_base_went():
    odometry = LegOdometry()
    state, first = odometry.start(1), None
    for base, sensed in strolling(lambda x, y: 0.1 * x + 0.05 * y):
        state, _ = odometry.step(state, sensed)
        first = base - state.base[0] if first is None else first
        np.testing.assert_allclose(state.base[0] + first, base, atol=0.03)


def test_a_foot_that_is_felt_in_its_swing_does_not_carry_the_base():
    """The other feet show 1 m/s; the swinging one is felt for 30 ms every 0.2 s."""
    for false in (False, True):
        odometry = LegOdometry(agreement=1.0)
        state, first = odometry.start(1), None
        for step, (base, sensed) in enumerate(strolling(lambda x, y: 0.0, turn=0.0, wobble=0.0)):
            felt = sensed.contact | (np.arange(4) == (step // 20) % 4) * (
                false and step > 20 and step % 20 < 3
            )
            state, _ = odometry.step(state, replace(sensed, contact=felt))
            first = base - state.base[0] if first is None else first
        assert np.linalg.norm(state.base[0] + first - base) < 0.03, false


def test_odometry_finds_back_to_feet_that_stand():
    """A robot that is carried away at 3 m/s, with one foot down, is followed after 0.3 s."""
    odometry, one = LegOdometry(agreement=1.0), np.array([[True, False, False, False]])
    state = odometry.start(1)
    for _ in range(20):
        state, _ = odometry.step(state, standing())
    for step in range(60):
        feet = (FEET - step * PERIOD * np.array([3.0, 0.0, 0.0]))[None]
        before = state
        state, _ = odometry.step(state, replace(standing(), contact=one, foot_position_b=feet))
    np.testing.assert_allclose(state.base - before.base, [[3.0 * PERIOD, 0.0, 0.0]], atol=1e-9)


def test_a_flight_is_a_parabola():
    """Thrown up at 1 m/s a base is back where it was after 2 / 9.81 s, as far on as its speed."""
    odometry = LegOdometry(smoothing=PERIOD)
    state = odometry.start(1)
    rising = np.array([0.5, 0.0, 1.0]) * PERIOD
    for step in range(30):
        feet = (FEET - step * rising)[None]
        state, _ = odometry.step(state, replace(standing(), foot_position_b=feet))
    lifted, flight = state.base[0], round(2 / 9.81 / PERIOD)
    for _ in range(flight):
        state, _ = odometry.step(state, replace(standing(), contact=~ALL_DOWN))
    np.testing.assert_allclose(state.base[0] - lifted, [0.5 * flight * PERIOD, 0, 0], atol=0.01)
