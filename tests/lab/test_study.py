"""Crossings of noise: what is measured of them on logs made by hand, and the command."""

import csv
import json
from dataclasses import fields, replace

import numpy as np
import pytest
from scipy import stats

from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.studies.crossing import (
    COLUMNS,
    Crossings,
    cross,
    mean_of,
    measure_crossings,
    row_of,
    strategies,
)
from gaitshift.show.plots.studies import crossings_figure
from synthetic import changed

TROT, BOUND = policy.load("trot"), policy.load("bound")
BOTH = {"trot": TROT, "bound": BOUND}
MASS, GRAVITY = 30.4754, 9.81


@pytest.fixture(scope="module")
def log():
    """Three robots for 5 s, as if on rails: 1 m/s, all joints turning at 2 rad/s with 5 N m."""
    config = DemoConfig(gaits=("trot", "bound"), at=(4.8,), episodes=3, every=0.2)
    real = run_demo(config)[0]
    place = np.zeros((len(real.time), 1, 3))
    place[:, 0, 0] = 7.0 + 0.01 * np.arange(len(real.time))
    return changed(
        real,
        base_position_w=place,
        joint_velocity=2.0,
        joint_torque=-5.0,
        fallen=False,
        gait=0,
    )


def test_robots_on_rails_come_as_far_and_cost_as_much_as_mechanics_says(log):
    out = measure_crossings(log, 3.0, MASS)
    assert out.arrived.all()
    assert not out.fell.any()
    np.testing.assert_allclose(out.distance, 3.0)
    np.testing.assert_allclose(out.speed, 1.0, rtol=0.01)
    power = 12 * 5.0 * 2.0
    np.testing.assert_allclose(out.cost_of_transport, power / (MASS * GRAVITY * 1.0), rtol=0.01)


def test_what_comes_after_the_finish_or_a_fall_does_not_count(log):
    fallen, gait = log.fallen.copy(), log.gait.copy()
    fallen[150:, 0] = True  # at 1.5 m
    fallen[350:, 1] = True  # behind the finish
    gait[100:, :2], gait[200:, 0], gait[320:, 1] = 1, 0, 0
    out = measure_crossings(replace(log, fallen=fallen, gait=gait), 3.0, MASS)
    assert out.fell.tolist() == [True, False, False]
    assert out.arrived.tolist() == [False, True, True]
    np.testing.assert_allclose(out.distance, [1.5, 3.0, 3.0])
    assert out.shifts.tolist() == [1, 1, 0]


def test_a_robot_that_never_arrives_is_measured_over_all_of_its_time(log):
    out = measure_crossings(log, 100.0, MASS)
    assert not out.arrived.any()
    assert not out.fell.any()
    np.testing.assert_allclose(out.distance, 4.99)
    np.testing.assert_allclose(out.speed, 4.99 / 5.0)


def test_a_robot_that_falls_at_once_has_no_cost_of_transport(log):
    fallen = log.fallen.copy()
    fallen[50:, 2] = True
    assert np.isnan(
        measure_crossings(replace(log, fallen=fallen), 3.0, MASS).cost_of_transport
    ).tolist() == [
        False,
        False,
        True,
    ]


def test_intervals_of_means_are_scipys():
    values = np.random.default_rng(0).normal(3.0, 2.0, 400)
    mean, half = mean_of(values)
    low, high = stats.norm.interval(0.95, values.mean(), stats.sem(values))
    assert mean == pytest.approx(values.mean(), abs=1e-4)
    assert half == pytest.approx((high - low) / 2, rel=1e-3)
    assert mean_of(values[:1]) == ("", "")


def test_more_shifts_than_there_and_back_are_chatter(log):
    out = measure_crossings(log, 3.0, MASS)
    four = {f.name: np.resize(getattr(out, f.name), 4) for f in fields(out)}
    way = strategies("trot", "bound", ())[0]
    row = row_of(way, 0.1, 0, Crossings(**four | {"shifts": np.array([2, 3, 0, 5])}))
    assert (row["chattered"], row["shifts"], row["runs"]) == (2, 2.5, 4)


@pytest.mark.slow
def test_only_the_oracle_shifts_where_the_noise_is_seen():
    """On level ground nobody does; over noise the oracle goes there and back once."""
    alone, _, height, oracle = strategies("trot", "bound", ("height_difference",))
    for way in (alone, height, oracle):
        assert cross(BOTH, way, amplitude=0.0, runs=4, seed=1).shifts.tolist() == [0] * 4
    assert cross(BOTH, oracle, amplitude=0.1, runs=4, seed=1).shifts.tolist() == [2] * 4


@pytest.mark.slow
def test_the_command_goes_on_where_it_was_broken_off(tmp_path, capsys):
    out = tmp_path / "study"
    command = ["study", "--runs", "4", "--amplitudes", "0.05", "--conditions", "height_difference"]
    command += ["--out", str(out), "--json"]
    main(command)
    rows = json.loads(capsys.readouterr().out)["crossings"]
    names = ["trot only", "bound only", "height_difference", "oracle"]
    assert [row["way"] for row in rows] == names
    assert all(row["survived"] == row["arrived"] == 4 for row in rows)
    assert (out / "crossings.png").stat().st_size < 300_000
    assert "| trot only | 4 of 4 |" in (out / "README.md").read_text()
    table = out / "crossings.csv"
    whole = table.read_text()
    table.write_text("".join(whole.splitlines(keepends=True)[:4]))  # killed before the last way
    main(command)
    said = capsys.readouterr().err
    assert "trot only at 0.05 m exists" in said
    assert "oracle over" not in said
    assert table.read_text() == whole
    with pytest.raises(SystemExit) as end:
        main([*command, "--seed", "3"])
    assert end.value.code == 2
    assert "seed must be 0 to add to" in capsys.readouterr().err.splitlines()[-1]


def test_the_figure_shows_every_way_with_its_survival(tmp_path):
    common = dict.fromkeys(COLUMNS, 1.0) | {"runs": 10, "low": 0.2, "high": 0.9}
    rows = [
        common | {"way": way, "amplitude": a, "survived": s}
        for way, s in (("trot only", 5), ("oracle", 8))
        for a in (0.2, 0.0)
    ]
    figure = crossings_figure(rows, tmp_path / "it.png")
    lines = {c.get_label(): c.lines[0] for c in figure.axes[0].containers}
    assert list(lines) == ["trot only", "oracle"]
    np.testing.assert_allclose(lines["oracle"].get_ydata(), 0.8)
    np.testing.assert_allclose(np.diff(lines["trot only"].get_xdata()), 0.2)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--runs", "1"], "runs must be 2 to 1000000, got 1"),
        (["--amplitudes", "2"], "amplitudes must be 0 to 1 m, got 2"),
        (["--conditions", "luck"], "luck"),
        (["--rough-gait", "trot"], "must differ, got 'trot'"),
        (["--rough-gait", "canter"], "canter"),
        (["--seed", "-1"], "seed must be 0 or larger, got -1"),
    ],
)
def test_bad_input_is_one_line_and_code_2(tmp_path, capsys, arguments, message):
    with pytest.raises(SystemExit) as end:
        main(["study", *arguments, "--out", str(tmp_path / "out")])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


def test_another_table_is_refused(tmp_path, capsys):
    with (tmp_path / "crossings.csv").open("w", newline="") as file:
        csv.writer(file).writerows([list(COLUMNS), ["many"] * len(COLUMNS)])
    with pytest.raises(SystemExit) as end:
        main(["study", "--out", str(tmp_path)])
    assert end.value.code == 2
    assert "crossings.csv" in capsys.readouterr().err.splitlines()[-1]
