"""Maps of gaits: what is measured on logs made by hand, who is the best, and the command."""

import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_rgba
from scipy import stats

from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.studies.best import Objective, rankings, stretches
from gaitshift.lab.studies.gait_map import (
    COLUMNS,
    KEY,
    Place,
    Walks,
    body_of,
    measure_walks,
    page,
    places,
    ratio,
    row_of,
)
from gaitshift.robot.description import ANYMAL_B
from gaitshift.show.plots.gait_map import map_figure
from gaitshift.show.plots.style import gait_colours
from gaitshift.table import read_typed
from synthetic import changed

TROT = policy.load("trot")
MASS, GRAVITY = 30.4754, 9.81


@pytest.fixture(scope="module")
def log():
    """Three robots for 5 s, as if on rails: 1 m/s, all joints turning at 2 rad/s with 5 N m."""
    config = DemoConfig(gaits=("trot", "bound"), at=(4.8,), episodes=3, every=0.2)
    real = run_demo(config)[0]
    place = np.zeros((len(real.time), 1, 3))
    place[:, 0, 0] = 7.0 + 0.01 * np.arange(len(real.time))
    return changed(real, base_position_w=place, joint_velocity=2.0, joint_torque=5.0, fallen=False)


def cost_of(walks, name="work"):
    return ratio(getattr(walks, name), MASS * GRAVITY * walks.distance)[0]


def test_robots_on_rails_cost_what_mechanics_says(log):
    walks = measure_walks(log, ANYMAL_B, asked=10.0)
    assert not walks.fell.any()
    np.testing.assert_allclose(walks.progress, 4.99 / 10.0)
    np.testing.assert_allclose(walks.distance / walks.time, 1.0, rtol=0.01)
    mechanical = 12 * 5.0 * 2.0  # [W]
    assert cost_of(walks) == pytest.approx(mechanical / (MASS * GRAVITY), rel=0.01)
    lost = 12 * ANYMAL_B.motor.heat * 5.0**2
    electrical = (mechanical + lost) / (MASS * GRAVITY)
    assert cost_of(walks, "electrical_work") == pytest.approx(electrical, rel=0.01)
    np.testing.assert_allclose(walks.saturated, 0.0)


def test_a_robot_counts_until_its_fall_and_not_at_all_if_that_is_in_the_warm_up(log):
    fallen = log.fallen.copy()
    fallen[350:, 0] = True
    fallen[100:, 1] = True
    walks = measure_walks(replace(log, fallen=fallen), ANYMAL_B, asked=10.0)
    assert walks.fell.tolist() == [True, True, False]
    np.testing.assert_allclose(walks.progress, [0.349, 0.099, 0.499])
    np.testing.assert_allclose(walks.distance, [1.49, 0.0, 2.99], atol=0.011)
    np.testing.assert_allclose(walks.time, [1.5, 0.0, 3.0], atol=0.011)
    assert cost_of(walks) == pytest.approx(120.0 / (MASS * GRAVITY), rel=0.01)


def test_a_ratio_of_equal_ways_is_a_mean_with_scipys_interval():
    values = np.random.default_rng(0).normal(3.0, 2.0, 400)
    mean, half = ratio(values, np.full(400, 2.0))
    low, high = stats.norm.interval(0.95, values.mean(), stats.sem(values))
    assert mean == pytest.approx(values.mean() / 2.0, abs=1e-4)
    assert half == pytest.approx((high - low) / 4.0, rel=1e-3)


def test_the_interval_of_a_ratio_holds_it_as_often_as_it_says():
    """Energy that grows with the way: the interval is far smaller than that of either."""
    rng, hits = np.random.default_rng(1), 0
    for _ in range(1000):
        way = rng.uniform(5.0, 15.0, 64)
        mean, half = ratio(0.7 * way + rng.normal(0.0, 1.0, 64), way)
        hits += abs(mean - 0.7) <= half
    assert 0.92 < hits / 1000 < 0.98


def test_nothing_walked_is_no_ratio():
    assert ratio(np.ones(3), np.zeros(3)) == ("", "")
    assert ratio(np.ones(1), np.ones(1)) == ("", "")


# Who is the best ---------------------------------------------------------------------------------


def row(name, speed, cost, *, half=0.01, survived=100, reached=None, frequency=2.0, progress=1.0):
    return dict.fromkeys(COLUMNS, 0.0) | {
        "policy": name,
        "gait": name,
        "ground": "flat",
        "body": "own",
        "speed": speed,
        "stride_frequency": frequency,
        "robots": 100,
        "survived": survived,
        "speed_m_s": speed if reached is None else reached,
        "progress": progress,
        "progress_half": 0.02,
        "cost_of_transport": cost,
        "cost_half": half,
        "electrical_cost_of_transport": "" if cost == "" else 2.0 - cost,
        "electrical_half": half,
        "leg_m": 0.48,
    }


