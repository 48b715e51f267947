"""Statistics, rules and graphs: closed forms, invariances, and numpy's least squares."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitshift.errors import GaitshiftError
from gaitshift.shift import (
    CONDITIONS,
    STATISTICS,
    AttitudeVariance,
    Condition,
    ContactTiming,
    CostOfTransport,
    Edge,
    GaitGraph,
    HeightDifference,
    LegOdometry,
    Modulation,
    PlaneResidual,
    Rule,
    Signals,
    Slip,
    SpeedCommand,
    TouchdownSurprise,
    ValueDrop,
    load_condition,
)
from gaitshift.shift.statistics.heading import HeadingWatch
from gaitshift.shift.statistics.plane import deviation
from gaitshift.shift.statistics.surprise import STEADY, STEEP
from turning import rotation

quick = settings(max_examples=60, deadline=None)
PERIOD = 0.01
DOWN = np.array([0.0, 0.0, -1.0])
FEET = np.array(
    [[0.34, 0.21, -0.5], [0.35, -0.22, -0.5], [-0.33, 0.23, -0.5], [-0.36, -0.24, -0.5]]
)
ALL_DOWN = np.ones((1, 4), dtype=bool)
ONE_UP = FEET.copy()
"""The first foot 10 cm above the others: three pairs differ by that."""
ONE_UP[0, 2] += 0.1


def standing(n=1, **others):
    """Robots that stand on all feet."""
    return Signals(
        contact=np.ones((n, 4), dtype=bool),
        foot_position_b=np.tile(FEET, (n, 1, 1)),
        gravity_b=np.tile(DOWN, (n, 1)),
        **others,
    )


def random_signals(rng, n, step):
    """Signals unlike for every robot, foot and step."""
    gravity = DOWN + 0.3 * rng.normal(size=(n, 3))
    return Signals(
        contact=rng.random((n, 4)) < 0.6,
        foot_position_b=FEET + rng.normal(scale=0.1, size=(n, 4, 3)),
        gravity_b=gravity / np.linalg.norm(gravity, axis=1, keepdims=True),
        time=PERIOD * step,
        # No two alike, and steady: a robot that is thrown off its heading is told nothing.
        yaw=np.linspace(-2.0, 2.0, n) + 0.005 * rng.normal(size=n),
        velocity_b=rng.normal(size=(n, 3)),
        angular_velocity_b=rng.normal(size=(n, 3)),
        power=rng.random(n) * 300,
        speed_command=rng.random(n),
        stride=0.3 + rng.random(n),
        value=rng.normal(size=n),
        rough=rng.random(n) < 0.5,
    )


def arrays_in(state):
    """All arrays that a state holds."""
    if isinstance(state, np.ndarray):
        return [state]
    if state is None:
        return []
    return [a for f in fields(state) for a in arrays_in(getattr(state, f.name))]


# Laws that every statistic keeps ----------------------------------------------------------------


@pytest.mark.parametrize("kind", STATISTICS)
def test_robots_one_by_one_are_the_batch_bit_for_bit(kind):
    few = {"memory": 1} if kind == "touchdown_surprise" else {}  # they seldom tread new ground
    rng, statistic = np.random.default_rng(3), STATISTICS[kind](**few)
    batch, singles = statistic.start(5), [statistic.start(1) for _ in range(5)]
    for step in range(3000 if few else 1000):
        signals = random_signals(rng, 5, step)
        batch, values = statistic.step(batch, signals)
        assert values.shape == (5, statistic.width)
        for robot in range(5):
            singles[robot], alone = statistic.step(singles[robot], signals.of(np.array([robot])))
            np.testing.assert_array_equal(alone[0], values[robot])
    assert not np.isnan(values).any(), "that is long enough for all"


@pytest.mark.parametrize("kind", STATISTICS)
def test_who_shifts_begins_anew_and_the_others_go_on(kind):
    """From a firing on a robot is told what a condition tells it that has never seen it before."""
    rng, statistic = np.random.default_rng(7), STATISTICS[kind]()
    condition = Condition(statistic=statistic, alpha=1e-6, beta=3.0, statistic_back=ContactTiming())
    walk = [random_signals(rng, 3, step) for step in range(700)]
    state, nobody = condition.start(3), np.zeros(3, dtype=bool)
    for step, signals in enumerate(walk[:600]):
        before = state
        state, fires = condition.step(state, signals, nobody)
        if not fires.any():
            continue
        fresh, plain = condition.start(3), replace(condition, reset=False)
        ours, _ = plain.step(before, signals, nobody)
        for later in walk[step + 1 : step + 60]:
            fresh, _ = plain.step(fresh, later, nobody)
            ours, _ = plain.step(ours, later, nobody)
            after, _ = plain.step(state, later, nobody)
            for name in ("statistic", "statistic_back"):
                parts = (arrays_in(getattr(one, name)) for one in (fresh, ours, after))
                for anew, on, mine in zip(*parts, strict=True):
                    np.testing.assert_array_equal(mine[fires], anew[fires])
                    np.testing.assert_array_equal(mine[~fires], on[~fires])
            state = after
        return
    pytest.fail("it fires on such signals")


@pytest.mark.parametrize("kind", STATISTICS)
def test_a_step_writes_to_nothing_it_is_given(kind):
    rng, statistic = np.random.default_rng(5), STATISTICS[kind]()
    state = statistic.start(3)
    for step in range(4):
        signals = random_signals(rng, 3, step)
        given = [*arrays_in(state), *arrays_in(signals.foot_position_b), signals.contact]
        copies = [array.copy() for array in given]
        for array in given:
            array.flags.writeable = False
        state, _ = statistic.step(state, signals)
        for array, copy in zip(given, copies, strict=True):
            np.testing.assert_array_equal(array, copy)


@pytest.mark.parametrize("kind", STATISTICS)
def test_a_signal_that_is_missing_is_named_by_the_statistic_that_needs_it(kind):
    statistic = STATISTICS[kind]()
    for name in statistic.needs:
        signals = replace(random_signals(np.random.default_rng(0), 1, 0), **{name: None})
        with pytest.raises(GaitshiftError, match=f"needs the signal '{name}'"):
            statistic.step(statistic.start(1), signals)
    bare = standing()
    if not statistic.needs:
        statistic.step(statistic.start(1), bare)


@pytest.mark.parametrize("kind", ["height_difference", "plane_residual", "attitude_variance"])
def test_the_yaw_of_the_scene_changes_nothing(kind):
    rng, statistic = np.random.default_rng(7), STATISTICS[kind]()
    plain, turned = statistic.start(2), statistic.start(2)
    for step in range(60):
        signals = random_signals(rng, 2, step)
        plain, values = statistic.step(plain, signals)
        turned, same = statistic.step(turned, replace(signals, yaw=signals.yaw + 0.8))
        np.testing.assert_allclose(same, values, atol=1e-9)


@pytest.mark.parametrize("kind", ["height_difference", "plane_residual", "slip", "contact_timing"])
def test_no_leg_is_special(kind):
    rng, statistic, order = np.random.default_rng(9), STATISTICS[kind](), [2, 0, 3, 1]
    plain, mixed = statistic.start(2), statistic.start(2)
    for step in range(60):
        signals = random_signals(rng, 2, step)
        other = replace(
            signals,
            contact=signals.contact[:, order],
            foot_position_b=signals.foot_position_b[:, order],
        )
        plain, values = statistic.step(plain, signals)
        mixed, same = statistic.step(mixed, other)
        np.testing.assert_allclose(np.sort(same), np.sort(values), atol=1e-9)


# The plane ----------------------------------------------------------------------------------------


points = arrays(np.float64, (7, 3), elements=st.floats(-1.0, 1.0))


@quick
@given(points, st.integers(4, 7))
def test_deviation_is_that_of_numpys_least_squares(xyz, known):
    basis = np.column_stack([xyz[:known, :2], np.ones(known)])
    if np.linalg.svd(basis - basis.mean(axis=0))[1][1] < 0.05:
        return  # nearly in one line: many planes fit
    _, rest, _, _ = np.linalg.lstsq(basis, xyz[:known, 2], rcond=None)
    expected = math.sqrt(float(rest[0]) / (known - 3)) if rest.size else 0.0
    mask = np.arange(7)[None] < known
    assert deviation(xyz[None], mask)[0] == pytest.approx(expected, abs=1e-6)


def test_one_foot_of_four_on_a_rectangle_raised_by_h_is_h_half():
    """A plane leaves residuals of ± h/4 on all four: √(4 (h/4)² / 1) = h/2."""
    xyz = np.array([[[0.3, 0.2, 0.08], [0.3, -0.2, 0.0], [-0.3, 0.2, 0.0], [-0.3, -0.2, 0.0]]])
    assert deviation(xyz, ALL_DOWN)[0] == pytest.approx(0.04)


@quick
@given(points, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))
def test_tilting_and_lifting_the_ground_changes_no_deviation(xyz, slope_x, slope_y, lift):
    tilted = xyz.copy()
    tilted[:, 2] += slope_x * xyz[:, 0] + slope_y * xyz[:, 1] + lift
    known = np.ones((1, 7), dtype=bool)
    if np.linalg.svd(xyz[:, :2] - xyz[:, :2].mean(axis=0))[1][1] < 0.05:
        return
    assert deviation(tilted[None], known) == pytest.approx(deviation(xyz[None], known), abs=1e-6)


def test_three_touches_tell_nothing():
    known = np.array([[True, True, True, False]])
    assert np.isnan(deviation(FEET[None], known))


def strolling(height, *, seconds=4.0, speed=1.0, turn=0.2, wobble=0.15):
    """Signals of a robot that trots over ground of a height(x, y), and where its base is [m].

    Feet stand still in the world while they touch, and the body rolls and pitches meanwhile.
    """
    stride, phase = 0.5, np.array([0.0, 0.5, 0.5, 0.0])
    plan = FEET[:, :2]
    stood = [None] * 4
    for step in range(round(seconds / PERIOD)):
        time = step * PERIOD
        yaw = turn * math.sin(time)
        base = np.array([speed * time, 0.1 * math.sin(time), 0.0])
        base[2] = 0.5 + height(*base[:2])
        turned = rotation(wobble * math.sin(9 * time), wobble * math.cos(7 * time), yaw)
        feet, contact = np.empty((4, 3)), np.zeros(4, dtype=bool)
        for leg in range(4):
            within = (time / stride + phase[leg]) % 1.0
            contact[leg] = within < 0.55
            xy = base[:2] + rotation(0, 0, yaw)[:2, :2] @ plan[leg]
            if contact[leg] and stood[leg] is None:
                stood[leg] = np.array([*xy, height(*xy)])
            if not contact[leg]:
                stood[leg] = None
            feet[leg] = stood[leg] if contact[leg] else [*xy, height(*xy) + 0.1]
        yield (
            base,
            Signals(
                contact=contact[None],
                foot_position_b=((feet - base) @ turned)[None],
                gravity_b=(DOWN @ turned)[None],
                time=time,
                yaw=np.array([yaw]),
            ),
        )


def test_odometry_by_the_standing_feet_is_where_the_base_went():
    odometry = LegOdometry()
    state, first = odometry.start(1), None
    for base, signals in strolling(lambda x, y: 0.1 * x + 0.05 * y):
        state, _ = odometry.step(state, signals)
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


def course(statistic, height, **walk):
    """What a statistic of one number says in each step of a stroll over height(x, y)."""
    state, seen = statistic.start(1), []
    for _, signals in strolling(height, **walk):
        state, value = statistic.step(state, signals)
        seen.append(value[0, 0])
    return np.array(seen)


@pytest.mark.parametrize(
    "statistic",
    [
        *(PlaneResidual(touches=touches) for touches in (1, 2, 4)),
        TouchdownSurprise(),
        TouchdownSurprise(touches=2, memory=12),
    ],
    ids=str,
)
def test_a_slope_is_not_roughness_and_waves_are(statistic):
    grounds = {
        "slope": lambda x, y: 0.25 * x - 0.1 * y,
        "waves": lambda x, y: 0.05 * math.sin(5 * x) * math.cos(7 * y),
    }
    worst = {name: np.nanmax(course(statistic, z)[100:]) for name, z in grounds.items()}
    assert worst["slope"] < 0.012, "what odometry is off by"
    if isinstance(statistic, TouchdownSurprise):
        assert worst["waves"] > 20.0 * worst["slope"], "changes of errors, in a body that is turned"
    else:
        assert worst["waves"] > 0.02, "a sine times a cosine of 5 cm has a deviation of 2.5 cm"


def test_who_sways_is_told_less_in_proportion():
    """Far faster than the heading is followed a sway of A is off it by A/√2 in the mean."""

    def told(sway):
        statistic, state, seen = TouchdownSurprise(), None, []
        waves = strolling(
            lambda x, y: 0.05 * math.sin(5 * x) * math.cos(7 * y), turn=0.0, wobble=0.0, seconds=8.0
        )
        for _, signals in waves:
            state = state or statistic.start(1)
            yaw = np.array([sway * math.sin(20.0 * math.pi * signals.time)])
            state, value = statistic.step(state, replace(signals, yaw=yaw))
            seen.append(value[0, 0])
        return np.nanmean(seen[400:])

    still = told(0.0)
    assert told(0.5 * STEADY) == pytest.approx(still, rel=1e-3), (
        "who sways by less than a steady walker is told all"
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
    for _, signals in strolling(lambda x, y: 0.004 * x**3, **walk):
        state = state or statistic.start(1)
        state, value = statistic.step(state, signals)
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


def follow(yaws):
    """Who is thrown off the heading, step by step."""
    watch = HeadingWatch()
    state, off = watch.start(1), []
    for yaw in yaws:
        state, error = watch.step(state, replace(standing(), yaw=np.array([yaw])))
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


def test_who_stumbles_is_told_nothing_until_there_are_errors_enough_again():
    statistic, state, seen = TouchdownSurprise(), None, []
    for _, signals in strolling(lambda x, y: 0.0, seconds=8.0, turn=0.0, wobble=0.0):
        state = state or statistic.start(1)
        thrown = np.array([0.5 if signals.time > 4.0 else 0.0])
        state, value = statistic.step(state, replace(signals, yaw=thrown))
        seen.append(value[0, 0])
    known = ~np.isnan(np.array(seen))
    assert known[390:400].all()
    assert not known[402:500].any(), "six earlier touches, and four on new ground"
    assert known[-50:].all()


def test_a_foot_that_bounces_has_touched_once():
    statistic = PlaneResidual(touches=2)
    state = statistic.start(1)
    for contact in ([1, 1, 1, 1], [0, 1, 1, 1], [1, 1, 1, 1], *[[0, 1, 1, 1]] * 6, [1, 1, 1, 1]):
        signals = replace(standing(), contact=np.array([contact], dtype=bool))
        state, _ = statistic.step(state, signals)
        counts = (~np.isnan(state.touch[0, :, :, 0])).sum(axis=1).tolist()
    assert counts == [2, 1, 1, 1]


# The rivals, in closed form -----------------------------------------------------------------------


def test_attitude_of_a_robot_that_leans_steadily_does_not_vary():
    turned = rotation(0.3, -0.2, 0.0)
    statistic = AttitudeVariance()
    state = statistic.start(1)
    for _ in range(150):
        state, value = statistic.step(state, replace(standing(), gravity_b=(DOWN @ turned)[None]))
    assert value[0, 0] == pytest.approx(0.0, abs=1e-9)


def test_attitude_of_a_rolling_robot_varies_by_amplitude_over_root_2():
    statistic = AttitudeVariance(window=2.0)
    state, seen = statistic.start(1), []
    for step in range(1500):
        turned = rotation(0.1 * math.sin(2 * math.pi * 2 * step * PERIOD), 0.05, 0.0)
        state, value = statistic.step(state, replace(standing(), gravity_b=(DOWN @ turned)[None]))
        seen.append(value[0, 0])
    assert np.isnan(seen[:198]).all(), "a window has to go by first"
    assert seen[-1] == pytest.approx(0.1 / math.sqrt(2), rel=0.05)


@pytest.mark.parametrize("slide", [0.0, 0.3])
def test_slip_is_the_speed_of_standing_feet_over_the_ground(slide):
    statistic, velocity, rate = Slip(), np.array([1.0, 0.2, -0.1]), np.array([0.3, -0.4, 0.5])
    state, position = statistic.start(1), FEET.copy()
    for _ in range(200):
        signals = replace(
            standing(),
            foot_position_b=position[None].copy(),
            velocity_b=velocity[None],
            angular_velocity_b=rate[None],
        )
        state, value = statistic.step(state, signals)
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
        signals = Signals(
            contact=np.array(contact, dtype=bool),
            foot_position_b=FEET[None],
            gravity_b=DOWN[None],
            time=step * PERIOD,
            stride=np.array([0.5]),
        )
        state, value = statistic.step(state, signals)
        seen.append(value[0].copy())
    np.testing.assert_allclose(seen[130], [0.1, 0, 0, 0], atol=1e-9)
    assert seen[199][0] == pytest.approx(1.99 - 1.2 - 0.5)


def test_cost_of_transport_is_power_over_weight_and_speed():
    statistic = CostOfTransport(mass=20.0)
    state = statistic.start(1)
    for _ in range(120):
        walking = replace(
            standing(), power=np.array([150.0]), velocity_b=np.array([[1.5, 0.0, 0.0]])
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


# The rule -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("counts", "leak"), [(6, 0.0), (4, 0.5), (1, 0.5), (1, 1.0), (0, 0.5)])
def test_on_constant_input_k_rises_by_epsilon_counts_less_leak_and_fires_when_told(counts, leak):
    rule = Rule(alpha=0.1, beta=50.0, epsilon=1.0, leak=leak)
    values = np.array([[0.2] * counts + [0.0] * (6 - counts)])
    k, fired = np.zeros(1), []
    for step in range(1, 301):
        k = rule.step(k, values)
        assert k[0] == pytest.approx(max(step * (counts - leak), 0.0))
        if rule.fires(k, np.array([step * PERIOD]))[0]:
            fired.append(step)
    expected = rule.delay(counts)
    assert (fired[:1] or [math.inf])[0] * PERIOD == pytest.approx(expected)


def test_beta_in_time_is_when_a_robot_fires_whose_values_all_count():
    """The paper's 1000 counts at 100 Hz: 6 pairs, so the 167th step."""
    paper = Condition.paper()
    rough = paper.rough
    assert paper.soonest(shifted=False) == pytest.approx(1.67)
    assert paper.soonest(shifted=True) == pytest.approx(10.01), "below counts steps, not pairs"
    k, steps = np.zeros(1), 0
    while not rough.fires(k, np.ones(1))[0]:
        k, steps = rough.step(k, np.full((1, 6), 0.3)), steps + 1
    assert steps == 167


