"""Replays of whole grids against the live condition, and statistics against scipy's own."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy import stats

from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.identification import (
    LabelledRun,
    ParameterGrid,
    Tally,
    auc,
    choose,
    counts_at,
    detections,
    false_shifts,
    first_firings,
    poisson,
    rough_ground,
    wilson,
)
from gaitshift.robot.state import Proprioception
from gaitshift.shift import HeightDifference, PlaneResidual, Rule, there_and_back, ways
from gaitshift.sim.terrain import from_spec, sections_of
from synthetic import turned

quick = settings(max_examples=40, deadline=None)
FEET = np.array(
    [[0.34, 0.21, -0.5], [0.35, -0.22, -0.5], [-0.33, 0.23, -0.5], [-0.36, -0.24, -0.5]]
)
PERIOD = 0.01


def recording(rng, steps, robots, *, roughness=0.05, rough_from=None, alive=None):
    """Robots that walk 1 m/s over noise; heights in sixteenths of a metre, so that ties occur."""
    noise = np.round(rng.normal(scale=roughness, size=(steps, robots, 4)) * 16) / 16
    feet = np.tile(FEET, (steps, robots, 1, 1))
    feet[..., 2] += noise
    at = np.arange(steps)[:, None]
    rough = np.zeros((steps, robots), dtype=bool) if rough_from is None else at >= rough_from
    sensed = Proprioception(
        contact=rng.random((steps, robots, 4)) < 0.6,
        foot_position_b=feet,
        orientation=turned(np.zeros((steps, robots))),
        has_heading=False,
        time=PERIOD * np.arange(1, steps + 1),
        period=PERIOD,
    )
    return LabelledRun(
        name="noise",
        sensed=sensed,
        rough=np.broadcast_to(rough, (steps, robots)).copy(),
        alive=np.ones((steps, robots), dtype=bool) if alive is None else alive,
        distance=np.tile(PERIOD * np.arange(1, steps + 1)[:, None], (1, robots)),
    )


def live(graph, rec, *, shifted):
    """Step in which each robot first shifts when the graph runs as on a robot; T if never."""
    state, first = graph.begin(rec.robots), np.full(rec.robots, len(rec.time))
    state = replace(state, gait=np.full(rec.robots, int(shifted)))
    for t, sensed in enumerate(rec):
        state, decision = graph.step(state, sensed)
        newly = decision.fired & (first == len(rec.time)) & rec.alive[t]
        first[newly] = t
    return first


# The grid -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("leak", [0.0, 0.1, 0.7, 1.3])
@pytest.mark.parametrize("shifted", [False, True])
@pytest.mark.parametrize("statistic", [HeightDifference(), PlaneResidual()])
def test_a_replay_fires_in_the_very_step_in_which_the_robot_did(leak, shifted, statistic):
    rng = np.random.default_rng(3)
    alive = np.ones((150, 4), dtype=bool)
    alive[90:, 2] = False
    rec = recording(rng, 150, 4, alive=alive)
    alphas, betas = np.array([0.02, 0.0625, 0.125]), np.array([0.0, 3.0, 10.3, 40.0, 900.0])
    rule = Rule(when="below" if shifted else "above", alpha=1.0, beta=1.0, leak=leak)
    first = first_firings(rec.values(statistic), rec.alive, rule, alphas, betas)
    for a, alpha in enumerate(alphas):
        for b, beta in enumerate(betas):
            there, back = (
                Rule(when=when, alpha=alpha, beta=beta, leak=leak) for when in ("above", "below")
            )
            graph = there_and_back(statistic, there, back)
            np.testing.assert_array_equal(first[:, a, b], live(graph, rec, shifted=shifted))
    assert (first == 150).any()
    if leak < 1 or (rule.when == "above" and statistic.width > 1):  # else k never rises
        assert first.min() < 60


values = arrays(np.float64, (6, 3), elements=st.sampled_from([0.0, 0.1, 0.2, 0.3, math.nan]))


@quick
@given(values, st.sampled_from(["above", "below"]))
def test_counts_of_all_alphas_are_those_of_the_rule_at_each(seen, when):
    alphas = np.array([0.05, 0.1, 0.2, 0.25])
    together = counts_at(seen, Rule(when=when, alpha=1.0, beta=1.0), alphas)
    for a, alpha in enumerate(alphas):
        rule = Rule(when=when, alpha=alpha, beta=1.0)
        np.testing.assert_array_equal(together[a], rule.count(seen))


def test_larger_alpha_or_beta_never_fires_earlier():
    rec = recording(np.random.default_rng(1), 200, 5)
    alphas, betas = np.linspace(0.01, 0.2, 9), np.arange(0.0, 300.0, 20.0)
    rule = Rule(alpha=1.0, beta=1.0, leak=0.4)
    first = first_firings(rec.values(HeightDifference()), rec.alive, rule, alphas, betas)
    assert (np.diff(first, axis=1) >= 0).all()
    assert (np.diff(first, axis=2) >= 0).all()


@pytest.mark.parametrize("grid", [np.array([]), np.array([0.2, 0.1]), np.array([0.1, 0.1])])
def test_a_grid_that_does_not_rise_is_refused(grid):
    seen, alive = np.zeros((2, 1, 6)), np.ones((2, 1), dtype=bool)
    with pytest.raises(GaitshiftError, match="grid values of α must rise"):
        first_firings(seen, alive, Rule(alpha=1.0, beta=1.0), grid, np.array([1.0]))


# What firings are worth ---------------------------------------------------------------------------


def test_detections_and_false_shifts_of_firings_set_by_hand():
    rec = recording(np.random.default_rng(0), 400, 6, rough_from=100)
    rec.rough[300:] = False
    rec.alive[50:, 5] = False  # never comes to the rough ground
    first = np.array([40, 100, 150, 299, 300, 400])[:, None, None]
    found = detections(rec, first)
    assert (found.came.item(), found.detected.item()) == (4, 3)
    np.testing.assert_allclose(found.delay_s[:, 0, 0], [np.nan, 0, 0.5, 1.99, np.nan, np.nan])
    np.testing.assert_allclose(found.delay_m[:, 0, 0], [np.nan, 0, 0.5, 1.99, np.nan, np.nan])
    false = false_shifts(rec, first)
    assert (false.fired.item(), false.robots) == (1, 6)
    assert false.km.item() == pytest.approx((0.4 + 4 * 1.0 + 0.5) / 1000)


@quick
@given(st.integers(0, 40), st.integers(1, 40))
def test_wilson_is_scipys(successes, more):
    trials = successes + more
    expected = stats.binomtest(successes, trials).proportion_ci(method="wilson")
    low, high = wilson(np.array([float(successes)]), np.array([float(trials)]))
    assert (low[0], high[0]) == pytest.approx((expected.low, expected.high), abs=1e-12)


def test_wilson_without_trials_says_nothing():
    assert [x.item() for x in wilson(np.zeros(1), np.zeros(1))] == [0.0, 1.0]


@pytest.mark.parametrize("events", [0, 1, 7])
def test_poissons_interval_leaves_a_fortieth_on_either_side(events):
    low, high = (x.item() for x in poisson(np.array([float(events)]), np.array([2.0])))
    assert stats.poisson.cdf(events, 2 * high) == pytest.approx(0.025)
    if events:
        assert stats.poisson.sf(events - 1, 2 * low) == pytest.approx(0.025)
    else:
        assert low == 0.0


@quick
@given(
    arrays(np.int64, (5, 2), elements=st.integers(0, 4)),
    arrays(np.int64, (7, 2), elements=st.integers(0, 4)),
)
def test_area_is_the_share_of_pairs_in_the_right_order(rough, smooth):
    pairs = rough[:, None] - smooth[None]
    expected = ((pairs > 0) + 0.5 * (pairs == 0)).mean(axis=(0, 1))
    np.testing.assert_allclose(auc(rough.astype(float), smooth.astype(float)), expected)


# Truth --------------------------------------------------------------------------------------------


def test_the_pieces_of_a_track_are_found_again_by_its_name():
    track = from_spec("flat@8,perlin:0.10@12,slope:5@3.5", seed=0, length=1.0, width=2.0)
    moved = track.moved(-2.0, 0.0)
    assert sections_of(moved.name, moved.origin[0], moved.size[0]) == moved.sections
    single = from_spec("pebbles:0.04", seed=0, length=6.0, width=2.0)
    assert sections_of(single.name, 0.0, 6.0) == single.sections


def test_a_name_that_is_none_is_refused():
    with pytest.raises(GaitshiftError, match="length must be a number of metres, got 'far'"):
        sections_of("flat@far", 0.0, 1.0)


def test_signals_of_a_recording_are_its_rows():
    plain, yaw = recording(np.random.default_rng(2), 3, 2), 0.5 * np.arange(6.0).reshape(3, 2)
    rec = replace(plain, sensed=replace(plain.sensed, orientation=turned(yaw), has_heading=True))
    rows = list(rec)
    assert [s.time for s in rows] == pytest.approx([0.01, 0.02, 0.03])
    assert rows[1].period == pytest.approx(0.01)
    np.testing.assert_allclose(rows[1].yaw, [1.0, 1.5])
    np.testing.assert_array_equal(rows[2].foot_position_b, rec.sensed.foot_position_b[2])
    assert [row.has_heading for row in (*rows, *plain)] == [True] * 3 + [False] * 3
    assert rows[0].joint_torque is None


# The choice ---------------------------------------------------------------------------------------

GRID = ParameterGrid(alphas=np.array([0.01, 0.03, 0.06]), betas=np.array([10.0, 12.0, 20.0, 40.0]))


def tally(fired, metres, detected=4, came=4):
    """A tally by hand: false shifts and summed delays [m] at α 0.03 and 0.06 (rows) and each β.

    α 0.01 is there for headroom: as quiet as 0.03, and never worth choosing.
    """
    made = Tally(shape=GRID.shape)
    made.fired[1:], made.metres[1:] = fired, metres
    made.detected[1:], made.came[1:] = detected, came
    made.fired[0], made.metres[0] = made.fired[1], 4000.0
    made.detected[0], made.came[0] = made.detected[1], made.came[1]
    made.km[:] = 2.0
    made.robots = 8
    return made


def test_the_soonest_of_the_settings_that_keep_still_is_chosen_with_headroom():
    ground = {"walk": tally([[1, 0, 0, 0], [0, 0, 0, 0]], [[2, 4, 8, 16], [6, 7, 9, 20]])}
    chosen = choose({0.0: ground}, GRID)
    # α 0.03: β 12 is free of false shifts, but 12 / 1.25 is not; β 20 is. α 0.06: β 10 has nothing
    # below it to show headroom, β 12 has no β between 9.6 and itself but 10 is above that.
    assert (chosen.alpha, chosen.beta, chosen.is_free) == (0.03, 20.0, True)
    assert chosen.cost_m == pytest.approx(8 / 4)


def test_a_setting_that_a_little_smaller_alpha_would_spoil_is_passed_over():
    """α 0.03 is quiet, but 0.0295 is not, and lies within a twentieth of it."""
    grid = ParameterGrid(alphas=np.array([0.01, 0.0295, 0.03, 0.032]), betas=np.array([0.0, 1.0]))
    made = Tally(shape=grid.shape)
    made.came[:], made.detected[:], made.km[:] = 4, 4, 2.0
    made.fired[:2], made.metres[:] = 1, np.arange(4.0)[:, None]
    assert choose({0.0: {"walk": made}}, grid).alpha == 0.032


def test_a_miss_costs_more_than_any_delay():
    missed = np.array([[4, 4, 4, 4], [4, 4, 3, 4]])
    ground = {"walk": tally(0, [[8, 8, 9, 8], [8, 8, 1, 8]], detected=missed)}
    chosen = choose({0.0: ground}, GRID)
    assert (chosen.alpha, chosen.beta) == (0.03, 40.0)


def test_of_several_leaks_one_that_keeps_still_is_taken_before_a_sooner_one():
    loud, calm = tally(1, 0.4), tally(0, 40.0)
    chosen = choose({0.0: {"walk": loud}, 0.5: {"walk": calm}}, GRID)
    assert (chosen.leak, chosen.is_free, chosen.false_per_km) == (0.5, True, 0.0)


def test_where_nothing_keeps_still_the_fewest_false_shifts_are_taken():
    ground = {"walk": tally([[3, 3, 2, 2], [3, 1, 2, 2]], 4.0)}
    chosen = choose({0.0: ground}, GRID)
    assert (chosen.alpha, chosen.beta, chosen.is_free) == (0.06, 12.0, False)
    assert chosen.false_per_km == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "message"),
    [({"came": 0}, "contain rough ground"), ({"km": 0.0}, "contain smooth ground")],
)
def test_recordings_of_one_kind_of_ground_are_refused(change, message):
    ground = tally(0, 1.0)
    for name, value in change.items():
        getattr(ground, name)[:] = value
    with pytest.raises(GaitshiftError, match=message):
        choose({0.0: {"walk": ground}}, GRID)


def tally_of(recordings, statistic, rule):
    """The tally of a rule's firings over all recordings, on `GRID`."""
    total = Tally(shape=GRID.shape)
    for one in recordings:
        values = one.values(statistic)
        total.add(one, first_firings(values, one.alive, rule, GRID.alphas, GRID.betas))
    return total


