"""R_walk against Table I worked out by hand, and the machine's bonus against hand tables."""

from dataclasses import asdict, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import Command
from gaitshift.robot.state import Privileged, Proprioception
from gaitshift.sim.reward import (
    ADDITIONS,
    BONUS_MODES,
    RewardConfig,
    earned_bonus,
    walk_reward,
    with_bonus,
)

TABLE_I = {
    "forward_velocity": 10.0,
    "lateral_velocity": -10.0,
    "roll_pitch_rate": -0.1,
    "yaw_rate": -25.0,
    "torque": -0.00004,
    "joint_position": -0.1,
    "joint_velocity": -0.01,
}
"""Weights as the paper prints them."""
CONFIG = replace(
    RewardConfig.paper(),
    speed_tracking=2.0,
    lateral_tracking=4.0,
    height_tracking=6.0,
    stance_feet=5.0,
    stance_pattern=3.0,
    slip=-0.5,
    power=-0.5,
    chatter=-7.0,
    action_rate=-0.02,
)
"""Table I and round numbers for what is ours."""
STANCE = np.array([0.1, -0.2, 0.3, -0.4, 0.5, -0.6, 0.7, -0.8, 0.9, -1.0, 1.1, -1.2])
RAMP = np.arange(1.0, 13.0)
"""1 … 12, of which the squares sum up to 650."""
HALF = np.sqrt(0.5)


def still(n):
    """Robots that stand upright in STANCE, all feet down: what they sense, and the truth."""
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    sensed = Proprioception(
        contact=np.ones((n, 4), dtype=bool),
        foot_position_b=np.zeros((n, 4, 3)),
        orientation=upright,
        joint_position=np.tile(STANCE, (n, 1)),
        joint_velocity=np.zeros((n, 12)),
        joint_torque=np.zeros((n, 12)),
        angular_velocity_b=np.zeros((n, 3)),
    )
    truth = Privileged(
        base_position_w=np.zeros((n, 3)),
        base_quaternion_w=upright,
        velocity_b=np.zeros((n, 3)),
        foot_position_w=np.zeros((n, 4, 3)),
        foot_velocity_w=np.zeros((n, 4, 3)),
        foot_force=np.zeros((n, 4)),
        clearance=np.zeros((n, 4)),
        body_contact=np.zeros(n, dtype=bool),
        diverged=np.zeros(n, dtype=bool),
    )
    return sensed, truth


def only(index, value):
    row = np.zeros(12)
    row[index] = value
    return row


def three_robots():
    """Robot 0 level along world x, robot 1 turned left by 90°, robot 2 nose down by 90°."""
    sensed, truth = still(3)
    swapped = STANCE.copy()
    swapped[[0, 1]] = swapped[[1, 0]]
    heading = np.array([[1.0, 0.0, 0.0, 0.0], [HALF, 0.0, 0.0, HALF], [HALF, 0.0, HALF, 0.0]])
    sensed = replace(
        sensed,
        orientation=heading,
        joint_position=np.stack([STANCE + 0.01 * RAMP, swapped, STANCE]),
        joint_velocity=np.stack([0.5 * RAMP, only(7, -2.0), np.zeros(12)]),
        joint_torque=np.stack([RAMP, only(3, -20.0), np.zeros(12)]),
        angular_velocity_b=np.array([[0.5, -1, 0.4], [0.2, 0.3, 0], [0.3, 0.1, -0.2]]),
        contact=np.array([[True, False, True, False], [False] * 4, [True] * 4]),
    )
    truth = replace(
        truth,
        base_quaternion_w=heading,
        velocity_b=np.array([[0.7, 0.3, -0.2], [1.2, 0.3, 0.1], [1.0, 0.2, 0.4]]),
        foot_velocity_w=np.array(
            [
                [[0.1, -0.2, 9], [5, 5, 5], [0.3, 0.4, 7], [6, 6, 6]],
                [[1, 2, 3], [4, 5, 6], [7, 8, 9], [10, 11, 12]],
                [[0, 0, 3], [0.6, -0.8, 0], [0, 0, 2], [0, 0.2, 0]],
            ],
            dtype=float,
        ),
    )
    return {
        "sensed": sensed,
        "truth": truth,
        "command": Command(
            forward_speed=np.array([1.2, 0.2, 1.2]),
            yaw_rate=np.array([0.1, -0.2, 0.0]),
            stride_frequency=np.array([1.5, 2.5, 3.5]),
            lateral_speed=np.array([0.2, 0.0, 0.4]),
        ),
        "stance": STANCE,
        "steps_aside": True,
        "height_error": np.array([0.1, -0.2, 0.0]),
        "in_time": np.array([1.0, 0.5, 0.25]),
        "agreement": np.array([1.0, 0.75, 0.5]),
        "chatter": np.array([2.0, 0.0, 0.75]),
        "action_change": np.stack([0.1 * RAMP, np.zeros(12), -np.ones(12)]),
    }