def test_k_leaks_to_zero_and_no_further():
    rule = Rule(alpha=0.1, beta=50.0, leak=0.5)
    k = np.array([1.2])
    seen = [(k := rule.step(k, np.array([[0.0]]))).item() for _ in range(4)]
    assert seen == pytest.approx([0.7, 0.2, 0.0, 0.0])


def test_hysteresis_keeps_a_robot_between_both_thresholds_in_its_gait():
    condition = Condition(alpha=0.05, beta=3.0, alpha_back=0.02, beta_back=3.0)
    between = FEET + 0.3 * (ONE_UP - FEET)
    for shifted in (False, True):
        state = condition.start(1)
        for _ in range(100):
            signals = replace(standing(), foot_position_b=between[None])
            state, fire = condition.step(state, signals, np.array([shifted]))
            assert not fire.any()


def test_no_shift_comes_before_a_gait_has_been_held():
    condition = Condition(alpha=0.05, beta=3.0, alpha_back=0.02, beta_back=3.0, hold=0.5)
    state, shifted, at = condition.start(1), np.array([False]), []
    for step in range(1, 201):
        feet = FEET if shifted[0] else ONE_UP
        signals = replace(standing(), foot_position_b=feet[None])
        state, fire = condition.step(state, signals, shifted)
        shifted = shifted ^ fire
        at += [step] if fire[0] else []
    assert at == [50, 100, 150, 200]


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("attitude_variance", "window", 0),
        ("slip", "window", -1.0),
        ("cost_of_transport", "mass", 0.0),
        ("cost_of_transport", "least_speed", 0.0),
        ("value_drop", "fast", 0.0),
        ("value_drop", "slow", "inf"),
        ("plane_residual", "least_swing", -0.1),
        ("touchdown_surprise", "least_swing", "nan"),
    ],
)
def test_a_setting_that_no_statistic_can_have_is_named_with_its_place(tmp_path, kind, name, value):
    path = tmp_path / "ways.toml"
    path.write_text(
        f'start = "trot"\n[statistic.s]\nkind = "{kind}"\n{name} = {value}\n'
        '[[edge]]\nfrom = "trot"\nto = "bound"\nstatistic = "s"\nalpha = 1\nbeta = 1\n'
    )
    with pytest.raises(GaitshiftError, match=rf"ways.toml.*statistic s.*{name} must be"):
        GaitGraph.load(path)


