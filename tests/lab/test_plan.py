"""Plans: gait graphs from maps made by hand, whose crossings are known."""

import json

import numpy as np
import pytest

from gaitshift import table
from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.studies.best import Objective
from gaitshift.lab.studies.gait_map import COLUMNS
from gaitshift.lab.studies.plan import crossing_of, graph_text, plan
from gaitshift.shift import Proprioception, load_graph

SPEEDS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)


def row(name, speed, cost, *, half=0.01, survived=512, reached=None, gait=None, ground="flat"):
    return dict.fromkeys(COLUMNS, 0.0) | {
        "policy": name,
        "gait": gait or name,
        "ground": ground,
        "body": "own",
        "speed": speed,
        "sensors": "anymal",
        "seed": 0,
        "robots": 512,
        "survived": survived,
        "speed_m_s": speed if reached is None else reached,
        "cost_of_transport": cost,
        "cost_half": half,
        "electrical_cost_of_transport": cost,
        "electrical_half": half,
    }


def lines(**of):
    """A map in which each gait's cost is a straight line over the speed, given by (at 0, slope)."""
    return [
        row(name, speed, at + slope * speed) for speed in SPEEDS for name, (at, slope) in of.items()
    ]


WALK_TROT = lines(walk=(0.4, 0.5), trot=(0.75, -0.2))  # they cross at exactly 0.5 m/s


def test_straight_lines_cross_where_algebra_says():
    (one,) = plan(WALK_TROT, Objective(), ground="flat").crossings
    assert (one.slower, one.faster) == ("walk", "trot")
    assert one.speed == pytest.approx(0.5)
    assert one.low < 0.5 < one.high
    assert (one.up, one.down) == pytest.approx((0.55, 0.45))


def test_three_gaits_have_two_crossings():
    rows = lines(walk=(0.3, 0.8), trot=(0.62, 0.0), bound=(1.22, -0.6))
    found = plan(rows, Objective(), ground="flat")
    assert list(found.gaits) == ["walk", "trot", "bound"]
    assert [one.speed for one in found.crossings] == pytest.approx([0.4, 1.0])


def test_the_interval_holds_the_crossing_as_often_as_it_says():
    """Costs measured with errors of the size of their intervals, 400 times."""
    rng, hits = np.random.default_rng(0), 0
    for _ in range(400):
        noisy = [
            one
            | {"cost_of_transport": one["cost_of_transport"] + rng.normal(0.0, 0.02 / 1.96)}
            | {"cost_half": 0.02}
            for one in WALK_TROT
        ]
        (one,) = plan(noisy, Objective(), ground="flat").crossings
        hits += one.low <= 0.5 <= one.high
    assert 0.91 < hits / 400 < 0.99


def test_wide_intervals_widen_the_hysteresis():
    wide = [one | {"cost_half": 0.12} for one in WALK_TROT]
    (one,) = plan(wide, Objective(), ground="flat").crossings
    assert one.hysteresis == pytest.approx((one.high - one.low) / 2)
    assert one.hysteresis > 0.05


def test_a_gait_that_is_nowhere_clearly_better_is_left_out():
    nearly = [row("pace", speed, 0.75 - 0.2 * speed - 0.001) for speed in SPEEDS]
    found = plan([*WALK_TROT, *nearly], Objective(), ground="flat")
    assert found.left_out == ("pace",)
    assert list(found.gaits) == ["walk", "trot"]


def test_a_gait_that_cannot_go_faster_hands_over_between_the_speeds():
    rows = [
        *(row("walk", speed, 0.4) for speed in (0.2, 0.4)),
        row("walk", 0.6, 0.4, reached=0.45),
        *(row("trot", speed, 0.6) for speed in SPEEDS),
    ]
    (one,) = plan(rows, Objective(), ground="flat").crossings
    assert (one.speed, one.low, one.high) == pytest.approx((0.5, 0.4, 0.6))
    assert (one.down, one.up) == pytest.approx((0.4, 0.6))


def test_speeds_that_nobody_walks_are_named():
    rows = [*WALK_TROT, row("trot", 3.0, 0.5, survived=100)]
    (gap,) = plan(rows, Objective(), ground="flat").nobody
    assert (gap.first, gap.last) == (3.0, 3.0)


def test_crossings_of_lines_that_do_not_cross_are_the_ends():
    speeds = np.array([1.0, 2.0, 3.0])
    apart = np.array([[-1.0, -1.0, -1.0], [1.0, 1.0, 1.0], [-1.0, 3.0, -1.0], [-1.0, -1.0, 1.0]])
    assert crossing_of(speeds, apart, 2.0).tolist() == [3.0, 1.0, 1.25, 2.5]


