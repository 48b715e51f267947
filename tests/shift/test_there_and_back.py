"""Algorithm 1 and its reverse as a graph, against the printed loops in plain Python."""

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
    HeightDifference,
    Rule,
    SpeedCommand,
    between,
    load_graph,
    numbers_of,
    shipped_graphs,
    there_and_back,
    tuned,
    ways,
)
from sensing import FEET, ONE_UP, UPRIGHT, standing

PAPER = load_graph("paper")
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


def feet_at(z):
    """Feet (..., 4, 3) that stand where `FEET` do, with heights z (..., 4)."""
    return np.concatenate([np.broadcast_to(FEET[:, :2], (*z.shape, 2)), z[..., None]], axis=-1)


def walk(graph, z, contact, *, rough=False, state=None):
    """Gait, counter k and firing in each step of an upright robot, which begins in either gait."""
    state = graph.begin(1) if state is None else state
    state = replace(state, gait=np.array([int(rough)]))
    told = []
    for heights, touches in zip(z, contact, strict=True):
        sensed = standing(contact=touches[None], foot_position_b=feet_at(heights[None]))
        state, decision = graph.step(state, sensed)
        told.append((graph.gaits[state.gait[0]], decision.k.item(), decision.fired.item()))
    return told


def first_firing(graph, z, contact, *, rough=False):
    """Index of the first step that fires, or infinity."""
    fired = [step for step, row in enumerate(walk(graph, z, contact, rough=rough)) if row[2]]
    return fired[0] if fired else math.inf


def printed(z, contact, *, rough, reset, alpha, beta, alpha_back, beta_back, epsilon):
    """The same by the paper's loops: Algorithm 1 in the gait for flat ground, else its reverse.

    The reverse counts a step in which four heights are known and no two disagree.
    """
    h, k = [None] * 4, 0.0
    for heights, touches in zip(z.tolist(), contact.tolist(), strict=True):
        for i in range(4):
            if touches[i]:
                h[i] = heights[i]
        if not rough:
            for i in range(4):
                for j in range(i):
                    if None not in (h[i], h[j]) and abs(h[i] - h[j]) > alpha:
                        k = k + epsilon
        elif None not in h and all(abs(x - y) < alpha_back for x in h for y in h):
            k = k + epsilon
        told = k
        fires = k > (beta_back if rough else beta)
        if fires:
            rough = not rough
            if reset:
                h, k = [None] * 4, 0.0
        yield "bound" if rough else "trot", told, fires


@quick
@given(walks, sixteenths, sixteenths, exact_epsilons, st.tuples(*[st.integers(1, 20)] * 2),
       st.booleans(), st.booleans())  # fmt: skip
def test_a_graph_there_and_back_is_the_papers_loops_step_by_step(
    steps, alpha, alpha_back, epsilon, betas, rough, reset
):
    beta, beta_back = map(float, betas)
    graph = there_and_back(
        HeightDifference(frame="body"),
        Rule(alpha=alpha, beta=beta, epsilon=epsilon),
        Rule(when="below", alpha=alpha_back, beta=beta_back, epsilon=epsilon),
        reset=reset,
    )
    expected = printed(
        *steps,
        rough=rough,
        reset=reset,
        alpha=alpha,
        beta=beta,
        alpha_back=alpha_back,
        beta_back=beta_back,
        epsilon=epsilon,
    )
    assert walk(graph, *steps, rough=rough) == list(expected)


@pytest.mark.parametrize("reset", [True, False])
def test_the_papers_numbers_shift_as_its_loops_do_on_a_long_walk(reset):
    """1.7 s of steps at most and 10 s of flat ground: both ways, and more than once."""
    rng = np.random.default_rng(0)
    is_flat = np.arange(4000) // 1300 % 2 == 1
    z = np.where(is_flat[:, None], 0.0, rng.uniform(-0.3, 0.3, (4000, 4)))
    contact = rng.random((4000, 4)) < 0.5
    graph = replace(PAPER, reset=reset)
    numbers = {"alpha": 0.2, "beta": 1000, "alpha_back": 0.2, "beta_back": 1000, "epsilon": 1}
    expected = list(printed(z, contact, rough=False, reset=reset, **numbers))
    assert walk(graph, z, contact) == expected
    assert sum(fired for _, _, fired in expected) >= 3