def test_without_reset_k_goes_on_from_where_it_fired():
    condition = Condition(alpha=0.05, beta=3.0, reset=False)
    state, seen = condition.start(1), []
    for _ in range(3):
        signals = replace(standing(), foot_position_b=ONE_UP[None])
        state, fire = condition.step(state, signals, np.array([False]))
        seen.append((state.k.item(), fire.item()))
    assert seen == [(3.0, False), (6.0, True), (9.0, True)]


def test_alpha_follows_speed_and_time():
    by_speed = Modulation(of="speed", points=((0.5, 1.0), (1.5, 3.0)))
    factor = by_speed.factor(standing(3, speed_command=np.array([0.2, 1.0, 9.0])))
    np.testing.assert_allclose(factor, [1.0, 2.0, 3.0])
    condition = Condition(alpha=0.05, modulation=Modulation(of="time", points=((1, 1), (2, 4))))
    for time, counts in ((0.0, 3), (1.2, 3), (1.6, 0)):  # α of 5 cm, 8 cm, 14 cm
        signals = replace(standing(time=time), foot_position_b=ONE_UP[None])
        state, _ = condition.step(condition.start(1), signals, np.array([False]))
        assert state.k.item() == counts


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ((), "points must be pairs"),
        (((1.0, 1.0), (1.0, 2.0)), "rising"),
        (((0.0, -1.0),), "above 0"),
    ],
)
def test_a_faulty_modulation_says_what_would_be_right(points, message):
    with pytest.raises(GaitshiftError, match=message):
        Modulation(of="speed", points=points)


