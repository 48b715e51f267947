"""The paper's h: heights of the last touches, along the body's axis and along the vertical."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import orientation_of
from gaitshift.shift import HeightDifference
from sensing import DOWN, FEET, ONE_UP, standing
from turning import rotation

quick = settings(max_examples=60, deadline=None)
walks = st.integers(1, 40).flatmap(
    lambda steps: st.tuples(
        arrays(np.int64, (steps, 4), elements=st.integers(-6, 6)).map(lambda z: z / 16),
        arrays(np.bool_, (steps, 4)),
    )
)
"""Foot heights (T, 4) [m] and contacts (T, 4)."""


def feet_at(z):
    """Feet (..., 4, 3) that stand where `FEET` do, with heights z (..., 4)."""
    return np.concatenate([np.broadcast_to(FEET[:, :2], (*z.shape, 2)), z[..., None]], axis=-1)


def heights_of(frame, feet_b, gravity_b):
    """H (4,) of a robot that stands on all feet."""
    statistic = HeightDifference(frame=frame)
    sensed = standing(foot_position_b=feet_b, orientation=orientation_of(gravity_b))
    return statistic.step(statistic.start(1), sensed)[0].height[0]


def test_height_is_that_of_the_last_touch_and_is_kept_in_swing():
    z = np.array([[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]])
    statistic = HeightDifference(frame="body")
    state = statistic.start(1)
    for heights, touches in zip(z, [[1, 1, 0, 0], [0, 1, 0, 1]], strict=True):
        contact = np.array([touches], dtype=bool)
        sensed = standing(contact=contact, foot_position_b=feet_at(heights[None]))
        state, values = statistic.step(state, sensed)
    np.testing.assert_array_equal(state.height, [[0.1, 0.6, np.nan, 0.8]])
    pairs = sorted(values[0][~np.isnan(values[0])].tolist())
    assert pairs == pytest.approx([0.2, 0.5, 0.7]), "of the three feet that have touched"


@quick
@given(walks, st.tuples(*[st.floats(-3.1, 3.1)] * 3))
def test_gravity_frame_sees_the_world_heights_however_the_body_is_turned(steps, angles):
    """In double precision: to 1e-9 m."""
    z, contact = steps
    turn = rotation(*angles)
    feet_b, gravity_b = feet_at(z[:, None]) @ turn, (DOWN @ turn)[None]
    statistic, upright = HeightDifference(frame="gravity"), HeightDifference(frame="body")
    state, plain = statistic.start(1), upright.start(1)
    for heights, feet, touches in zip(z, feet_b, contact, strict=True):
        turned = standing(
            contact=touches[None], foot_position_b=feet, orientation=orientation_of(gravity_b)
        )
        state, values = statistic.step(state, turned)
        level = standing(contact=touches[None], foot_position_b=feet_at(heights[None]))
        plain, same = upright.step(plain, level)
        np.testing.assert_allclose(state.height, plain.height, atol=1e-9)
        np.testing.assert_allclose(values, same, atol=1e-9)


def level_stance(pitch_degrees):
    """Feet on level ground 0.68 m apart fore and aft, seen from a body pitched nose down."""
    plan = [[0.34, 0.2, 0.0], [0.34, -0.2, 0.0], [-0.34, 0.2, 0.0], [-0.34, -0.2, 0.0]]
    turn = rotation(0.0, math.radians(pitch_degrees), 0.5)
    heading = rotation(0.0, 0.0, 0.5)
    return ((np.array(plan) - [0.0, 0.0, 0.46]) @ heading.T @ turn)[None], (DOWN @ turn)[None]


def test_body_frame_takes_17_degrees_of_pitch_for_a_step_of_20_cm_and_gravity_frame_does_not():
    feet_b, gravity_b = level_stance(17.0)
    body = heights_of("body", feet_b, gravity_b)
    assert body[0] - body[2] == pytest.approx(0.68 * math.sin(math.radians(17.0)))
    assert body[0] - body[2] == pytest.approx(0.2, abs=0.002)
    assert body[0] == pytest.approx(body[1])
    assert heights_of("gravity", feet_b, gravity_b) == pytest.approx([-0.46] * 4)


@pytest.mark.parametrize(
    ("frame", "degrees", "counts"),
    [("body", 16.0, 0), ("body", 18.0, 4), ("body", -18.0, 4), ("gravity", 40.0, 0)],
)
def test_pitch_on_level_ground_counts_all_fore_aft_pairs_in_the_body_frame(frame, degrees, counts):
    """By the paper's α of 0.2 m."""
    feet_b, gravity_b = level_stance(degrees)
    sensed = standing(foot_position_b=feet_b, orientation=orientation_of(gravity_b))
    statistic = HeightDifference(frame=frame)
    _, values = statistic.step(statistic.start(1), sensed)
    assert np.count_nonzero(values > 0.2) == counts


def test_unknown_frame_is_refused_with_the_known_ones():
    statistic = HeightDifference()
    object.__setattr__(statistic, "frame", "world")  # a type checker would stop the constructor
    with pytest.raises(GaitshiftError) as caught:
        statistic.__post_init__()
    assert str(caught.value) == "frame must be body or gravity, got 'world'"


def test_a_false_touch_in_mid_swing_is_no_touch():
    """A swinging foot 10 cm up is felt for 30 ms: h follows it at once, or not at all."""
    counts, filtered = HeightDifference(), HeightDifference(least_stance=0.04)
    states = [counts.start(1), filtered.start(1)]
    felt = [[1, 1, 1, 1]] * 5 + [[0, 1, 1, 1]] * 3 + [[1, 1, 1, 1]] * 3 + [[0, 1, 1, 1]]
    for step, contact in enumerate(felt):
        feet = FEET if step < 5 else ONE_UP
        sensed = standing(feet=feet, contact=np.array([contact], dtype=bool))
        states = [
            statistic.step(state, sensed)[0]
            for statistic, state in zip((counts, filtered), states, strict=True)
        ]
    assert states[0].height[0] == pytest.approx([-0.4, -0.5, -0.5, -0.5])
    assert states[1].height[0] == pytest.approx([-0.5] * 4)
