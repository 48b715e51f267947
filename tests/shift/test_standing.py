"""Standing at zero command, in any graph."""

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.shift import load_graph, with_stand
from gaitshift.shift.standing import STOPPING
from sensing import standing


def course(commands, graph):
    """The gait of each robot (N,) after each step; commands (T, N, 2) are forward and lateral."""
    state, gaits = graph.begin(commands.shape[1]), []
    for forward, lateral in np.moveaxis(commands, 2, 1):
        sensed = standing(
            len(forward), forward_speed_command=forward, lateral_speed_command=lateral
        )
        state, _ = graph.step(state, sensed)
        gaits.append([graph.gaits[index] for index in state.gait])
    return gaits


def test_a_robot_stands_after_a_while_at_zero_command_and_walks_at_once():
    graph, steps = with_stand(load_graph()), round(STOPPING)
    commands = np.zeros((2 * steps, 3, 2))
    commands[:, 1, 1] = -0.2  # sideways is no stand
    commands[: steps // 2, 2, 0] = 0.5  # stops later
    commands[-1, :, 0] = 0.5
    gaits = course(commands, graph)
    assert gaits[steps - 1] == ["trot"] * 3
    assert gaits[steps] == ["stand", "trot", "trot"]
    assert gaits[steps + steps // 2] == ["stand", "trot", "stand"]
    assert gaits[-1] == ["trot"] * 3


def test_every_gait_stands_and_the_first_one_goes_on():
    graph = with_stand(load_graph("speed"), "halt")
    edges = {(edge.source, edge.target) for edge in graph.edges}
    assert edges >= {("walk", "halt"), ("trot", "halt"), ("bound", "halt"), ("halt", "walk")}
    with pytest.raises(GaitshiftError, match="must not have the gait 'trot' yet"):
        with_stand(graph, "trot")
