"""Who is thrown off the heading: steady turns, sway, and the step response of the follower."""

import numpy as np
import pytest

from gaitshift.shift.statistics.heading import HeadingWatch
from sensing import PERIOD, headed, standing


def follow(yaws):
    """Who is thrown off the heading, step by step."""
    watch = HeadingWatch()
    state, off = watch.start(1), []
    for yaw in yaws:
        state, error = watch.step(state, headed(standing(), np.array([yaw])))
        off.append(abs(error[0]) > watch.limit)
    return np.array(off)


def test_who_turns_steadily_or_sways_keeps_to_the_heading():
    time = np.arange(0.0, 20.0, PERIOD)
    turning = 3.0 + 0.4 * np.maximum(time - 1.0, 0.0)  # past π, and on round
    assert not follow(np.remainder(turning + np.pi, 2 * np.pi) - np.pi)[500:].any()
    assert not follow(0.06 * np.sin(2 * np.pi * 2.4 * time)).any()


def test_who_is_turned_aside_is_thrown_off_the_heading_for_a_while():
    """A critically damped follower is off by (1 - ωt) exp(-ωt) of a turn of 0.3 rad at once.

    From ωt = 0.54 on that is less than 0.08 rad.
    """
    off = follow([0.0] * 100 + [0.3] * 300)
    assert not off[:100].any()
    assert off[100:].sum() == pytest.approx(0.54 / HeadingWatch().frequency / PERIOD, abs=2)
    assert follow([0.0] * 100 + [-0.3] * 10)[100:].all()
