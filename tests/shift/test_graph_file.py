"""Gait graphs as files: what they say, the shipped ones, and faults named with their place."""

import inspect
import tomllib
from pathlib import Path

import pytest

from gaitshift.cli.study import Study
from gaitshift.cli.view import View
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.demo import DemoConfig
from gaitshift.lab.identification import chatter
from gaitshift.shift import (
    Edge,
    HeightDifference,
    Modulation,
    PlaneResidual,
    Rule,
    TouchdownSurprise,
    load_graph,
    shipped_graphs,
    ways,
)
from gaitshift.shift import graph_file as files
from gaitshift.shift.graph_file import DEFAULT

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
    graph = load_graph(graph_file(tmp_path))
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


@pytest.mark.parametrize(
    ("kind", "name", "value"),
    [
        ("attitude_variance", "window", 0),
        ("slip", "window", -1.0),
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
    with pytest.raises(GaitshiftError, match=rf"ways.toml.*statistic s.*{name}'? must be"):
        load_graph(path)


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
def test_a_faulty_graph_file_is_named_with_its_place_and_what_is_allowed(
    tmp_path, old, new, message
):
    assert old in GRAPH
    path = graph_file(tmp_path, GRAPH.replace(old, new))
    with pytest.raises(GaitshiftError) as caught:
        load_graph(path)
    line = str(caught.value)
    assert line.startswith(str(path))
    assert message in line
    assert "\n" not in line


@pytest.mark.parametrize("name", shipped_graphs())
def test_shipped_graphs_load_and_are_drawn_edge_by_edge(name):
    graph = load_graph(name)
    drawn = graph.mermaid()
    for edge in graph.edges:
        assert f"    {edge.source} --> {edge.target} : " in drawn
    assert f"[*] --> {graph.start}" in drawn


def test_an_unknown_graph_is_refused_with_those_there_are():
    known = "height_difference, oracle, oscillators, paper, sensors, speed, terrain"
    with pytest.raises(GaitshiftError, match=f"did you mean 'terrain'.*known graphs: {known}"):
        load_graph("terran")
    with pytest.raises(GaitshiftError, match="did you mean 'paper'"):
        load_graph("papr")


# The default ------------------------------------------------------------------------------------


def test_the_graph_by_terrain_is_the_one_that_was_found_best():
    """The numbers of docs/results/shifting: there by surprise, back by the heights of the feet."""
    graph = load_graph("terrain")
    there, back = ways(graph)
    assert (there.source, there.target) == ("trot", "bound")
    assert graph.statistics[there.statistic] == TouchdownSurprise()
    assert graph.statistics[back.statistic] == HeightDifference(frame="gravity")
    assert there.rule == Rule(alpha=0.0124, beta=8)
    assert back.rule == Rule(when="below", alpha=0.0055, beta=18, leak=0.12)


def test_what_is_called_the_default_is_one_graph_everywhere():
    live = pytest.importorskip("gaitshift.show.viewer.live", exc_type=ImportError)
    assert load_graph() == load_graph(DEFAULT)
    assert DemoConfig().graph == View().condition == live.LiveConfig().condition == DEFAULT
    assert inspect.signature(Study).parameters["conditions"].default[0] == DEFAULT
    for back, edge in enumerate(ways(load_graph())):
        assert chatter.shipped_rule(back=bool(back)) == edge.rule


def test_a_shipped_graph_stands_in_one_file_alone():
    """No two files have the same way, but for the two of which docs say that they share it."""
    folder = Path(files.__file__).parent / "graphs"
    edges = {
        file.stem: [
            (e["from"], e["to"], e["alpha"], e["beta"])
            for e in tomllib.loads(file.read_text(encoding="utf-8"))["edge"]
        ]
        for file in sorted(folder.glob("*.toml"))
    }
    assert tuple(edges) == shipped_graphs()
    for name, own in edges.items():
        for other, others in edges.items():
            if name < other and {name, other} != {"speed", "terrain"}:
                assert not set(own) & set(others), f"{name} and {other}"
    assert set(edges["terrain"]) <= set(edges["speed"]), "which bounds where terrain does"