HAND_TABLE = {
    # Body velocities: robot 0 (0.7, 0.3, -0.2); robot 1 (1.2, 0.3, 0.1); robot 2 (1, 0.2, 0.4).
    # 10 exp(-(1.2 - 0.7)²) = 10 exp(-0.25); 10 exp(-(0.2 - 1.2)²) = 10 exp(-1); 10 exp(-0.04)
    "forward_velocity": (7.788007830714049, 3.678794411714423, 9.607894391523232),
    # With 0.2, 0 and 0.4 asked for: -10 (0.01 + 0.04); -10 (0.09 + 0.01); -10 (0.04 + 0.16)
    "lateral_velocity": (-0.5, -1.0, -2.0),
    # -0.1 (0.25 + 1); -0.1 (0.04 + 0.09); -0.1 (0.09 + 0.01)
    "roll_pitch_rate": (-0.125, -0.013, -0.01),
    # -25 (0.4 - 0.1)²; -25 (0 + 0.2)²; -25 (-0.2)²
    "yaw_rate": (-2.25, -1.0, -1.0),
    # -0.00004 · 650; -0.00004 · 400; nothing
    "torque": (-0.026, -0.016, 0.0),
    # -0.1 · 0.0001 · 650; joints 0.1 and -0.2 exchanged, -0.1 (0.09 + 0.09); nothing
    "joint_position": (-0.0065, -0.018, 0.0),
    # -0.01 · 0.25 · 650; -0.01 · 4; nothing
    "joint_velocity": (-1.625, -0.04, 0.0),
    # 2 exp(-(0.5 / 0.25)²) = 2 exp(-4); 2 exp(-(1 / 0.25)²) = 2 exp(-16); 2 exp(-0.64)
    "speed_tracking": (0.03663127777746836, 2.2507034943851823e-07, 1.0545848480860982),
    # 4 exp(-(0.1 / 0.25)²) = 4 exp(-0.16); 4 exp(-1.44); 4 exp(-0.64)
    "lateral_tracking": (3.4085751558648454, 0.9477110347284871, 2.109169696172194),
    # 6 exp(-(0.1 / 0.05)²) = 6 exp(-4); 6 exp(-16); 6
    "height_tracking": (0.10989383333240508, 6.752110483155547e-07, 6.0),
    # 5 times the share of four, three and two feet; half and a quarter of that come late
    "stance_feet": (5.0, 1.875, 0.625),
    # 3 where all four agree
    "stance_pattern": (3.0, 0.0, 0.0),
    # -0.5 (FL 0.01 + 0.04, BL 0.09 + 0.16); no foot down; -0.5 (FR 0.36 + 0.64, BR 0.04)
    "slip": (-0.15, 0.0, -0.52),
    # -7 · two feet; no foot; -7 · three feet at a strictness of a quarter
    # -0.5 · 0.5 · 650; -0.5 on a joint that turns while another one pushes; nothing
    "power": (-162.5, 0.0, 0.0),
    "chatter": (-14.0, 0.0, -5.25),
    # -0.02 · 0.01 · 650; nothing; -0.02 · 12
    "action_rate": (-0.13, 0.0, -0.24),
}


@pytest.mark.parametrize("term", HAND_TABLE)
def test_each_term_equals_the_hand_table(term):
    terms = walk_reward(CONFIG, **three_robots())
    np.testing.assert_allclose(terms[term], HAND_TABLE[term], rtol=1e-12, atol=1e-15)


def test_the_hand_table_has_every_term():
    assert set(walk_reward(CONFIG, **three_robots())) == set(HAND_TABLE)


def test_the_paper_preset_is_table_i_and_b_and_nothing_else():
    weights = {name: value for name, value in asdict(RewardConfig.paper()).items() if value}
    assert weights == {**TABLE_I, "bonus": 200.0, "bonus_mode": "add"}


def test_the_additions_are_the_terms_that_table_i_lacks():
    assert set(ADDITIONS) == set(HAND_TABLE) - set(TABLE_I)
    assert len(set(ADDITIONS)) == len(ADDITIONS)


def test_a_weight_of_zero_silences_its_term():
    for name in HAND_TABLE:
        terms = walk_reward(replace(CONFIG, **{name: 0.0}), **three_robots())
        assert not terms[name].any()
        others = [terms[other] for other in HAND_TABLE if other != name]
        assert all(term.any() for term in others)