def test_conditions_come_by_name_with_changed_numbers():
    changed = load_condition("paper", alpha=0.1, beta=None)
    assert changed == replace(Condition.paper(), alpha=0.1)
    with pytest.raises(GaitshiftError, match="did you mean 'paper'"):
        load_condition("papr")
    assert all(load_condition(name) == CONDITIONS[name] for name in CONDITIONS)


# The gait graph -----------------------------------------------------------------------------------

GRAPH = """
start = "trot"

[statistic.ground]
kind = "plane_residual"
touches = 3

[[edge]]
from = "trot"
to = "bound"
statistic = "ground"
alpha = 0.02
beta = 40
leak = 0.5
hold = 1.0
alpha_over = { of = "speed", points = [[0.4, 0.8], [1.2, 1.0]] }

[[edge]]
from = "bound"
to = "trot"
statistic = "ground"
when = "below"
alpha = 0.01
beta = 90
"""


def graph_file(folder, text=GRAPH):
    path = folder / "graph.toml"
    path.write_text(text)
    return path


def test_a_graph_file_says_which_gaits_there_are_and_when_to_shift(tmp_path):
    graph = GaitGraph.load(graph_file(tmp_path))
    over_speed = Modulation(of="speed", points=((0.4, 0.8), (1.2, 1.0)))
    assert graph.gaits == ("trot", "bound")
    assert graph.statistics == {"ground": PlaneResidual(touches=3)}
    assert graph.edges == (
        Edge(
            source="trot",
            target="bound",
            statistic="ground",
            rule=Rule(alpha=0.02, beta=40, leak=0.5, hold=1.0),
            modulation=over_speed,
        ),
        Edge(
            source="bound",
            target="trot",
            statistic="ground",
            rule=Rule(when="below", alpha=0.01, beta=90),
        ),
    )


