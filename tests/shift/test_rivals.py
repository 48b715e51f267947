"""Rival statistics in closed form: attitude, slip, timing, cost of transport, drop of value."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gaitshift.shift import AttitudeVariance, ContactTiming, CostOfTransport, Slip, ValueDrop
from sensing import DOWN, FEET, PERIOD, standing, tilted
from turning import rotation


def test_attitude_of_a_robot_that_leans_steadily_does_not_vary():
    turned = rotation(0.3, -0.2, 0.0)
    statistic = AttitudeVariance()
    state = statistic.start(1)
    for _ in range(150):
        state, value = statistic.step(state, tilted(standing(), (DOWN @ turned)[None]))
    assert value[0, 0] == pytest.approx(0.0, abs=1e-9)


def test_attitude_of_a_rolling_robot_varies_by_amplitude_over_root_2():
    statistic = AttitudeVariance(window=2.0)
    state, seen = statistic.start(1), []
    for step in range(1500):
        turned = rotation(0.1 * math.sin(2 * math.pi * 2 * step * PERIOD), 0.05, 0.0)
        state, value = statistic.step(state, tilted(standing(), (DOWN @ turned)[None]))
        seen.append(value[0, 0])
    assert np.isnan(seen[:198]).all(), "a window has to go by first"
    assert seen[-1] == pytest.approx(0.1 / math.sqrt(2), rel=0.05)


@pytest.mark.parametrize("slide", [0.0, 0.3])
def test_slip_is_the_speed_of_standing_feet_over_the_ground(slide):
    statistic, velocity, rate = Slip(), np.array([1.0, 0.2, -0.1]), np.array([0.3, -0.4, 0.5])
    state, position = statistic.start(1), FEET.copy()
    for _ in range(200):
        sensed = replace(
            standing(),
            foot_position_b=position[None].copy(),
            velocity_b=velocity[None],
            angular_velocity_b=rate[None],
        )
        state, value = statistic.step(state, sensed)
        # A point of the world, seen from a body that moves and turns; the first foot slides on.
        position = position - PERIOD * (velocity + np.cross(rate, position))
        position[0, 0] += PERIOD * slide
    np.testing.assert_allclose(value[0], [slide, 0, 0, 0], atol=0.02)


def test_timing_is_by_how_much_a_stride_was_off_and_a_foot_overdue_shows_it_at_once():
    statistic = ContactTiming()
    state, seen = statistic.start(1), []
    for step in range(200):
        # The first foot comes down every 0.4 s until 1.2 s; the others every 0.5 s.
        contact = [[step % 40 < 20 and step < 140, *[step % 50 < 25] * 3]]
        sensed = standing(
            contact=np.array(contact, dtype=bool),
            time=step * PERIOD,
            stride_frequency_command=np.array([2.0]),
        )
        state, value = statistic.step(state, sensed)
        seen.append(value[0].copy())
    np.testing.assert_allclose(seen[130], [0.1, 0, 0, 0], atol=1e-9)
    assert seen[199][0] == pytest.approx(1.99 - 1.2 - 0.5)


def test_cost_of_transport_is_power_over_weight_and_speed():
    statistic = CostOfTransport()
    state = statistic.start(1)
    for _ in range(120):
        walking = standing(  # 12 joints at 12.5 W, half of them against their motion
            joint_torque=np.array([[12.5, -12.5] * 6]),
            joint_velocity=np.ones((1, 12)),
            velocity_b=np.array([[1.5, 0.0, 0.0]]),
            mass=20.0,
        )
        state, value = statistic.step(state, walking)
    assert value[0, 0] == pytest.approx(150.0 / (20.0 * 9.81 * 1.5))


def test_a_value_that_falls_by_d_drops_by_d_at_first_and_is_forgotten_then():
    statistic = ValueDrop(fast=0.1, slow=10.0)
    state, seen = statistic.start(1), []
    for step in range(6000):
        value = 5.0 if step < 1500 else 3.0
        state, drop = statistic.step(state, standing(value=np.array([value])))
        seen.append(drop[0, 0])
    assert np.isnan(seen[998])
    assert seen[1499] == pytest.approx(0.0, abs=1e-9)
    assert seen[1550] == pytest.approx(2.0, rel=0.06)
    assert seen[5999] == pytest.approx(2.0 * math.exp(-45.0 / 10.0), rel=0.05)