def test_tallies_of_parts_are_the_tally_of_the_whole():
    rng, statistic, rule = np.random.default_rng(4), HeightDifference(), Rule(alpha=1.0, beta=1.0)
    recordings = [recording(rng, 120, 3, rough_from=60) for _ in range(3)]
    whole = tally_of(recordings, statistic, rule)
    parts = Tally(shape=GRID.shape)
    for one in recordings:
        parts.join(tally_of([one], statistic, rule))
    for name in ("came", "detected", "seconds", "metres", "fired", "km"):
        np.testing.assert_allclose(getattr(parts, name), getattr(whole, name))
    assert (parts.robots, whole.robots) == (9, 9)
    assert whole.fired.any()
    np.testing.assert_allclose(whole.delay_m, whole.delay_s, atol=0.011)  # they walk 1 m/s


@pytest.fixture(scope="module")
def demo():
    """Two robots over 3 m of noise between level ground, and the graph they shifted by."""
    config = DemoConfig(track="flat@3,perlin:0.12@5,slope:5@3", episodes=2, beta=60.0)
    log, _ = run_demo(config)
    return log, config.ways


def test_noise_is_rough_and_level_ground_and_slopes_are_not(demo):
    log, _ = demo
    x = log.truth.base_position_w[..., 0]
    np.testing.assert_array_equal(rough_ground(log), (x >= 3.0) & (x < 8.0))
    assert x.max() > 9.0, "a slope was walked on"