@pytest.mark.parametrize(
    ("rows", "ground", "message"),
    [
        ([], "flat", "ground must be one of the map, none, got 'flat'"),
        (WALK_TROT, "mud", "ground must be one of the map, flat, got 'mud'"),
        (lines(trot=(0.5, 0.0)), "flat", "on flat trot is at all speeds of the map"),
        (
            [row("trot", 3.0, 0.5, survived=500), row("pace", 3.0, 0.5, survived=505)],
            "flat",
            "no gait meets survival 0.99 and its speed anywhere; nearest at 3 m/s is pace: "
            "survival 0.986",
        ),
        (
            [one | {"gait": "trot"} for one in WALK_TROT],
            "flat",
            "the best policies must be of different gaits, got walk, trot",
        ),
        (
            [
                *(row("walk", speed, 0.4 + 0.4 * (speed == 0.6)) for speed in SPEEDS),
                *(row("trot", speed, 0.6) for speed in SPEEDS),
            ],
            "flat",
            "each gait must be the best in one range of speeds, got walk 0.2 to 0.4, trot 0.6 to "
            "0.6, walk 0.8 to 1.2 m/s",
        ),
    ],
)
def test_a_map_without_a_plan_says_why(rows, ground, message):
    with pytest.raises(GaitshiftError) as caught:
        plan(rows, Objective(), ground=ground)
    assert message in str(caught.value)


def test_the_graph_shifts_up_above_and_down_below_its_thresholds(tmp_path):
    """Driven with a command that rises and falls: the way up and the way down differ."""
    found = plan(WALK_TROT, Objective(), ground="flat")
    path = tmp_path / "graph.toml"
    path.write_text(graph_text(found, Objective(), ground="flat", source="gaitshift plan"))
    graph = load_graph(path)
    state, seen = graph.begin(1), []
    speeds = np.concatenate([np.linspace(0.3, 0.8, 4000), np.linspace(0.8, 0.3, 4000)])
    for speed in speeds:
        sensed = Proprioception(
            contact=np.ones((1, 4), dtype=bool),
            foot_position_b=np.zeros((1, 4, 3)),
            orientation=np.array([[1.0, 0.0, 0.0, 0.0]]),
            forward_speed_command=np.array([speed]),
        )
        state, decision = graph.step(state, sensed)
        if decision.fired[0]:
            seen.append((graph.gaits[int(state.gait[0])], speed))
    assert [gait for gait, _ in seen] == ["trot", "walk"]
    half_a_second = 51 * 0.5 / 4000  # of the ramp [m/s]
    assert seen[0][1] == pytest.approx(0.55 + half_a_second, abs=2e-3)
    assert seen[1][1] == pytest.approx(0.45 - half_a_second, abs=2e-3)


# The command -------------------------------------------------------------------------------------


@pytest.fixture
def folder(tmp_path):
    table.write(tmp_path / "map.csv", WALK_TROT, COLUMNS)
    return tmp_path


def test_the_command_writes_a_graph_from_a_map(folder, capsys):
    out = folder / "graph.toml"
    main(["plan", str(folder), "--out", str(out), "--json"])
    said = json.loads(capsys.readouterr().out)
    assert said["policies"] == ["walk", "trot"]
    assert said["edges"][0]["crossing"] == pytest.approx(0.5)
    graph = load_graph(out)
    assert graph.gaits == ("walk", "trot")
    assert [edge.rule.alpha for edge in graph.edges] == pytest.approx([0.55, 0.45])
    main(["plan", str(folder / "map.csv"), "--out", str(out), "--overwrite"])
    assert "0.550" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--out", "graph.csv"], "--out must end in .toml, got graph.csv"),
        (["--out", "g.toml", "--hysteresis", "-1"], "hysteresis must be 0 to 1, got -1"),
        (["--out", "g.toml", "--ground", "mud"], "ground must be one of the map"),
        (["--out", "g.toml", "--survival", "7"], "survival must be 0 to 1, got 7"),
    ],
)
def test_bad_input_is_one_line_and_code_2(folder, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(folder)
    with pytest.raises(SystemExit) as end:
        main(["plan", ".", *arguments])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert not (folder / "g.toml").exists()


def test_a_missing_map_and_a_graph_that_exists_are_refused(folder, capsys):
    for path, out in ((folder / "no.csv", "g.toml"), (folder, "map.toml")):
        (folder / "map.toml").touch()
        with pytest.raises(SystemExit) as end:
            main(["plan", str(path), "--out", str(folder / out)])
        assert end.value.code == 2
        last = capsys.readouterr().err.splitlines()[-1]
        assert "no map" in last or "exists; give another --out" in last
