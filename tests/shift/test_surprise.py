"""How touchdowns surprise, on steps, slopes, waves and noise of known size."""

import math

import numpy as np
import pytest

from gaitshift.shift import TouchdownSurprise
from gaitshift.shift.statistics.surprise import STEADY, STEEP
from sensing import course, headed, strolling


def test_who_sways_is_told_less_in_proportion():
    """Far faster than the heading is followed a sway of A is off it by A/√2 in the mean."""

    def told(sway):
        statistic, state, seen = TouchdownSurprise(), None, []
        waves = strolling(
            lambda x, y: 0.05 * math.sin(5 * x) * math.cos(7 * y), turn=0.0, wobble=0.0, seconds=8.0
        )
        for _, sensed in waves:
            state = state or statistic.start(1)
            yaw = np.array([sway * math.sin(20.0 * math.pi * sensed.time)])
            state, value = statistic.step(state, headed(sensed, yaw))
            seen.append(value[0, 0])
        return np.nanmean(seen[400:])

    still = told(0.0)
    assert told(0.5 * STEADY) == pytest.approx(still, rel=1e-3), (
        "a robot that sways less than a steady walker keeps its full value"
    )
    assert told(8.0 * STEADY) == pytest.approx(still / (8.0 / math.sqrt(2.0)), rel=0.05)


@pytest.mark.parametrize("speed", [1.0, -1.0])
def test_a_step_surprises_the_feet_that_lead_by_its_height_and_then_no_more(speed):
    """Onwards it is the front feet that come to it first, backwards the hind ones."""
    edge = 2.0 * speed
    walk = {"speed": speed, "turn": 0.0, "wobble": 0.0, "seconds": 5.0}
    for rise in (0.05, -0.08):
        seen = course(
            TouchdownSurprise(memory=1),
            lambda x, y, rise=rise: rise * ((x - edge) * speed > 0),
            **walk,
        )
        first = np.flatnonzero(np.nan_to_num(seen) > 0.002)[0]
        expected = abs(rise) * math.sqrt(math.pi) / 2.0
        assert seen[first] == pytest.approx(expected, abs=0.002), "the first foot on it"
        assert np.isfinite(seen[first - 1]), "level ground before, and it was seen"
        assert seen[-1] < 0.002, "level ground behind"


def test_changes_of_surprise_are_averaged_by_their_sizes():
    """Of three changes one is of 6 cm: 2 cm in the mean, of which √π/2 are 1.77 cm, just then."""
    walk = {"turn": 0.0, "wobble": 0.0}
    seen = course(TouchdownSurprise(memory=3), lambda x, y: 0.06 * (x > 2.0), **walk)
    assert seen[np.flatnonzero(np.nan_to_num(seen) > 0.002)[0]] == pytest.approx(0.0177, abs=0.001)


def test_a_drift_of_errors_is_no_surprise():
    """A cubic leaves its plane by ever more, and by as much more at each touchdown."""
    walk = {"turn": 0.0, "wobble": 0.0, "seconds": 8.0}
    statistic, state, seen = TouchdownSurprise(), None, []
    for _, sensed in strolling(lambda x, y: 0.004 * x**3, **walk):
        state = state or statistic.start(1)
        state, value = statistic.step(state, sensed)
        seen.append((value[0, 0], *state.change[0]))
    told, change, over_three = np.array(seen)[-1]
    assert over_three == pytest.approx(3.0 * change, rel=0.05)
    assert told < 0.2 * change


def test_where_a_slope_begins_touches_surprise_less_than_a_step_of_its_rise_in_a_stride():
    walk = {"turn": 0.0, "wobble": 0.0, "seconds": 20.0}
    rise = math.tan(math.radians(10.0))
    bend = course(TouchdownSurprise(), lambda x, y: rise * np.maximum(x - 2.0, 0.0), **walk)
    step = course(TouchdownSurprise(), lambda x, y: 0.1 * (x > 2.0), **walk)
    assert np.nanmax(bend) < 0.7 * np.nanmax(step)
    assert np.nan_to_num(bend)[-50:].max() < 0.002, "a slope by itself is no surprise"


def test_what_lies_on_steep_ground_counts_less_by_how_steep_it_is():
    """Tilting the ground changes no error; 10° are steeper than `STEEP` by tan 10° over it."""
    heights = np.random.default_rng(5).normal(scale=0.01, size=(400, 41))
    walk = {"turn": 0.0, "wobble": 0.0, "seconds": 18.0}
    rise = math.tan(math.radians(10.0))

    def told(slope):
        def pebbles(x, y):
            return heights[int(20 * x + 20), int(20 * y + 20)] + slope * x

        return np.nanmean(course(TouchdownSurprise(), pebbles, **walk)[600:])

    assert told(rise) == pytest.approx(told(0.0) * STEEP / rise, rel=0.15)
    assert told(0.5 * STEEP) == pytest.approx(told(0.0), rel=0.15)


def test_on_heights_that_know_nothing_of_one_another_it_is_their_deviation():
    """The plane through a dozen of them adds some 10 %, and means start at 0."""
    heights = np.random.default_rng(5).normal(scale=0.03, size=(400, 41))
    walk = {"turn": 0.0, "wobble": 0.0, "seconds": 18.0}
    seen = course(
        TouchdownSurprise(), lambda x, y: heights[int(20 * x + 20), int(20 * y + 20)], **walk
    )
    assert 0.03 < np.nanmean(seen) < 0.045


def test_who_stumbles_is_told_nothing_until_there_are_errors_enough_again():
    statistic, state, seen = TouchdownSurprise(), None, []
    for _, sensed in strolling(lambda x, y: 0.0, seconds=8.0, turn=0.0, wobble=0.0):
        state = state or statistic.start(1)
        thrown = np.array([0.5 if sensed.time > 4.0 else 0.0])
        state, value = statistic.step(state, headed(sensed, thrown))
        seen.append(value[0, 0])
    known = ~np.isnan(np.array(seen))
    assert known[390:400].all()
    assert not known[402:500].any(), "six earlier touches, and four on new ground"
    assert known[-50:].all()