@pytest.mark.parametrize(
    ("heights", "step"),
    [([0.0, 0.3, 0.6, 0.9], 167), ([0.0, 0.11, 0.11, 0.22], 1001), ([0.0, 0.1, 0.1, 0.2], None)],
)
def test_paper_setting_fires_after_1_7_s_with_six_pairs_and_10_s_with_one(heights, step):
    z = np.tile(heights, (1100, 1))
    first = first_firing(PAPER, z, np.ones_like(z, dtype=bool))
    assert first + 1 == (math.inf if step is None else step)


def test_reverse_rule_fires_on_the_first_step_past_beta_back():
    z = np.tile([0.0, 0.05, 0.1, 0.19], (200, 1))
    told = walk(tuned(PAPER, beta_back=150.0), z, np.ones_like(z, dtype=bool), rough=True)
    assert [step for step, row in enumerate(told) if row[2]] == [150]


@quick
@given(walks, sixteenths, sixteenths, st.integers(1, 60), st.integers(1, 60))
def test_larger_alpha_or_beta_never_fires_earlier(steps, alpha, more, beta, more_counts):
    graph = tuned(PAPER, alpha=alpha, beta=float(beta))
    first = first_firing(graph, *steps)
    assert first_firing(tuned(graph, alpha=alpha + more), *steps) >= first
    assert first_firing(tuned(graph, beta=float(beta + more_counts)), *steps) >= first


@quick
@given(walks, st.sampled_from(list(permutations(range(4)))), st.booleans())
def test_no_leg_is_special_to_the_counter(steps, order, rough):
    z, contact = steps
    assert walk(PAPER, z[:, order], contact[:, order], rough=rough) == walk(
        PAPER, z, contact, rough=rough
    )


@pytest.mark.parametrize("rough", [False, True])
def test_feet_that_never_touched_take_part_in_no_pair(rough):
    contact = np.tile([True, False, True, True], (5, 1))
    uneven = np.tile([0.5, 9.0, 0.0, 0.0], (5, 1))
    level = np.tile([0.5, 0.5, 0.5, 0.5], (5, 1))
    counted = [k for _, k, _ in walk(PAPER, level if rough else uneven, contact, rough=rough)]
    assert counted == ([0, 0, 0, 0, 0] if rough else [2, 4, 6, 8, 10])


@pytest.mark.parametrize("rough", [False, True])
def test_height_that_is_not_a_number_counts_for_neither_rule_until_the_foot_touches(rough):
    z = np.array([[0.0, 0.0, 0.0, math.nan], [0.0, 0.0, 0.0, 0.0 if rough else 1.0]])
    counted = [k for _, k, _ in walk(PAPER, z, np.ones((2, 4), dtype=bool), rough=rough)]
    assert counted == ([0, 1] if rough else [0, 3])


@pytest.mark.parametrize(
    ("reset", "forget"), [(True, True), (True, False), (False, True), (False, False)]
)
def test_firing_restarts_count_and_heights_or_the_count_or_neither(reset, forget):
    graph = replace(tuned(PAPER, beta=6.0, beta_back=2.0), reset=reset, forget=forget)
    uneven, level = np.array([0.0, 0.3, 0.6, 0.9]), np.zeros(4)
    state, history = graph.begin(1), []
    for heights in [uneven] * 3 + [level] * 3 + [uneven] * 2:
        edge = state.gait.item()
        state, decision = graph.step(state, standing(foot_position_b=feet_at(heights[None])))
        height = state.memory["ground"].height[0, 3].item()
        height = None if math.isnan(height) else height
        history.append((state.k[0, edge].item(), decision.fired.item(), height))
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
    kept = [
        (6.0, False, 0.9), (0.0, True, 0.9), (0.0, False, 0.9),
        (1.0, False, 0.0), (2.0, False, 0.0), (0.0, True, 0.0),
        (6.0, False, 0.9), (0.0, True, 0.9),
    ]  # fmt: skip
    assert history == ((anew if forget else kept) if reset else on)


