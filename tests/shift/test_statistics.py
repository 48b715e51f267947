"""Laws of every statistic: robots one by one, invariances, nothing but what is sensed."""

from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Privileged, Proprioception, turned
from gaitshift.shift import (
    STATISTICS,
    ContactTiming,
    Oracle,
    Rule,
    Statistic,
    load_graph,
    there_and_back,
)
from gaitshift.shift.statistics import watch
from sensing import PERIOD, random_sensed, standing

BY_SENSES = tuple(kind for kind in STATISTICS if kind != "oracle")
"""Statistics of what robots sense."""


LONG = 3000
"""Steps in which robots that move at random tread new ground often enough."""


def soon_known(kind):
    """The statistic, of a short memory where robots at random seldom tread new ground."""
    return STATISTICS[kind](**({"memory": 1.0} if kind == "touchdown_surprise" else {}))


def random_walk(rng, n, steps):
    """What robots sense, and what only an oracle knows, in each step."""
    for step in range(steps):
        yield random_sensed(rng, n, step), rng.random(n) < 0.5


def arrays_in(state):
    """All arrays that a state holds."""
    if isinstance(state, np.ndarray):
        return [state]
    if not is_dataclass(state):
        return []
    return [a for f in fields(state) for a in arrays_in(getattr(state, f.name))]


@pytest.mark.parametrize("kind", STATISTICS)
def test_robots_one_by_one_are_the_batch_bit_for_bit(kind):
    rng, statistic = np.random.default_rng(3), soon_known(kind)
    batch, singles = statistic.start(5), [statistic.start(1) for _ in range(5)]
    for sensed, rough in random_walk(rng, 5, 1500 if kind == "touchdown_surprise" else 500):
        batch, values = watch(statistic, batch, sensed, rough)
        assert values.shape == (5, statistic.width)
        for robot in range(5):
            ids = np.array([robot])
            singles[robot], alone = watch(statistic, singles[robot], sensed.robots(ids), rough[ids])
            np.testing.assert_array_equal(alone[0], values[robot])
    assert not np.isnan(values).any(), "that is long enough for all"


@pytest.mark.parametrize("kind", STATISTICS)
def test_who_shifts_begins_anew_and_the_others_go_on(kind):
    """After a shift a statistic knows of a robot what it knows of one never seen before."""
    rng, statistic = np.random.default_rng(7), soon_known(kind)
    never = Rule(when="below", alpha=1e-9, beta=1e9)
    graph = there_and_back(
        statistic, Rule(alpha=1e-6, beta=3.0), never, statistic_back=ContactTiming()
    )
    plain = replace(graph, reset=False)
    walk = list(random_walk(rng, 3, LONG))
    state = graph.begin(3)
    for step, seen in enumerate(walk[:-100]):
        before = state
        state, decision = graph.step(state, *seen)
        fired = decision.fired
        if not fired.any():
            continue
        fresh, after = plain.begin(3), state
        ours, _ = plain.step(before, *seen)
        for later in walk[step + 1 : step + 60]:
            fresh, _ = plain.step(fresh, *later)
            ours, _ = plain.step(ours, *later)
            after, _ = plain.step(after, *later)
            for name in graph.statistics:
                parts = (arrays_in(one.memory[name]) for one in (fresh, ours, after))
                for anew, on, mine in zip(*parts, strict=True):
                    np.testing.assert_array_equal(mine[fired], anew[fired])
                    np.testing.assert_array_equal(mine[~fired], on[~fired])
        return
    pytest.fail("it fires on such signals")


@pytest.mark.parametrize("kind", STATISTICS)
def test_a_step_writes_to_nothing_it_is_given(kind):
    rng, statistic = np.random.default_rng(5), STATISTICS[kind]()
    state = statistic.start(3)
    for sensed, rough in random_walk(rng, 3, 4):
        given = [*arrays_in(state), *arrays_in(sensed), rough]
        copies = [array.copy() for array in given]
        for array in given:
            array.flags.writeable = False
        state, _ = watch(statistic, state, sensed, rough)
        for array, copy in zip(given, copies, strict=True):
            np.testing.assert_array_equal(array, copy)


