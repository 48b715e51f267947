"""Figures, names and verdicts on logs whose answers are known because they were made of them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitshift.gait import gaits
from gaitshift.lab.gait_analysis import (
    FIRST_GAITS,
    NONE,
    Sample,
    checks,
    gait_scores,
    limits_of,
    measure,
    name_gait,
)
from gaitshift.lab.gait_analysis.measure import stalled
from gaitshift.lab.gait_analysis.naming import share_in_order
from gaitshift.lab.gait_analysis.phase import Phases, axial_of, ideal_of, phase_errors
from gaitshift.lab.gait_analysis.sample import steady
from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.motor import Motor
from synthetic import TABLE, contacts, log_of, turned

TROT = gaits.load("trot")
LIGHT = replace(ANYMAL_B, mass=20.0)
FREQUENCY = {"walk": 1.25, "three_one": 1.6, "half_bound": 1.4}
"""Cycles a second where 2.5 would be too fast [Hz]."""


def sample_of(contact) -> Sample:
    return Sample.of(log_of(contact), 0.0)


def name(contact) -> str:
    return name_gait(gait_scores(sample_of(contact)))


def trotting(*, speed: float, period: int, steps: int, fallen_from: int | None) -> Log:
    """Robot 0 trots perfectly along x, `period` steps a cycle; robot 1 lies still."""
    left = (np.arange(steps) % period) < period // 2
    contact = np.zeros((steps, 2, 4), dtype=bool)
    contact[:, 0] = np.where(left[:, None], [1, 0, 0, 1], [0, 1, 1, 0])
    position, velocity = np.zeros((steps, 2, 3)), np.zeros((steps, 2, 3))
    position[..., 2] = 0.45
    position[:, 0, 0], velocity[:, 0, 0] = speed * np.arange(steps) / 100, speed
    joint_velocity, torque = np.zeros((steps, 2, 12)), np.zeros((steps, 2, 12))
    joint_velocity[:, 0, 0], torque[:, 0, 0] = 2.0, -30.0
    fallen = np.zeros((steps, 2), dtype=bool)
    if fallen_from is not None:
        fallen[fallen_from:, 1] = True
    still = np.zeros(steps, dtype=np.int64)
    return log_of(
        contact,
        base_position_w=position,
        velocity_b=velocity,
        joint_velocity=joint_velocity,
        joint_torque=torque,
        fallen=fallen,
        machine_state=np.stack([np.where(left, 0, 1), still], axis=1),
        stance_shown=np.stack([still == 0, still == 1], axis=1),
    )


# Figures ------------------------------------------------------------------------------------------


def test_figures_of_a_perfect_trot_are_those_it_was_made_of():
    """Period 40 steps: 2.5 Hz. Power 30 N·m · 2 rad/s = 60 W over 20 kg · 9.81 m/s² · 0.9 m/s.

    Froude number 0.9² / (9.81 · 0.45). The motor brakes: of the heat, 30² · 15/120 = 112.5 W, the
    60 W supply a part.
    """
    log = trotting(speed=0.9, period=40, steps=1200, fallen_from=0)
    figures = measure(log, {"trot": TROT}, LIGHT)
    assert figures["survival"] == 0.5
    assert figures["speed_mean"] == pytest.approx(0.9)
    assert [figures["speed_error"], figures["speed_rmse"]] == pytest.approx([0.3, 0.3])
    assert figures["pattern_fraction"] == 1.0
    assert figures["cycles_per_s"] == pytest.approx(2.5, abs=0.01)
    assert figures["touchdowns_per_cycle"] == pytest.approx([1.0] * 4)
    assert figures["duty_factor"] == pytest.approx([0.5] * 4, abs=0.01)
    assert figures["phase"] == pytest.approx([0.0, 0.5, 0.5, 0.0])
    assert figures["phase_consistency"] == pytest.approx([1.0] * 4)
    assert figures["flight_fraction"] == 0.0
    assert figures["cost_of_transport"] == pytest.approx(60 / (20 * 9.81 * 0.9))
    assert figures["electrical_cost_of_transport"] == pytest.approx(52.5 / (20 * 9.81 * 0.9))
    assert figures["saturation"] == 0.0
    assert figures["froude"] == pytest.approx(0.81 / (9.81 * 0.45))
    assert figures["verdict"]["gait"] == "trot"


def test_saturation_is_the_share_of_joints_and_steps_at_the_motors_limit():
    """Robot 0 has one joint of twelve at 30 N·m; robot 1 lies still with none."""
    log = trotting(speed=0.9, period=40, steps=1200, fallen_from=None)
    weak = replace(LIGHT, motor=replace(LIGHT.motor, torque_limit=30.0))
    assert measure(log, {"trot": TROT}, weak)["saturation"] == pytest.approx(1 / 24)


def test_windings_are_as_hot_as_the_heat_of_the_busiest_joint_makes_them():
    """Robot 0 has one joint of twelve at 30 N·m; the other lies. T = R_th · R/K² · τ²."""
    log = trotting(speed=0.9, period=40, steps=1200, fallen_from=0)
    motor = Motor(torque_limit=50.0, no_load_speed=20.0, stall_torque=100.0, thermal_resistance=2.0)
    hot = replace(LIGHT, motor=motor)
    assert measure(log, {"trot": TROT}, hot)["winding_rise"] == pytest.approx(2.0 * 0.2 * 900.0)
    assert measure(log, {"trot": TROT}, LIGHT)["winding_rise"] is None


def test_a_robot_stalls_whose_machine_waits_for_two_seconds():
    """Robot 1 stands from 8.0 s on and counts at 10.1 s, unless it has fallen; robot 0 trots."""
    for steps, fallen_from, share in ((1010, None, 0.5), (990, None, 0.0), (1010, 900, 0.0)):
        log = trotting(speed=0.9, period=40, steps=steps, fallen_from=fallen_from)
        log.machine_state[:800, 1] = np.arange(800) // 20 % 2
        log.machine_state[800:, 1] = 0
        assert stalled(log) == share
    assert stalled(trotting(speed=0.9, period=40, steps=150, fallen_from=None)) is None


def test_robots_count_until_their_fall_and_the_warm_up_does_not_count():
    """The still robot is in the mean while it is on its feet: (0.9 + 0) / 2."""
    for fallen_from, mean in ((None, 0.45), (200, 0.9)):
        log = trotting(speed=0.9, period=40, steps=1200, fallen_from=fallen_from)
        assert measure(log, {"trot": TROT}, LIGHT)["speed_mean"] == pytest.approx(mean)


def test_a_log_shorter_than_the_warm_up_has_no_figures_but_survival_and_line():
    log = trotting(speed=0.9, period=40, steps=150, fallen_from=None)
    figures = measure(log, {"trot": TROT}, LIGHT)
    assert figures["survival"] == 1.0
    assert figures["speed_mean"] is None
    assert figures["phase"] == figures["clearance"] == [None] * 4
    assert figures["verdict"]["gait"] == NONE
    assert not figures["verdict"]["clean"]


def test_drift_is_the_turn_that_was_not_commanded():
    """One robot turns at 0.3 rad/s though told 0.1, another as told: √(0.2²/2), past ± π too."""
    yaw = np.outer(np.arange(2200) / 100, [0.3, 0.1])
    contact = np.zeros((2200, 2, 4), dtype=bool)
    log = log_of(contact, quaternion=turned(yaw), yaw_rate_command=0.1)
    drift = measure(log, {"trot": TROT}, LIGHT)["heading_drift"]
    assert drift == pytest.approx(0.2 / np.sqrt(2), rel=1e-3)


def test_clearance_is_the_median_of_the_highest_point_of_each_stride():
    """Swings of FL reach 2, 4 and 9 cm in turn; a bounce in between is no swing."""
    log = trotting(speed=0.9, period=40, steps=1200, fallen_from=0)
    stride = np.arange(1200) // 40
    log.truth.clearance[30::40, 0, 0] = np.array([0.02, 0.04, 0.09])[stride[30::40] % 3]
    log.truth.foot_force[10:1200:40, 0, 0] = 0.0
    figures = measure(log, {"trot": TROT}, LIGHT)
    assert figures["clearance"][0] == pytest.approx(0.04)
    assert figures["touchdowns_per_cycle"][0] == pytest.approx(2.0)
    assert figures["phase"][1] == pytest.approx(0.5)


def test_touchdowns_are_held_against_those_the_machine_asks_for():
    """The hind feet of a three-one come down twice a cycle: that is 1, not 2."""
    machine = gaits.load("three_one")
    contact = contacts(*TABLE["three_one"], frequency=1.6, robots=2)
    first = contact[..., 0] & contact[..., 2]
    log = log_of(
        contact, gaits=("three_one",), machine_state=np.where(first, 0, 1).astype(np.int64)
    )
    figures = measure(log, {"three_one": machine}, LIGHT)
    assert figures["touchdowns_per_cycle"] == pytest.approx([1.0] * 4)


# Steps and phases ---------------------------------------------------------------------------------


@pytest.mark.parametrize("left_over", [0, 10, 20, 30])
def test_duty_factors_are_those_of_whole_cycles_however_the_log_ends(left_over):
    """With half a cycle left over, 3.5 of them have the one diagonal down for 4 halves of 7."""
    log = trotting(speed=0.9, period=40, steps=200 + 120 + left_over, fallen_from=0)
    figures = measure(log, {"trot": TROT}, LIGHT)
    assert figures["duty_factor"] == [0.5] * 4


def test_feet_of_a_robot_that_walks_no_cycle_are_down_for_their_share_of_the_time():
    contact = np.zeros((400, 1, 4), dtype=bool)
    contact[:, :, 0] = True
    contact[300:, :, 1] = True
    figures = measure(log_of(contact), {"trot": TROT}, LIGHT)
    assert figures["duty_factor"] == [1.0, 0.5, 0.0, 0.0]


def test_bounces_are_stance_and_stubs_are_swing_but_the_ends_stay():
    """At 100 Hz: gaps under 6 steps close, then contacts under 3 steps go."""
    text = "1..........111.....111......11..........1111......1"
    seen = "1..........11111111111..................1111......1"
    contact = np.array([c == "1" for c in text])[:, None, None] & np.ones((1, 1, 4), dtype=bool)
    result = steady(contact, 0.01)
    for leg in range(4):
        assert "".join("1" if x else "." for x in result[:, 0, leg]) == seen


@settings(max_examples=25)
@given(
    phase=st.tuples(*[st.floats(0.0, 0.99)] * 3),
    duty=st.floats(0.3, 0.7),
    frequency=st.floats(1.2, 3.0),
    seed=st.integers(0, 1000),
)
def test_phases_come_back_whatever_duty_and_frequency(phase, duty, frequency, seed):
    """To the control step: 10 ms, two of them at most between the ends of a stride."""
    touchdowns = ((0.0,), *((x,) for x in phase))
    contact = contacts(touchdowns, (duty,) * 4, frequency=frequency, robots=2, seed=seed)
    phases = Phases.of(sample_of(contact).touchdowns, 0.01)
    moments = phases.moments((1, 1, 1, 1))
    wanted = np.exp(2j * np.pi * np.array([0.0, *phase]))
    assert np.abs(np.angle(moments / wanted)).max() <= 2 * np.pi * 0.01 * frequency
    assert np.abs(moments).min() > 0.97
    assert phases.per_stride() == pytest.approx([1.0] * 4, abs=0.15)


def test_jitter_lowers_the_consistency_as_the_theory_says():
    """Touchdowns spread evenly by ± j of a stride: R of FR after FL is (sin 2πj / 2πj)²."""
    jitter = 0.05
    contact = contacts(*TABLE["trot"], frequency=2.0, robots=60, jitter=jitter)
    moments = Phases.of(sample_of(contact).touchdowns, 0.01).moments((1, 1, 1, 1))
    expected = np.sinc(2 * jitter * 2.0) ** 2
    assert np.abs(moments[1]) == pytest.approx(expected, abs=0.03)


def test_feet_that_come_down_twice_a_stride_have_one_mean_on_half_the_circle():
    machine = gaits.load("three_one")
    assert axial_of(machine) == (1, 1, 2, 2)
    touchdowns = ((0.0,), (0.5,), (0.1, 0.6), (0.9, 0.4))
    phases = Phases.of(
        sample_of(contacts(touchdowns, (0.5, 0.5, 0.6, 0.6), frequency=1.6)).touchdowns, 0.01
    )
    moments = phases.moments(axial_of(machine))
    assert np.abs(moments).min() > 0.97
    assert np.abs(phases.moments((1, 1, 1, 1))[2:]).max() < 0.05
    mean = np.angle(moments) / (2 * np.pi) / np.array(axial_of(machine))
    assert mean == pytest.approx([0.0, 0.5, 0.1, -0.1], abs=0.02) or mean == pytest.approx(
        [0.0, -0.5, 0.1, -0.1], abs=0.02
    )
    assert phase_errors(mean, machine) == pytest.approx([0.0, 0.0, 0.1, 0.1], abs=0.02)


@pytest.mark.parametrize("turns", [-1.0, 0.0, 2.0])
def test_phase_errors_go_round_the_circle(turns):
    phase = np.array([0.02, 0.45, 0.55, 0.97]) + turns
    assert phase_errors(phase, TROT) == pytest.approx([0.02, 0.05, 0.05, 0.03])


def test_no_stride_spans_two_robots_or_a_fall():
    contact = contacts(*TABLE["trot"], frequency=2.5, robots=3)
    fallen = np.zeros(contact.shape[:2], dtype=bool)
    fallen[300:, 1] = True
    whole = [sample_of(contact[:, [i]]) for i in (0, 2)] + [sample_of(contact[:300, [1]])]
    together = Sample.of(replace(log_of(contact), fallen=fallen), 0.0)
    counts = [Phases.of(s.touchdowns, 0.01).strides for s in (*whole, together)]
    assert sum(counts[:3]) == counts[3]


# Names --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("gait", sorted(TABLE))
@settings(max_examples=12)
@given(
    longer=st.floats(0.85, 1.15),
    faster=st.floats(0.8, 1.2),
    jitter=st.floats(0.0, 0.03),
    seed=st.integers(0, 1000),
)
def test_every_gait_is_named_whatever_its_duty_and_pace(gait, longer, faster, jitter, seed):
    """Slight flight or overlap: stances 15 % shorter or longer; ± 3 cs of jitter."""
    touchdowns, duty = TABLE[gait]
    frequency = faster * FREQUENCY.get(gait, 2.5)
    contact = contacts(
        touchdowns,
        np.array(duty) * min(longer, 1.1 if gait in ("walk", "three_one") else longer),
        frequency=frequency,
        jitter=jitter,
        seed=seed,
    )
    assert name(contact) == gait


def test_feet_that_land_a_moment_apart_leave_the_order_as_it_is():
    """A three-one whose front foot leads its hind feet by 10 ms stands on it alone at landing too.

    For this moment it shows a stance set of the machine that is not in order.
    """
    touchdowns = ((0.985,), (0.485,), (0.0, 0.5), (0.0, 0.5))
    contact = contacts(touchdowns, (0.46, 0.46, 0.58, 0.58), frequency=1.4)
    assert name(contact) == "three_one"


def test_every_shipped_machine_is_in_the_table():
    assert {*TABLE, "stand"} == set(gaits.names())


def test_a_gallop_is_one_on_either_lead():
    contact = contacts(*TABLE["gallop"], frequency=2.5)
    assert name(contact[..., [1, 0, 3, 2]]) == "gallop"


@settings(max_examples=20)
@given(down=st.floats(0.05, 0.95), hold=st.integers(1, 40), seed=st.integers(0, 1000))
def test_noise_is_no_gait(down, hold, seed):
    """Each foot drawn anew, every `hold` steps, on its own."""
    drawn = np.random.default_rng(seed).random((1000 // hold + 1, 4, 4)) < down
    assert name(np.repeat(drawn, hold, axis=0)[:1000]) == NONE


def test_standing_is_a_gait_of_its_own_and_hanging_is_none():
    assert name(np.ones((1000, 4, 4), dtype=bool)) == "stand"
    assert name(np.zeros((1000, 4, 4), dtype=bool)) == NONE
    lifted = np.ones((1000, 4, 4), dtype=bool)
    lifted[::5, :, 0] = False  # one foot of each robot shivers
    assert name(lifted) == NONE
    lifted[:900] = True
    assert name(lifted) == "stand", "in one step of fifty"
    lifted = np.ones((1000, 4, 4), dtype=bool)
    lifted[300:310, :2] = False  # two robots in four step once
    assert name(lifted) == NONE


@pytest.mark.parametrize("half", [1, 2, 3, 5, 8])
@pytest.mark.parametrize("gait", ["pronk", "trot"])
def test_vibration_is_no_gait(gait, half):
    """All of a gait's stances in order, but 6 to 50 times a second."""
    on = (np.arange(1000) // half % 2 == 0)[:, None, None]
    feet = [1, 1, 1, 1] if gait == "pronk" else [1, 0, 0, 1]
    contact = np.broadcast_to(on, (1000, 4, 4)) ^ ~np.array(feet, dtype=bool)
    assert name(contact) == NONE


def test_a_robot_whose_feet_flicker_shows_no_gait():
    contact = contacts(*TABLE["trot"], frequency=2.5)
    flicker = np.random.default_rng(0).random(contact.shape) < 0.5
    assert name(contact & flicker) == NONE


def test_a_half_bound_that_always_lands_on_the_same_foot_is_half_in_order_and_no_gait():
    machine = gaits.load("half_bound")
    contact = _one_hind_foot()
    alive = np.ones(contact.shape[:2], dtype=bool)
    assert share_in_order(contact, alive, machine) < 0.5
    assert name(contact) == NONE
    right = contacts(*TABLE["half_bound"], frequency=1.4, robots=1)
    assert share_in_order(right, np.ones(right.shape[:2], dtype=bool), machine) > 0.9


def _one_hind_foot():
    front = (np.arange(1000) // 18 % 2 == 0)[:, None]
    return np.where(front, [True, True, False, False], [False, False, True, False])[:, None]


# Verdict ------------------------------------------------------------------------------------------

GOOD = {
    "survival": 1.0,
    "speed_error": 0.01,
    "pattern_fraction": 0.9,
    "touchdowns_per_cycle": [1.0, 1.02, 0.97, 1.05],
    "phase": [0.0, 0.52, 0.49, 0.98],
    "phase_consistency": [1.0, 0.99, 0.98, 0.97],
    "duty_factor": [0.48, 0.47, 0.52, 0.50],
    "clearance": [0.06, 0.07, 0.08, 0.055],
    "stalled": 0.004,
}


def misses(figures, gait="trot"):
    return [(c.figure, c.foot) for c in checks(figures, gaits.load(gait)) if not c.passed]


def test_a_trot_within_all_limits_misses_none():
    assert misses(GOOD) == []


@pytest.mark.parametrize(
    ("figure", "value", "miss"),
    [
        ("survival", 0.998, ("survival", None)),
        ("speed_error", 0.06, ("speed_error", None)),
        ("pattern_fraction", 0.79, ("pattern_fraction", None)),
        ("touchdowns_per_cycle", [1.0, 1.0, 0.89, 1.05], ("touchdown_error", "BL")),
        ("touchdowns_per_cycle", None, ("touchdown_error", None)),
        ("phase", [0.0, 0.56, 0.5, 0.0], ("phase_error", "FR")),
        ("phase", [0.0, 0.5, None, 0.0], ("phase_error", "BL")),
        ("phase_consistency", [1.0, 0.97, 0.97, 0.94], ("phase_consistency", "BR")),
        ("duty_factor", [0.5, 0.5, 0.54, 0.48], ("duty_asymmetry", "BL")),
        ("clearance", [0.049, 0.06, 0.06, 0.06], ("clearance", "FL")),
        ("stalled", 0.03, ("stalled", None)),
    ],
)
def test_each_limit_is_missed_by_its_own_figure(figure, value, miss):
    assert misses(GOOD | {figure: value}) == [miss]


def test_a_gait_with_a_leading_side_may_be_lopsided():
    lopsided = GOOD | {
        "duty_factor": [0.3, 0.2, 0.3, 0.2],
        "phase": ideal_of(gaits.load("gallop")).tolist(),
    }
    assert misses(lopsided, "gallop") == []


def test_other_gaits_have_limits_no_stricter_than_the_first():
    first, others = limits_of("trot"), limits_of("walk")
    assert {limits_of(gait) for gait in FIRST_GAITS} == {first}
    assert others.survival < first.survival
    assert others.clearance < first.clearance
    assert others.phase_error > first.phase_error


def test_another_gait_than_the_one_in_force_is_not_clean():
    """A perfect pace while the machine is the trot's."""
    contact = contacts(*TABLE["pace"], frequency=2.5)
    verdict = measure(log_of(contact), {"trot": TROT}, LIGHT)["verdict"]
    assert verdict["gait"] == "pace"
    assert not verdict["clean"]
    assert {"figure": "phase_error", "foot": "BL"}.items() <= next(
        miss for miss in verdict["misses"] if miss["figure"] == "phase_error"
    ).items()