def test_a_log_replayed_shifts_in_the_step_in_which_the_robots_did(demo):
    log, graph = demo
    rec = LabelledRun.from_log(log, "demo", rough_ground(log))
    there, _ = ways(graph)
    assert there.rule.beta == 60.0
    at = (np.array([there.rule.alpha]), np.array([there.rule.beta]))
    values = rec.values(graph.statistics[there.statistic])
    first = first_firings(values, rec.alive, there.rule, *at)
    shifted = log.gait != log.gait[0]
    assert shifted.any(axis=0).all()
    np.testing.assert_array_equal(first[:, 0, 0], shifted.argmax(axis=0))


def test_signals_of_a_log_are_those_that_robots_had(demo):
    log, _ = demo
    rec = LabelledRun.from_log(log, "demo", rough_ground(log))
    # Logs are in single precision.
    np.testing.assert_allclose(np.linalg.norm(rec.sensed.gravity_b, axis=2), 1.0, rtol=1e-5)
    # Feet are as far from the base whatever frame they are seen in.
    base = log.truth.base_position_w
    feet = log.truth.foot_position_w - base[:, :, None]
    np.testing.assert_allclose(
        np.linalg.norm(rec.sensed.foot_position_b, axis=3), np.linalg.norm(feet, axis=3), atol=1e-5
    )
    way = base[..., 0] - base[0, :, 0]
    assert (rec.distance >= way - 1e-3).all(), "a way is no shorter than the straight line"
    assert (rec.distance <= 1.1 * way + 0.2).all()
