"""Gait graphs: which are refused, which edge is taken, and what a decision tells."""

from dataclasses import replace

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.shift import Edge, GaitGraph, HeightDifference, Rule, SpeedCommand, load_graph
from sensing import FEET, ONE_UP, standing


def edge(source, target, statistic="speed", **others):
    """A way that is taken after two steps above 1."""
    return Edge(
        source=source,
        target=target,
        statistic=statistic,
        rule=Rule(alpha=1.0, beta=1.0),
        **others,
    )


def graph_of(*edges, start="trot"):
    return GaitGraph(
        start=start,
        statistics={"speed": SpeedCommand(), "ground": HeightDifference()},
        edges=edges,
    )


@pytest.mark.parametrize(
    ("edges", "message"),
    [
        ((), "a gait graph must have at least one edge, got none"),
        (
            (edge("trot", "trot"),),
            "edge trot -> trot: source and target must be different gaits, got 'trot' for both",
        ),
        (
            (edge("trot", "bound"), edge("trot", "pace")),
            "edges trot -> bound and trot -> pace leave the same gait with the same priority 0; "
            "priorities must differ",
        ),
        (
            (edge("trot", "bound"), edge("pace", "walk")),
            "no edges lead from the start gait 'trot' to the gait 'pace'",
        ),
    ],
)
def test_a_graph_that_cannot_be_walked_is_refused_in_one_line(edges, message):
    with pytest.raises(GaitshiftError) as caught:
        graph_of(*edges)
    assert str(caught.value) == message


def test_an_edge_that_watches_nothing_is_refused_with_what_there_is():
    with pytest.raises(GaitshiftError, match=r"edge trot -> bound: .*did you mean 'ground'"):
        graph_of(edge("trot", "bound", "grund"))


def test_of_two_edges_that_fire_together_the_one_of_higher_priority_is_taken():
    command = np.array([1.5, 0.5])
    for first, second, target in ((0, 1, "pace"), (1, 0, "bound"), (-2, -1, "pace")):
        graph = graph_of(
            edge("trot", "bound", priority=first), edge("trot", "pace", priority=second)
        )
        state = graph.begin(2)
        for _ in range(2):
            state, decision = graph.step(state, standing(2, forward_speed_command=command))
        assert decision.fired.tolist() == [True, False]
        assert [graph.gaits[index] for index in state.gait] == [target, "trot"]


def test_the_counter_that_is_told_is_that_of_the_edge_nearest_to_firing():
    """Three pairs a step against 20, and two fast steps against 3."""
    graph = GaitGraph(
        start="trot",
        statistics={"speed": SpeedCommand(), "ground": HeightDifference()},
        edges=(
            Edge(source="trot", target="bound", statistic="ground", rule=Rule(alpha=0.05, beta=20)),
            Edge(
                source="trot",
                target="walk",
                statistic="speed",
                rule=Rule(alpha=1.0, beta=3),
                priority=1,
            ),
        ),
    )
    fast, slow = np.array([1.5]), np.array([0.5])
    state, told = graph.begin(1), []
    for speed in (slow, slow, fast, fast):
        state, decision = graph.step(state, standing(feet=ONE_UP, forward_speed_command=speed))
        told.append((decision.k.item(), decision.threshold.item()))
    assert told == [(3, 20), (6, 20), (9, 20), (12, 20)], "12 / 21 are more than 2 / 4"
    _, decision = graph.step(state, standing(feet=FEET, forward_speed_command=fast))
    assert (decision.k.item(), decision.threshold.item()) == (3, 3), "3 / 4 are more than 12 / 21"


def test_nothing_counts_for_a_robot_in_a_gait_that_the_graph_does_not_know():
    graph = load_graph("height_difference")
    state = replace(graph.begin(2), gait=np.array([-1, 0]))
    for _ in range(100):
        state, decision = graph.step(state, standing(2, feet=ONE_UP))
        assert not decision.fired[0]
        assert (decision.k[0], decision.threshold[0]) == (0.0, 0.0)
    assert state.gait.tolist() == [-1, 1]


def test_a_gait_without_a_way_out_is_kept():
    graph = graph_of(edge("trot", "bound"))
    state = graph.begin(1)
    for _ in range(50):
        state, _ = graph.step(state, standing(forward_speed_command=np.array([2.0])))
    assert graph.gaits[state.gait[0]] == "bound"


def test_walk_and_trot_are_chosen_by_the_commanded_speed():
    """Above 0.65 m/s for half a second, and below 0.55 m/s: more than 50 steps each."""
    graph = load_graph("speed")
    state, at = graph.begin(1), []
    for step in range(1, 201):
        command = np.array([0.7 if step <= 100 else 0.5])
        sensed = standing(forward_speed_command=command)
        state, decision = graph.step(state, sensed)
        at += [(step, graph.gaits[state.gait[0]])] if decision.fired[0] else []
    assert at == [(51, "trot"), (151, "walk")]


def test_a_graph_needs_what_its_statistics_read():
    assert load_graph("speed").needs == {"forward_speed_command"}
    assert load_graph("paper").needs == frozenset()