def test_without_reset_k_goes_on_from_where_it_fired():
    graph = there_and_back(
        HeightDifference(),
        Rule(alpha=0.05, beta=3.0),
        Rule(when="below", alpha=0.035, beta=350.0),
        reset=False,
    )
    state, seen = graph.begin(1), []
    for _ in range(3):
        state = replace(state, gait=np.array([0]))  # whoever steers keeps it in its gait
        state, decision = graph.step(state, standing(feet=ONE_UP))
        seen.append((state.k[0, 0].item(), decision.fired.item()))
    assert seen == [(3.0, False), (6.0, True), (9.0, True)]


def test_alpha_can_change_between_steps_and_the_count_goes_on():
    z, contact = np.array([[0.0, 0.1, 0.3, 0.6]]), np.ones((1, 4), dtype=bool)
    state = replace(
        PAPER.begin(1),
        memory={"ground": replace(PAPER.begin(1).memory["ground"], height=z)},
        k=np.array([[7.0, 0.0]]),
    )
    for alpha, more in ((0.25, 4), (0.55, 1)):
        ((_, k, _),) = walk(tuned(PAPER, alpha=alpha), z, contact, state=state)
        assert k == 7 + more


def test_hysteresis_keeps_a_robot_between_both_thresholds_in_its_gait():
    graph = there_and_back(
        HeightDifference(), Rule(alpha=0.05, beta=3.0), Rule(when="below", alpha=0.02, beta=3.0)
    )
    for gait in (0, 1):
        state = replace(graph.begin(1), gait=np.array([gait]))
        for _ in range(100):
            state, decision = graph.step(state, standing(feet=FEET + 0.3 * (ONE_UP - FEET)))
            assert not decision.fired.any()


def test_no_shift_comes_before_a_gait_has_been_held():
    graph = there_and_back(
        HeightDifference(),
        Rule(alpha=0.05, beta=3.0, hold=0.5),
        Rule(when="below", alpha=0.02, beta=3.0, hold=0.5),
    )
    state, at = graph.begin(1), []
    for step in range(1, 201):
        state, decision = graph.step(state, standing(feet=FEET if state.gait[0] else ONE_UP))
        at += [step] if decision.fired[0] else []
    assert at == [50, 100, 150, 200]


def test_the_way_back_may_watch_something_else():
    """There by the commanded speed, back by the heights of the feet."""
    graph = there_and_back(
        SpeedCommand(),
        Rule(alpha=1.0, beta=4.0),
        Rule(when="below", alpha=0.05, beta=6.0),
        statistic_back=HeightDifference(),
    )
    watched = [graph.statistics[edge.statistic] for edge in ways(graph)]
    assert watched == [SpeedCommand(), HeightDifference()]
    state, fired = graph.begin(1), []
    for step in range(40):
        command = np.array([1.5 if step < 20 else 0.5])
        feet = ONE_UP if step < 30 else FEET
        state, decision = graph.step(state, standing(feet=feet, forward_speed_command=command))
        fired += [step] if decision.fired[0] else []
    assert fired == [4, 36], "the fifth fast step; the seventh step with level feet"


