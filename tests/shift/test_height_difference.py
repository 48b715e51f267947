"""Algorithm 1 and its reverse, against the printed loops in plain Python and closed forms."""

import math
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitshift.errors import GaitshiftError
from gaitshift.shift import (
    Condition,
    ConditionState,
    HeightDifference,
    Signals,
    height_in_frame,
)
from turning import rotation

PAPER = Condition.paper()
DOWN = np.array([0.0, 0.0, -1.0])
FOOT_XY = np.array([[0.34, 0.21], [0.35, -0.22], [-0.33, 0.23], [-0.36, -0.24]])
"""Where the feet stand in plan [m], unlike for each leg; 0.68 m apart fore and aft, as ANYmal's."""

quick = settings(max_examples=60, deadline=None)
walks = st.integers(1, 40).flatmap(
    lambda steps: st.tuples(
        arrays(np.int64, (steps, 4), elements=st.integers(-6, 6)).map(lambda z: z / 16),
        arrays(np.bool_, (steps, 4)),
    )
)
"""Foot heights (T, 4) [m] in sixteenths, so that ties with α are exact, and contacts (T, 4)."""
sixteenths = st.integers(1, 8).map(lambda n: n / 16)
exact_epsilons = st.sampled_from([0.25, 0.5, 1.0, 2.0])


def positions(z):
    """Feet (..., 4, 3) that stand at `FOOT_XY` with heights z (..., 4)."""
    return np.concatenate([np.broadcast_to(FOOT_XY, (*z.shape, 2)), z[..., None]], axis=-1)


def walk(condition, z, contact, *, shifted=False, state=None):
    """Counter k and firing (T, N) on one upright robot, or N for z and contact (T, N, 4)."""
    z, contact = (a if a.ndim == 3 else a[:, None] for a in (z, contact))
    robots = z.shape[1]
    state = condition.start(robots) if state is None else state
    ks, fires = [], []
    for step in range(len(z)):
        signals = Signals(
            contact=contact[step],
            foot_position_b=positions(z[step]),
            gravity_b=np.tile(DOWN, (robots, 1)),
        )
        state, fire = condition.step(state, signals, np.full(robots, shifted))
        ks.append(state.k)
        fires.append(fire)
    return np.array(ks), np.array(fires)


def first_firing(condition, z, contact, *, shifted=False):
    """Index of the first step that fires, or infinity."""
    fired = np.flatnonzero(walk(condition, z, contact, shifted=shifted)[1])
    return int(fired[0]) if len(fired) else math.inf


def last_touches(z, contact):
    """Yield the vector h after each step, with None for a foot that has not touched."""
    h = [None] * 4
    for heights, touches in zip(z.tolist(), contact.tolist(), strict=True):
        for i in range(4):
            if touches[i]:
                h[i] = heights[i]
        yield list(h)


def algorithm_1(z, contact, *, alpha, epsilon):
    """Counter k after each step, by the paper's two nested loops."""
    k, ks = 0.0, []
    for h in last_touches(z, contact):
        for i in range(4):
            for j in range(i):
                if None not in (h[i], h[j]) and abs(h[i] - h[j]) > alpha:
                    k = k + epsilon
        ks.append(k)
    return ks


def reverse_of_algorithm_1(z, contact, *, alpha_back, epsilon):
    """Counter k after each step, one ε where four heights are known and no two disagree."""
    k, ks = 0.0, []
    for h in last_touches(z, contact):
        agree = all(x is not None and y is not None and abs(x - y) < alpha_back
                    for x in h for y in h)  # fmt: skip
        k = k + epsilon if agree else k
        ks.append(k)
    return ks


def assert_counts_until_firing(expected, threshold, ks, fires):
    """Check k up to the first step at which it passes the threshold, which fires and restarts."""
    above = [step for step, k in enumerate(expected) if k > threshold]
    end = above[0] if above else len(expected)
    assert ks[:end, 0].tolist() == expected[:end]
    assert not fires[:end].any()
    if above:
        assert fires[end, 0]
        assert ks[end, 0] == 0.0


@quick
@given(walks, sixteenths, exact_epsilons, st.integers(1, 40))
def test_forward_rule_is_algorithm_1_as_printed(steps, alpha, epsilon, beta):
    condition = replace(PAPER, alpha=alpha, epsilon=epsilon, beta=float(beta))
    expected = algorithm_1(*steps, alpha=alpha, epsilon=epsilon)
    assert_counts_until_firing(expected, beta, *walk(condition, *steps))


@quick
@given(walks, sixteenths, exact_epsilons, st.integers(1, 6))
def test_reverse_rule_counts_the_steps_at_which_all_pairs_agree(steps, alpha, epsilon, beta):
    condition = replace(PAPER, alpha_back=alpha, epsilon=epsilon, beta_back=float(beta))
    expected = reverse_of_algorithm_1(*steps, alpha_back=alpha, epsilon=epsilon)
    assert_counts_until_firing(expected, beta, *walk(condition, *steps, shifted=True))