def test_the_papers_two_gaits_are_a_graph_of_two_edges():
    graph = GaitGraph.of(Condition.paper(), flat="trot", rough="bound")
    there, back = graph.edges
    assert (there.source, there.target, back.source, back.target) == (
        "trot", "bound", "bound", "trot",
    )  # fmt: skip
    assert there.rule == Rule(when="above", alpha=0.2, beta=1000)
    assert back.rule == Rule(when="below", alpha=0.2, beta=1000)
    assert graph.statistics == {"ground": HeightDifference(frame="body")}


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('start = "trot"', 'start = "pace"', "start gait 'pace' to the gait 'trot'"),
        ('to = "bound"', 'to = "trot"', "edge trot -> trot: source and target must be different"),
        ('from = "bound"\nto = "trot"', 'from = "trot"\nto = "pace"',
         "edges trot -> bound and trot -> pace leave the same gait with the same priority 0"),
        ('kind = "plane_residual"', 'kind = "plane"', "unknown statistic 'plane'"),
        ("touches = 3", "toes = 3", "statistic ground: unknown key 'toes'"),
        ("touches = 3", "touches = 0", "touches must be 1 to 100 for each foot, got 0"),
        ("alpha = 0.02", 'alpha = "2 cm"', "edge 1: 'alpha' must be a number"),
        ("alpha = 0.02\n", "", "edge 1: key 'alpha' is missing"),
        ("beta = 90", "beta = -90", "edge 2: beta must be 0 or more and finite, got -90"),
        ('when = "below"', 'when = "under"', "edge 2: 'when' must be above or below, got 'under'"),
        ("[[0.4, 0.8], [1.2, 1.0]]", "[[0.4, 0.8], [1.2]]", "edge 1: alpha_over: 'points' must be"),
        ('statistic = "ground"\nwhen', 'statistic = "grund"\nwhen', "did you mean 'ground'"),
        ("[[edge]]", "[[edges]]", "unknown key 'edges'; did you mean 'edge'"),
    ],
)  # fmt: skip
def test_a_faulty_graph_file_is_named_with_its_place_and_what_would_be_right(
    tmp_path, old, new, message
):
    assert old in GRAPH
    path = graph_file(tmp_path, GRAPH.replace(old, new))
    with pytest.raises(GaitshiftError) as caught:
        GaitGraph.load(path)
    line = str(caught.value)
    assert line.startswith(str(path))
    assert message in line
    assert "\n" not in line