def test_perfect_motion_earns_every_reward_whole_and_no_penalty():
    sensed, truth = still(1)
    terms = walk_reward(
        CONFIG,
        replace(sensed, angular_velocity_b=np.array([[0.0, 0.0, 0.3]])),
        replace(truth, velocity_b=np.array([[0.9, 0.0, 0.0]])),
        Command(
            forward_speed=np.array([0.9]),
            yaw_rate=np.array([0.3]),
            stride_frequency=np.array([2.0]),
        ),
        stance=STANCE,
        agreement=np.ones(1),
        chatter=np.zeros(1),
        action_change=np.zeros((1, 12)),
    )
    earned = {name: term.item() for name, term in terms.items() if term.item() != 0}
    ours = {"speed_tracking": 2.0, "stance_feet": 5.0, "stance_pattern": 3.0}
    assert earned == {"forward_velocity": 10.0, **ours}


@settings(max_examples=30, deadline=None)
@given(angle=st.floats(-3.0, 3.0))
def test_the_reward_does_not_know_which_way_is_north(angle):
    robots = three_robots()
    sensed, truth = robots["sensed"], robots["truth"]
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    w, x, y, z = truth.base_quaternion_w.T
    a, b = np.cos(angle / 2), np.sin(angle / 2)
    # The product of (a, 0, 0, b) and (w, x, y, z).
    heading = np.stack([a * w - b * z, a * x - b * y, a * y + b * x, a * z + b * w], axis=1)
    turned = {
        "sensed": replace(sensed, orientation=heading),
        "truth": replace(
            truth, base_quaternion_w=heading, foot_velocity_w=truth.foot_velocity_w @ turn.T
        ),
    }
    before = walk_reward(CONFIG, **robots)
    after = walk_reward(CONFIG, **{**robots, **turned})
    for name, term in before.items():
        np.testing.assert_allclose(after[name], term, atol=1e-9, err_msg=name)


BONUS_TABLE = {
    # R_walk:              2, changed | -3, changed | 2, stayed | -3, stayed | 0.5, edge worth 2 b
    "add": (202.0, 197.0, 2.0, -3.0, 400.5),
    "multiply_clipped": (400.0, 0.0, 2.0, -3.0, 200.0),
    "multiply": (400.0, -600.0, 2.0, -3.0, 200.0),
}


@pytest.mark.parametrize("mode", BONUS_MODES)
def test_each_bonus_mode_equals_the_hand_table(mode):
    reward = with_bonus(
        RewardConfig.paper(mode),
        np.array([2.0, -3.0, 2.0, -3.0, 0.5]),
        np.array([1.0, 1.0, 0.0, 0.0, 2.0]),
    )
    np.testing.assert_array_equal(reward, BONUS_TABLE[mode])


@pytest.mark.parametrize(
    ("swing", "punctuality", "strictness", "earned"),
    [
        (1.0, 1.0, 1.0, [2.0, 1.0, 0.5, 0.25, 0.0]),
        (1.0, 1.0, 0.0, [2.0, 2.0, 1.0, 1.0, 0.0]),
        (1.0, 0.0, 1.0, [2.0, 1.0, 1.0, 0.5, 0.0]),
        (0.0, 1.0, 1.0, [2.0, 2.0, 0.5, 0.5, 0.0]),
        (0.5, 1.0, 0.5, [2.0, 1.75, 0.75, 0.65625, 0.0]),
    ],
)
def test_swing_and_punctuality_each_keep_their_share_of_the_bonus(
    swing, punctuality, strictness, earned
):
    """High and on time, low, late, low and late, no change."""
    config = RewardConfig(bonus_swing=swing, bonus_punctuality=punctuality)
    bonus = earned_bonus(
        config,
        np.array([2.0, 2.0, 1.0, 1.0, 0.0]),
        swing_share=np.array([1.0, 0.5, 1.0, 0.5, 1.0]),
        on_time=np.array([1.0, 1.0, 0.5, 0.5, 0.0]),
        strictness=strictness,
    )
    np.testing.assert_allclose(bonus, earned)


def test_multiplying_punishes_a_good_change_while_the_walk_is_bad_and_adding_does_not():
    walk = np.array([-3.0])

    def gain(mode):
        changed, stayed = (
            with_bonus(RewardConfig.paper(mode), walk, np.array([b])) for b in (1.0, 0.0)
        )
        return (changed - stayed).item()

    assert gain("multiply") == -597.0
    assert gain("add") == 200.0
    assert RewardConfig().bonus_mode == "add"


def test_the_bonus_leaves_the_walk_reward_as_it_was():
    walk = np.array([2.0, -3.0])
    for mode in BONUS_MODES:
        with_bonus(RewardConfig.paper(mode), walk, np.array([1.0, 0.0]))
    np.testing.assert_array_equal(walk, [2.0, -3.0])


def test_an_unknown_bonus_mode_is_refused_with_those_there_are():
    config = RewardConfig()
    object.__setattr__(config, "bonus_mode", "divide")  # a type checker would stop the constructor
    with pytest.raises(GaitshiftError, match="add, multiply_clipped, multiply, got 'divide'"):
        config.__post_init__()