@pytest.mark.parametrize(
    ("heights", "step"),
    [([0.0, 0.3, 0.6, 0.9], 167), ([0.0, 0.11, 0.11, 0.22], 1001), ([0.0, 0.1, 0.1, 0.2], None)],
)
def test_paper_setting_fires_after_1_7_s_with_six_pairs_and_10_s_with_one(heights, step):
    z = np.tile(heights, (1100, 1))
    fires = walk(PAPER, z, np.ones_like(z, dtype=bool))[1]
    assert (np.flatnonzero(fires)[:1] + 1).tolist() == ([] if step is None else [step])


def test_reverse_rule_fires_on_the_first_step_past_beta_back():
    condition = replace(PAPER, beta_back=150.0)
    z = np.tile([0.0, 0.05, 0.1, 0.19], (200, 1))
    fires = walk(condition, z, np.ones_like(z, dtype=bool), shifted=True)[1]
    assert np.flatnonzero(fires).tolist() == [150]


@quick
@given(walks, sixteenths, sixteenths, st.integers(1, 60), st.integers(1, 60))
def test_larger_alpha_or_beta_never_fires_earlier(steps, alpha, more, beta, more_counts):
    condition = replace(PAPER, alpha=alpha, beta=float(beta))
    first = first_firing(condition, *steps)
    assert first_firing(replace(condition, alpha=alpha + more), *steps) >= first
    assert first_firing(replace(condition, beta=float(beta + more_counts)), *steps) >= first


@quick
@given(walks, st.sampled_from(list(permutations(range(4)))), st.booleans())
def test_no_leg_is_special(steps, order, shifted):
    z, contact = steps
    expected, _ = walk(PAPER, z, contact, shifted=shifted)
    actual, _ = walk(PAPER, z[:, order], contact[:, order], shifted=shifted)
    np.testing.assert_array_equal(actual, expected)


@pytest.mark.parametrize("shifted", [False, True])
def test_feet_that_never_touched_take_part_in_no_pair(shifted):
    contact = np.tile([True, False, True, True], (5, 1))
    rough = np.tile([0.5, 9.0, 0.0, 0.0], (5, 1))
    flat = np.tile([0.5, 0.5, 0.5, 0.5], (5, 1))
    ks, _ = walk(PAPER, flat if shifted else rough, contact, shifted=shifted)
    assert ks[:, 0].tolist() == ([0, 0, 0, 0, 0] if shifted else [2, 4, 6, 8, 10])


def test_height_is_that_of_the_last_touch_and_is_kept_in_swing():
    z = np.array([[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]])
    state = PAPER.start(1)
    for heights, touches in zip(z, [[1, 1, 0, 0], [0, 1, 0, 1]], strict=True):
        signals = Signals(
            contact=np.array([touches], dtype=bool),
            foot_position_b=positions(heights[None]),
            gravity_b=DOWN[None],
        )
        state, _ = PAPER.step(state, signals, np.array([False]))
    np.testing.assert_array_equal(state.statistic, [[0.1, 0.6, np.nan, 0.8]])


@pytest.mark.parametrize("reset", [True, False])
def test_firing_restarts_count_and_heights_or_neither(reset):
    condition = replace(PAPER, beta=6.0, alpha_back=0.2, beta_back=2.0, reset=reset)
    rough, flat = positions(np.array([[0.0, 0.3, 0.6, 0.9]])), positions(np.zeros((1, 4)))
    state, history = condition.start(1), []
    shifted = np.array([False])
    for foot_position in [rough] * 3 + [flat] * 3 + [rough] * 2:
        signals = Signals(
            contact=np.full((1, 4), fill_value=True),
            foot_position_b=foot_position,
            gravity_b=DOWN[None],
        )
        state, fire = condition.step(state, signals, shifted)
        shifted = shifted ^ fire
        height = state.statistic[0, 3].item()
        history.append((state.k.item(), fire.item(), None if math.isnan(height) else height))
    anew = [
        (6.0, False, 0.9), (0.0, True, None), (0.0, False, 0.9),
        (1.0, False, 0.0), (2.0, False, 0.0), (0.0, True, None),
        (6.0, False, 0.9), (0.0, True, None),
    ]  # fmt: skip
    on = [
        (6.0, False, 0.9), (12.0, True, 0.9), (12.0, True, 0.9),
        (12.0, True, 0.0), (13.0, True, 0.0), (13.0, True, 0.0),
        (13.0, True, 0.9), (19.0, True, 0.9),
    ]  # fmt: skip
    assert history == (anew if reset else on)


def test_alpha_can_change_between_steps_and_the_count_goes_on():
    z = np.array([[0.0, 0.1, 0.3, 0.6]])
    contact = np.ones((1, 4), dtype=bool)
    seven = np.array([7.0])
    state = ConditionState(statistic=z, k=seven, counted=seven, time_in_gait=seven)
    assert walk(replace(PAPER, alpha=0.25), z, contact, state=state)[0].item() == 7 + 4
    assert walk(replace(PAPER, alpha=0.55), z, contact, state=state)[0].item() == 7 + 1