@pytest.mark.parametrize("name", ["terrain", "speed", "oscillators"])
def test_shipped_graphs_load_and_are_drawn_edge_by_edge(name):
    graph = GaitGraph.load(name)
    drawn = graph.mermaid()
    for edge in graph.edges:
        assert f"    {edge.source} --> {edge.target} : " in drawn
    assert f"[*] --> {graph.start}" in drawn


def test_an_unknown_graph_is_refused_with_those_there_are():
    with pytest.raises(GaitshiftError, match="known graphs: oscillators, speed, terrain"):
        GaitGraph.load("terran")


def test_the_graph_by_terrain_is_the_condition_that_was_found_best():
    ours = GaitGraph.of(CONDITIONS["touchdown_surprise"], flat="trot", rough="bound")
    assert GaitGraph.load("terrain") == ours


def test_the_way_back_may_watch_something_else():
    """There by the commanded speed, back by the heights of the feet; and so as a graph."""
    condition = Condition(
        statistic=SpeedCommand(),
        alpha=1.0,
        beta=4.0,
        statistic_back=HeightDifference(),
        alpha_back=0.05,
        beta_back=6.0,
    )
    graph = GaitGraph.of(condition, flat="trot", rough="bound")
    assert [type(graph.statistics[e.statistic]) for e in graph.edges] == [
        SpeedCommand,
        HeightDifference,
    ]
    state, shifted, fired = condition.start(1), np.array([False]), []
    for step in range(40):
        feet = FEET.copy()
        feet[0, 2] += 0.1 * (step < 30)
        signals = standing(speed_command=np.array([1.5 if step < 20 else 0.5]))
        signals = replace(signals, foot_position_b=feet[None])
        state, fire = condition.step(state, signals, shifted)
        if fire[0]:
            fired.append(step)
            shifted = ~shifted
    assert fired == [4, 36], "the fifth fast step; the seventh step with level feet"