def test_robots_one_by_one_shift_as_in_the_batch():
    rng = np.random.default_rng(1)
    graph = tuned(load_graph("height_difference"), beta=20.0, beta_back=10.0)
    batch, singles = graph.begin(3), [graph.begin(1) for _ in range(3)]
    shifts = 0
    for _ in range(300):
        sensed = standing(
            contact=rng.random((3, 4)) < 0.7,
            foot_position_b=feet_at(rng.normal(scale=0.015, size=(3, 4))),
            orientation=np.tile(UPRIGHT, (3, 1)),
        ) if rng.random() < 0.5 else standing(3)  # fmt: skip
        batch, decision = graph.step(batch, sensed)
        shifts += decision.fired.sum()
        for robot in range(3):
            ids = np.array([robot])
            singles[robot], alone = graph.step(singles[robot], sensed.robots(ids))
            for name in ("fired", "k", "threshold"):
                assert getattr(alone, name)[0] == getattr(decision, name)[robot]
            assert singles[robot].gait[0] == batch.gait[robot]
    assert shifts > 6


# The two edges ----------------------------------------------------------------------------------


def test_the_papers_two_gaits_are_a_graph_of_two_edges_with_the_papers_numbers():
    there, back = PAPER.edges
    assert (there.source, there.target) == ("trot", "bound")
    assert (back.source, back.target) == ("bound", "trot")
    assert there.rule == Rule(when="above", alpha=0.2, beta=1000, epsilon=1)
    assert back.rule == Rule(when="below", alpha=0.2, beta=1000, epsilon=1)
    assert PAPER.statistics == {"ground": HeightDifference(frame="body")}
    assert PAPER.reset
    assert there_and_back(HeightDifference(frame="body"), there.rule, back.rule) == PAPER


def test_one_gait_for_flat_and_rough_is_refused():
    with pytest.raises(GaitshiftError, match="must differ, got 'trot'"):
        between(PAPER, flat="trot", rough="trot")


def test_a_graph_between_other_gaits_has_the_same_conditions():
    other = between(load_graph(), flat="walk", rough="pronk")
    assert other.gaits == ("walk", "pronk")
    assert numbers_of(other) == numbers_of(load_graph())
    assert other.statistics == load_graph().statistics
    assert between(other, flat="trot", rough="bound") == load_graph()


def test_tuned_changes_the_numbers_it_is_given_and_no_others():
    changed = tuned(PAPER, alpha=0.1, beta=None, beta_back=7.0, hold=0.5)
    expected = numbers_of(PAPER) | {"alpha": 0.1, "beta_back": 7.0, "hold": 0.5}
    assert numbers_of(changed) == expected
    assert tuned(changed, alpha=0.2, beta_back=1000.0, hold=0.0) == PAPER
    assert tuned(PAPER, alpha=None) == PAPER


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"alpha": 0.0}, "the way to the rough gait: alpha must be above 0 and finite, got 0.0"),
        ({"beta": -1.0}, "the way to the rough gait: beta must be 0 or more and finite, got -1.0"),
        ({"epsilon": math.inf}, "the way to the rough gait: epsilon must be above 0 and finite, "
                                "got inf"),
        ({"alpha_back": math.nan}, "the way back: alpha must be above 0 and finite, got nan"),
        ({"leak_back": -0.1}, "the way back: leak must be 0 or more and finite, got -0.1"),
    ],
)  # fmt: skip
def test_a_bad_number_is_refused_in_one_line_that_says_which_way_and_what_is_allowed(
    wrong, message
):
    with pytest.raises(GaitshiftError) as caught:
        tuned(PAPER, **wrong)
    assert str(caught.value) == message


def test_an_unknown_number_is_refused_with_those_there_are():
    with pytest.raises(GaitshiftError, match=r"unknown number 'gamma'.*alpha_back"):
        tuned(PAPER, gamma=1.0)


def test_ways_are_of_graphs_of_two_gaits_alone():
    for name in shipped_graphs():
        graph = load_graph(name)
        if name == "speed":
            with pytest.raises(GaitshiftError, match="got one of 3 gaits and 4 edges"):
                ways(graph)
        else:
            there, back = ways(graph)
            assert (there.source, there.target) == (back.target, back.source)
            assert there.source == graph.start