MAP = [
    row("walk", 0.2, 0.5, half=0.03),
    row("trot", 0.2, 0.9, half=0.04),
    row("walk", 0.4, 0.5),
    row("trot", 0.4, 0.7, frequency=2.5),
    row("trot", 0.4, 0.6, frequency=1.5),
    row("walk", 0.8, 0.3, reached=0.65),  # too slow for it to count
    row("trot", 0.8, 0.4),
    row("trot", 1.6, 0.4, survived=98),
]


def test_the_cheapest_gait_that_survives_and_keeps_the_speed_is_the_best():
    ranked = rankings(MAP, Objective())
    assert [one.best for one in ranked] == ["walk", "walk", "trot", None]
    assert ranked[1].rows[1]["stride_frequency"] == 1.5
    assert ranked[0].margin(Objective()) == pytest.approx((0.4, 0.05))
    assert ranked[2].margin(Objective()) is None
    spans = [(one.policy, one.first, one.last) for one in stretches(ranked)]
    assert spans == [("walk", 0.2, 0.4), ("trot", 0.8, 0.8), (None, 1.6, 1.6)]


def test_other_objectives_have_other_best_gaits():
    ranked = rankings(MAP, Objective(name="electrical-energy"))
    assert [one.best for one in ranked] == ["trot", "trot", "trot", None]
    far = [row("a", 1.0, 0.5, progress=0.6, reached=0.6), row("b", 1.0, 0.4, progress=0.5)]
    assert rankings(far, Objective(name="progress"))[0].best == "a"
    assert rankings(MAP, Objective(survival=0.98))[-1].best == "trot"


def test_why_a_row_cannot_be_the_best():
    assert Objective().misses(row("a", 1.0, 0.5)) == ""
    assert Objective().misses(row("a", 1.0, 0.5, survived=98)) == "survival 0.980"
    assert Objective().misses(row("a", 1.0, 0.5, reached=0.89)) == "0.89 m/s"
    assert Objective().misses(row("a", 0.2, 0.5, reached=0.24)) == ""
    assert Objective().misses(row("a", 1.0, "", reached="")) == "no distance"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"name": "beauty"}, "objective"),
        ({"survival": 1.5}, "survival must be 0 to 1, got 1.5"),
    ],
)
def test_an_impossible_objective_is_refused(settings, message):
    with pytest.raises(GaitshiftError, match=message):
        Objective(**settings)


def test_the_page_names_the_best_and_says_why_others_are_not():
    text = page(MAP, Objective(), "gaitshift map")
    assert "the best by energy is walk at 0.2 to 0.4 m/s, trot at 0.8 m/s" in text
    assert "no policy at 1.6 m/s" in text
    assert "| 0.2 | **0.500** | 0.900 | 0.400 ± 0.050 |" in text
    assert "0.300 (0.65 m/s)" in text
    assert "0.400 (survival 0.980)" in text


def test_the_figure_colours_the_strip_by_the_best_gait(tmp_path):
    figure = map_figure(MAP, tmp_path / "map.png")
    assert (tmp_path / "map.png").stat().st_size < 300_000
    colours = gait_colours(("walk", "trot"))
    strip = [
        (patch.get_x(), patch.get_x() + patch.get_width(), patch.get_facecolor())
        for patch in figure.axes[0].patches
    ]
    assert [(round(left, 3), round(right, 3)) for left, right, _ in strip] == [
        (0.2, 0.3),
        (0.3, 0.6),
        (0.6, 1.2),
    ]
    wanted = [to_rgba(colours[name]) for name in ("walk", "walk", "trot")]
    assert [colour for _, _, colour in strip] == wanted


def test_a_figure_without_rows_is_refused(tmp_path):
    with pytest.raises(GaitshiftError, match="must be rows"):
        map_figure([], tmp_path / "map.png")


# Places ------------------------------------------------------------------------------------------


def test_speeds_outside_the_range_of_a_gait_are_left_out():
    found = places(
        {"trot": TROT},
        grounds=("flat",),
        bodies=("own",),
        speeds=(0.1, 0.4, 1.6, 3.0),
        frequencies=1,
    )
    assert [place.speed for _, place in found] == [0.4, 1.6]
    low, high = TROT.info.stride_frequency_range
    three = places({"trot": TROT}, grounds=("flat",), bodies=("own",), speeds=(0.4,), frequencies=3)
    tried = [place.stride_frequency for _, place in three]
    np.testing.assert_allclose(tried, [low, (low + high) / 2, high], atol=1e-4)