@pytest.mark.parametrize("kind", BY_SENSES)
def test_a_field_that_is_missing_is_named_by_the_statistic_that_needs_it(kind):
    statistic = STATISTICS[kind]()
    for name in statistic.needs:
        sensed = replace(random_sensed(np.random.default_rng(0), 1, 0), **{name: None})
        with pytest.raises(GaitshiftError) as caught:
            statistic.step(statistic.start(1), sensed)
        assert str(caught.value).endswith(f"needs '{name}', which is not given")
    if not statistic.needs:
        statistic.step(statistic.start(1), standing())


@pytest.mark.parametrize("kind", BY_SENSES)
def test_fields_that_a_statistic_does_not_name_change_nothing(kind):
    """What it reads is what it says: the three fields that are always there, and its needs."""
    rng, statistic = np.random.default_rng(2), STATISTICS[kind]()
    optional = {f.name for f in fields(Proprioception) if f.default is None}
    unread = dict.fromkeys(optional - set(statistic.needs))
    full, bare = statistic.start(2), statistic.start(2)
    for sensed, _ in random_walk(rng, 2, 60):
        full, values = statistic.step(full, sensed)
        bare, same = statistic.step(bare, replace(sensed, **unread))
        np.testing.assert_array_equal(same, values)


@pytest.mark.parametrize("kind", ["height_difference", "plane_residual", "attitude_variance"])
def test_the_yaw_of_the_scene_changes_nothing(kind):
    rng, statistic = np.random.default_rng(7), STATISTICS[kind]()
    plain, aside = statistic.start(2), statistic.start(2)
    for sensed, _ in random_walk(rng, 2, 60):
        other = replace(sensed, orientation=turned(sensed.orientation, np.full(2, 0.8)))
        plain, values = statistic.step(plain, sensed)
        aside, same = statistic.step(aside, other)
        np.testing.assert_allclose(same, values, atol=1e-9)


@pytest.mark.parametrize("kind", ["height_difference", "plane_residual", "slip", "contact_timing"])
def test_no_leg_is_special(kind):
    rng, statistic, order = np.random.default_rng(9), STATISTICS[kind](), [2, 0, 3, 1]
    plain, mixed = statistic.start(2), statistic.start(2)
    for sensed, _ in random_walk(rng, 2, 60):
        other = replace(
            sensed,
            contact=sensed.contact[:, order],
            foot_position_b=sensed.foot_position_b[:, order],
        )
        plain, values = statistic.step(plain, sensed)
        mixed, same = statistic.step(mixed, other)
        np.testing.assert_allclose(np.sort(same), np.sort(values), atol=1e-9)


# The truth --------------------------------------------------------------------------------------


def test_an_oracle_alone_is_no_statistic_of_what_robots_sense():
    assert all(isinstance(STATISTICS[kind](), Statistic) for kind in BY_SENSES)
    assert not isinstance(Oracle(), Statistic)


def test_nothing_that_only_a_simulator_knows_is_sensed():
    truth, sensed = ({f.name for f in fields(record)} for record in (Privileged, Proprioception))
    assert truth & sensed == {"velocity_b"}, "which a robot estimates, and a simulator knows"


def test_an_oracle_to_whom_nobody_tells_the_truth_says_so_in_one_line():
    graph = load_graph("oracle")
    for ask in (
        lambda: graph.step(graph.begin(2), standing(2)),
        lambda: watch(Oracle(), None, standing(2)),
    ):
        with pytest.raises(GaitshiftError) as caught:
            ask()
        line = str(caught.value)
        assert "oracle" in line
        assert "\n" not in line


def test_an_oracle_shifts_where_the_truth_says_rough_and_back_where_not():
    graph = load_graph("oracle")
    state, seen = graph.begin(2), []
    for step, rough in enumerate([(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]):
        sensed = standing(2, time=step * PERIOD)
        state, _ = graph.step(state, sensed, np.array(rough, dtype=bool))
        seen.append([graph.gaits[index] for index in state.gait])
    assert seen == [
        ["trot", "trot"],
        ["bound", "trot"],
        ["bound", "bound"],
        ["trot", "bound"],
        ["trot", "trot"],
    ]


@pytest.mark.parametrize("kind", BY_SENSES)
def test_the_truth_changes_nothing_of_what_a_statistic_says(kind):
    rng, statistic = np.random.default_rng(4), STATISTICS[kind]()
    told, untold = statistic.start(2), statistic.start(2)
    for sensed, rough in random_walk(rng, 2, 30):
        told, values = watch(statistic, told, sensed, rough)
        untold, same = watch(statistic, untold, sensed)
        np.testing.assert_array_equal(same, values)
