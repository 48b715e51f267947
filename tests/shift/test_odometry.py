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