def test_a_body_differs_in_what_it_names():
    body = body_of("payload:5+friction:0.4")
    assert body.payload == (5.0, 5.0)
    assert body.friction == (0.4, 0.4)
    assert not body_of("own").varies


@pytest.mark.parametrize("spec", ["payload", "payload:heavy", "weight:5", "", "kp:1+kp:1.1"])
def test_an_unknown_body_is_refused(spec):
    with pytest.raises(GaitshiftError, match="bodies must be own, or NAME:VALUE"):
        body_of(spec)


def test_a_row_has_every_column_and_its_key():
    walks = Walks(
        **{name: np.ones(4) for name in Walks.__annotations__} | {"fell": np.zeros(4, bool)}
    )
    place = Place(ground="flat", speed=1.0, stride_frequency=2.5)
    same = {"sensors": "perfect", "push": 0.0, "seed": 0, "seconds": 5.0}
    made = row_of("trot", TROT, place, walks, **same)
    assert tuple(made) == tuple(COLUMNS)
    assert set(KEY) < set(made)
    assert (made["survived"], made["robots"], made["speed_m_s"]) == (4, 4, 1.0)


def test_a_payload_is_a_part_of_the_weight_that_is_carried():
    walks = Walks(**dict.fromkeys(Walks.__annotations__, np.ones(4)) | {"fell": np.zeros(4, bool)})
    same = {"sensors": "perfect", "push": 0.0, "seed": 0, "seconds": 5.0}
    light, heavy = (
        row_of(
            "trot",
            TROT,
            Place(ground="flat", body=b, speed=1.0, stride_frequency=2.5),
            walks,
            **same,
        )
        for b in ("own", "payload:10")
    )
    assert light["cost_of_transport"] == pytest.approx(1.0 / (MASS * GRAVITY), abs=1e-5)
    assert heavy["cost_of_transport"] == pytest.approx(1.0 / ((MASS + 10.0) * GRAVITY), abs=1e-5)


# The command -------------------------------------------------------------------------------------


def test_the_command_goes_on_where_it_was_broken_off(tmp_path, capsys):
    out = tmp_path / "map"
    command = ["map", "trot", "pace", "--robots", "4", "--seconds", "3.5", "--out", str(out)]
    command += ["--speeds", "0.4", "1.2", "--json"]
    main(command)
    rows = json.loads(capsys.readouterr().out)["map"]
    assert [(one["policy"], one["speed"]) for one in rows] == [
        ("trot", 0.4),
        ("pace", 0.4),
        ("trot", 1.2),
        ("pace", 1.2),
    ]
    assert all(one["survived"] == 4 and 0.3 < one["cost_of_transport"] < 3.0 for one in rows)
    assert (out / "map.png").is_file()
    table = out / "map.csv"
    whole = table.read_text()
    table.write_text("".join(whole.splitlines(keepends=True)[:4]))  # killed before the last place
    main(command)
    said = capsys.readouterr().err
    assert "trot at 1.2 m/s, 2.50 Hz on flat exists" in said
    assert "pace at 1.2" not in said
    assert table.read_text() == whole
    assert read_typed(table, COLUMNS, "maps") == rows
    with pytest.raises(SystemExit) as end:
        main([*command, "--seed", "3"])
    assert end.value.code == 2
    assert "seed must be 0 to add to" in capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--robots", "1"], "robots must be 2 to 1000000, got 1"),
        (["--speeds", "0"], "speeds must be rising, above 0 and up to"),
        (["--speeds", "1.0", "0.5"], "got 1, 0.5"),
        (["--speeds", "2.5"], "speeds must be in the range of a gait: trot 0.4 to 1.6 m/s"),
        (["--bodies", "weight:5"], "bodies must be own"),
        (["--bodies", "payload:500"], "payload must be"),
        (["--grounds", "lava"], "lava"),
        (["--survival", "2"], "survival must be 0 to 1, got 2"),
        (["--seconds", "1"], "seconds must be 3 to 3600, got 1"),
        (["--frequencies", "0"], "frequencies must be 1 to 100, got 0"),
        (["--seed", "-1"], "seed must be 0 or larger, got -1"),
    ],
)
def test_bad_input_is_one_line_and_code_2(tmp_path, capsys, arguments, message):
    with pytest.raises(SystemExit) as end:
        main(["map", "trot", *arguments, "--out", str(tmp_path / "out")])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "out" / "map.csv").exists()