@quick
@given(walks, st.tuples(*[st.floats(-3.1, 3.1)] * 3))
def test_gravity_frame_sees_the_world_heights_however_the_body_is_turned(steps, angles):
    z, contact = steps
    condition = Condition(alpha=0.2, beta=50.0)
    turn = rotation(*angles)
    feet_b, gravity_b = positions(z[:, None]) @ turn, (DOWN @ turn)[None]
    np.testing.assert_allclose(
        height_in_frame(feet_b[:, 0], np.tile(gravity_b, (len(z), 1)), "gravity"), z, atol=1e-12
    )
    state, ks = condition.start(1), []
    for feet, touches in zip(feet_b, contact, strict=True):
        signals = Signals(contact=touches[None], foot_position_b=feet, gravity_b=gravity_b)
        state, _ = condition.step(state, signals, np.array([False]))
        ks.append(state.k)
    np.testing.assert_array_equal(ks, walk(condition, z, contact)[0])


def level_stance(pitch_degrees):
    """Feet on level ground 0.68 m apart fore and aft, seen from a body pitched nose down."""
    plan = [[0.34, 0.2, 0.0], [0.34, -0.2, 0.0], [-0.34, 0.2, 0.0], [-0.34, -0.2, 0.0]]
    turn = rotation(0.0, math.radians(pitch_degrees), 0.5)
    heading = rotation(0.0, 0.0, 0.5)
    return ((np.array(plan) - [0.0, 0.0, 0.46]) @ heading.T @ turn)[None], (DOWN @ turn)[None]


def test_body_frame_takes_17_degrees_of_pitch_for_a_step_of_20_cm_and_gravity_frame_does_not():
    feet_b, gravity_b = level_stance(17.0)
    body = height_in_frame(feet_b, gravity_b, "body")[0]
    assert body[0] - body[2] == pytest.approx(0.68 * math.sin(math.radians(17.0)))
    assert body[0] - body[2] == pytest.approx(0.2, abs=0.002)
    assert body[0] == pytest.approx(body[1])
    assert height_in_frame(feet_b, gravity_b, "gravity")[0] == pytest.approx([-0.46] * 4)


@pytest.mark.parametrize(
    ("frame", "degrees", "counts"),
    [("body", 16.0, 0), ("body", 18.0, 4), ("body", -18.0, 4), ("gravity", 40.0, 0)],
)
def test_pitch_on_level_ground_counts_all_fore_aft_pairs_in_the_body_frame(frame, degrees, counts):
    condition = replace(PAPER, statistic=HeightDifference(frame=frame))
    feet_b, gravity_b = level_stance(degrees)
    all_down = np.ones((1, 4), dtype=bool)
    signals = Signals(contact=all_down, foot_position_b=feet_b, gravity_b=gravity_b)
    state, _ = condition.step(condition.start(1), signals, np.array([False]))
    assert state.k.item() == counts


@pytest.mark.parametrize("shifted", [False, True])
def test_height_that_is_not_a_number_counts_for_neither_rule_until_the_foot_touches(shifted):
    z = np.array([[0.0, 0.0, 0.0, math.nan], [0.0, 0.0, 0.0, 0.0 if shifted else 1.0]])
    ks, _ = walk(PAPER, z, np.ones((2, 4), dtype=bool), shifted=shifted)
    assert ks[:, 0].tolist() == ([0, 1] if shifted else [0, 3])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"alpha": 0.0}, "shift to the rough gait: alpha must be above 0 and finite, got 0.0"),
        ({"beta": -1.0}, "shift to the rough gait: beta must be 0 or more and finite, got -1.0"),
        ({"epsilon": math.inf}, "shift to the rough gait: epsilon must be above 0 and finite, "
                                "got inf"),
        ({"alpha_back": math.nan}, "shift back to the flat gait: alpha must be above 0 and finite, "
                                    "got nan"),
        ({"leak_back": -0.1}, "shift back to the flat gait: leak must be 0 or more and finite, "
                               "got -0.1"),
    ],
)  # fmt: skip
def test_bad_config_is_refused_with_one_line_that_says_what_would_be_right(wrong, message):
    with pytest.raises(GaitshiftError) as error:
        Condition(**wrong)
    assert str(error.value) == message


def test_unknown_frame_is_refused_with_the_known_ones():
    condition = HeightDifference()
    object.__setattr__(condition, "frame", "world")  # a type checker would stop the constructor
    with pytest.raises(GaitshiftError) as of_config:
        condition.__post_init__()
    with pytest.raises(GaitshiftError) as of_height:
        height_in_frame(np.zeros((1, 4, 3)), DOWN[None], "world")
    message = "frame must be body or gravity, got 'world'"
    assert str(of_config.value) == str(of_height.value) == message


def test_paper_setting_has_the_paper_s_numbers():
    assert (PAPER.alpha, PAPER.beta, PAPER.epsilon) == (0.2, 1000.0, 1.0)
    assert PAPER.statistic == HeightDifference(frame="body")
