"""Time to gait: the check, the clock, the medians, the command."""

import json
from dataclasses import replace

import pytest
import torch
from PIL import Image

from gaitshift.cli import main
from gaitshift.cli.bench import _text
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.benchmark import time_to_gait as race
from gaitshift.lab.benchmark.baseline import ROBOTS
from gaitshift.lab.benchmark.outcome import (
    COLUMNS,
    Outcome,
    middle,
    outcome_of,
    ratio,
    ratio_text,
    row_of,
    summary,
)
from gaitshift.lab.benchmark.time_to_gait import (
    BASELINE,
    GAITSHIFT,
    Criterion,
    Figures,
    TimeToGait,
    fingerprint,
    time_to_gait,
)
from gaitshift.lab.benchmark.trainer import GaitshiftTrainer
from gaitshift.learn.export import describe, write
from gaitshift.learn.recipe import Recipe, Stage
from gaitshift.show.plots import time_to_gait_figure
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import flat
from gaitshift.table import read_typed
from gaitshift.table import write as write_table
from hopping import FOLD

TROT = gaits.load("trot")
SMALL = Recipe(stages=(Stage(name="flat", iterations=4),), robots=4, steps=5, threads=1)


def outcome(gait="trot", learner="gaitshift", seconds=10.0, *, reached=True, seed=0):
    return Outcome(
        gait=gait,
        learner=learner,
        seed=seed,
        reached=reached,
        seconds=seconds,
        steps=1000 * int(seconds),
        survival=1.0,
        speed=1.2,
        pattern_fraction=0.7,
        recipe="0123456789ab",
    )


# The check and the clock ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("survival", "speed", "pattern", "passed"),
    [
        (1.00, 1.20, 0.90, True),
        (0.99, 1.11, 0.60, True),
        (0.99, 1.29, 0.60, True),
        (0.98, 1.20, 0.90, False),
        (1.00, 1.09, 0.90, False),
        (1.00, 1.31, 0.90, False),
        (1.00, 1.20, 0.59, False),
        (0.00, None, None, False),
    ],
)
def test_a_check_is_passed_by_all_three_figures_at_once(survival, speed, pattern, passed):
    figures = Figures(survival=survival, speed=speed, pattern_fraction=pattern)
    assert Criterion().is_passed(figures, 1.2) is passed


def test_one_fall_of_the_robots_checked_is_one_too_many():
    assert (Criterion().robots - 1) / Criterion().robots < Criterion().survival


class Scripted:
    """A learner that takes 7 s to build and 5 s from check to check, on a clock of its own."""

    def __init__(self, clock, file):
        self.clock, self.file, self.steps = clock, file, 0
        clock.now += 7.0

    def advance(self):
        self.clock.now += 5.0
        self.steps += 100

    def export(self):
        self.clock.now += 1000.0
        return self.file


class ScriptedCheck(Criterion):
    """Takes an hour, and is passed the third time."""

    def see(self, policy):
        clock.now += 3600.0
        clock.checks += 1
        return Figures(survival=1.0, speed=1.2, pattern_fraction=0.25 * clock.checks)


class Clock:
    now = 0.0
    checks = 0

    def perf_counter(self):
        return self.now


clock = Clock()


@pytest.mark.parametrize(
    ("limits", "expected"),
    [
        ({}, (True, 22.0, 300)),
        ({"most_seconds": 17.0}, (False, 17.0, 200)),
        ({"most_seconds": 16.0}, (False, 17.0, 200)),
        ({"most_steps": 100}, (False, 12.0, 100)),
        ({"most_steps": 300}, (True, 22.0, 300)),
    ],
)
def test_only_training_is_timed_up_to_the_first_passed_check_or_the_limit(
    limits, expected, tmp_path, monkeypatch
):
    file = GaitshiftTrainer(TROT, SMALL, 0, tmp_path, iterations=1).export()
    monkeypatch.setattr(race, "time", clock)
    clock.now, clock.checks = 0.0, 0
    entry = race._Entry(name="x", build=lambda *_: Scripted(clock, file), **limits)
    found = race._train(entry, TROT, 4, TimeToGait(check=ScriptedCheck()))
    assert (found.reached, found.seconds, found.steps) == expected
    assert (found.gait, found.learner, found.seed) == ("trot", "x", 4)


def test_of_robots_that_all_fall_at_once_the_line_and_the_table_say_what_there_is(tmp_path):
    """Folded legs bring every body to the ground within the warm-up: no speed, no pattern."""
    env = GaitEnv(TROT, flat(20.0, 20.0), 2, config=SMALL.env, threads=1)
    layer = torch.nn.Linear(env.walker.observation.size, 12)
    with torch.no_grad():
        layer.weight.zero_()
        layer.bias.copy_(torch.from_numpy(FOLD[0]))
    write([layer], describe(env, {}), tmp_path / "fold.onnx")
    figures = Criterion(robots=2, seconds=2.5).see(policy.load(tmp_path / "fold.onnx"))
    assert figures == Figures(survival=0.0, speed=None, pattern_fraction=None)
    fallen = replace(outcome(reached=False), survival=0.0, speed=None, pattern_fraction=None)
    assert _text(fallen) == "> 10 s, > 0.01 M steps (survival 0.00, – m/s, pattern –)"
    write_table(tmp_path / "table.csv", [row_of(fallen)], COLUMNS)
    assert (tmp_path / "table.csv").read_text().splitlines()[1].endswith(",0.0,,,0123456789ab")
    (row,) = read_typed(tmp_path / "table.csv", COLUMNS, "trainings")
    assert outcome_of(row) == fallen
    with pytest.raises(GaitshiftError, match="column 'seconds' must not be empty"):
        outcome_of(row | {"seconds": ""})


def test_a_fingerprint_is_of_recipe_check_machine_and_the_learners_own_rollout():
    config = TimeToGait()

    def prints(config, machine=TROT):
        return [fingerprint(config, learner, machine) for learner in (GAITSHIFT, BASELINE)]

    first = prints(config)
    assert first == prints(TimeToGait(seeds=7, baseline_budget=3.0, gaits=("pace",)))
    both = [
        prints(replace(config, recipe=replace(config.recipe, strict_from=61))),
        prints(replace(config, check=Criterion(robots=63))),
        prints(config, gaits.load("pace")),
    ]
    assert all(len({*first, *changed}) == 4 for changed in both)
    ours, baseline = first
    assert prints(replace(config, baseline_rollout=1024))[0] == ours
    assert prints(replace(config, baseline_rollout=1024))[1] != baseline
    assert prints(replace(config, check_every=9))[0] != ours
    assert prints(replace(config, check_every=9))[1] == baseline


def test_trainings_of_another_recipe_are_measured_anew_and_stay_in_the_table(
    tmp_path, monkeypatch, capsys
):
    def told(entry, machine, seed, config):
        made = outcome(machine.name, entry.name, seconds=1.0, seed=seed)
        return replace(made, recipe=fingerprint(config, entry.name, machine))

    monkeypatch.setattr(race, "_train", told)
    table = tmp_path / "time_to_gait.csv"
    write_table(table, [row_of(outcome(seconds=40.0))], COLUMNS)
    command = ["bench", "time-to-gait", "--quick", "--out", str(tmp_path)]
    for _ in range(2):  # what the first call measured, the second knows
        main(command)
        capsys.readouterr()
        rows = read_typed(table, COLUMNS, "trainings")
        assert [(r["learner"], r["seconds"]) for r in rows] == [
            (GAITSHIFT, 1.0),
            (BASELINE, 1.0),
            (GAITSHIFT, 40.0),
        ]
        assert [r["recipe"] == "0123456789ab" for r in rows] == [False, False, True]


def test_learners_take_turns_and_a_budget_of_nothing_leaves_the_baseline_out(monkeypatch):
    def told(entry, machine, seed, check):
        return outcome(machine.name, entry.name, seed=seed)

    monkeypatch.setattr(race, "_train", told)
    both = [(o.seed, o.gait, o.learner) for o in time_to_gait(TimeToGait(seeds=2))]
    assert len(both) == TimeToGait(seeds=2).trainings == 12
    assert both[:3] == [
        (0, "trot", "gaitshift"),
        (0, "trot", "stable-baselines3"),
        (0, "pace", "gaitshift"),
    ]
    part = TimeToGait(gaits=("bound", "trot"), seeds=2, first_seed=3, baseline_budget=0.0)
    seeds = [(o.seed, o.gait) for o in time_to_gait(part)]
    assert seeds == [(3, "bound"), (3, "trot"), (4, "bound"), (4, "trot")]
    alone = TimeToGait(seeds=2, baseline_budget=0.0)
    assert [o.learner for o in time_to_gait(alone)] == ["gaitshift"] * alone.trainings


def test_trainings_that_are_known_are_not_repeated_but_where_more_would_be_told(monkeypatch):
    def told(entry, machine, seed, check):
        return outcome(machine.name, entry.name, seconds=1.0, seed=seed)

    monkeypatch.setattr(race, "_train", told)
    config = TimeToGait(gaits=("trot",), seeds=3, baseline_budget=50.0)
    known = [
        replace(one, recipe=fingerprint(config, one.learner, gaits.load(one.gait)))
        for one in (
            outcome(seed=0, seconds=40.0),
            outcome(learner="stable-baselines3", seed=0, seconds=51.0, reached=False),
            outcome(learner="stable-baselines3", seed=1, seconds=49.0, reached=False),
            outcome("pace", seed=1, seconds=40.0),
            outcome(seed=2, seconds=2000.0, reached=False),
        )
    ]
    assert [o.seconds for o in time_to_gait(config, known)] == [40.0, 51.0, 1.0, 1.0, 2000.0, 1.0]


def test_the_full_measurement_is_the_flat_stage_of_the_default_recipe_and_the_papers_library():
    config = TimeToGait()
    assert config.recipe == replace(Recipe(), stages=Recipe().stages[:1])
    assert (config.gaits, config.seeds) == (("trot", "pace", "bound"), 3)
    assert (ROBOTS, config.baseline_rollout) == (30, 2048)


# Medians and ratios -----------------------------------------------------------------------------


def test_the_median_counts_a_training_that_was_given_up_as_last():
    quick, slow = outcome(seconds=20.0), outcome(seconds=50.0)
    given_up = outcome(seconds=30.0, reached=False)
    assert middle([slow, given_up, quick]) == slow
    assert middle([given_up, quick, replace(given_up, seconds=31.0)]) == given_up
    assert middle([quick, slow]) == slow
    assert middle([given_up]) == given_up


def test_the_ratio_is_a_bound_where_the_baseline_was_given_up_and_unknown_where_ours_was():
    ours = [outcome(seconds=s) for s in (40.0, 50.0, 60.0)]
    baseline = [
        outcome(learner="stable-baselines3", seconds=s, reached=r)
        for s, r in ((400.0, True), (610.0, False), (620.0, False))
    ]
    told = summary([*ours, *baseline])["trot"]
    assert (told["ratio"], told["ratio_is_lower_bound"]) == (12.2, True)
    assert told["learners"]["gaitshift"]["seconds"] == 50.0
    assert [s["seconds"] for s in told["learners"]["stable-baselines3"]["seeds"]] == [400, 610, 620]
    assert ratio(outcome(reached=False), baseline[0]) is None
    assert summary(ours)["trot"]["ratio"] is None


@pytest.mark.parametrize(
    ("times", "text"), [(12.9, "12"), (10.0, "10"), (9.99, "9.9"), (6.25, "6.2"), (0.5, "0.5")]
)
def test_ratios_are_rounded_down(times, text):
    assert ratio_text(times, is_lower_bound=False) == text
    assert ratio_text(times, is_lower_bound=True) == f"> {text}"


def test_the_table_and_the_figure_show_every_training(tmp_path):
    outcomes = [
        outcome(gait, learner, seconds, reached=reached, seed=seed)
        for gait in ("trot", "bound")
        for learner, reached, base in (
            ("gaitshift", True, 40.0),
            ("stable-baselines3", False, 600.0),
        )
        for seed, seconds in enumerate((base, 1.3 * base))
    ]
    write_table(tmp_path / "time_to_gait.csv", [row_of(o) for o in outcomes], COLUMNS)
    rows = read_typed(tmp_path / "time_to_gait.csv", COLUMNS, "trainings")
    assert [outcome_of(row) for row in rows] == outcomes
    figure = time_to_gait_figure(outcomes, tmp_path / "time_to_gait.png")
    axes = figure.axes[0]
    dots = [line.get_xdata()[0] for line in axes.lines if line.get_marker() == "o"]
    assert sorted(dots) == sorted(o.seconds for o in outcomes)
    words = [text.get_text() for text in axes.texts]
    assert words.count("> 15 ×\nfaster") == 2
    assert "gaitshift: 52 s" in words
    assert "stable-baselines3: > 780 s" in words
    with Image.open(tmp_path / "time_to_gait.png") as image:
        assert image.width == 1200
    none = tmp_path / "none.png"
    with pytest.raises(GaitshiftError) as error:
        time_to_gait_figure([], none)
    assert str(error.value).startswith(str(none))
    assert not none.exists()


# The command ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_quick_measurement_runs_from_the_command_to_the_figure(capsys, tmp_path):
    out = tmp_path / "bench"
    main(["bench", "time-to-gait", "--quick", "--json", "--out", str(out)])
    said = capsys.readouterr()
    told = json.loads(said.out)
    assert told["check"]["survival"] == 0.99
    learners = told["gaits"]["trot"]["learners"]
    assert set(learners) == {"gaitshift", "stable-baselines3"}
    for learner in learners.values():
        (seed,) = learner["seeds"]
        assert not seed["reached"], "nobody trots after a second"
        assert seed["seconds"] > 0
        assert 0.0 <= seed["survival"] <= 1.0
    assert learners["gaitshift"]["steps"] == 2 * 8 * Recipe().steps
    assert told["gaits"]["trot"]["ratio"] is None
    assert {file.name for file in out.iterdir()} == {"time_to_gait.csv", "time_to_gait.png"}
    assert len(said.err.strip().splitlines()) == 2, "a line a training"

    table = out / "time_to_gait.csv"
    before = table.read_text()
    table.write_text("\n".join([*before.splitlines()[:2], ""]))  # as if broken off after one
    main(["bench", "time-to-gait", "--quick", "--json", "--out", str(out)])
    ours, baseline = (line.split(",") for line in table.read_text().splitlines()[1:])
    assert ",".join(ours) == before.splitlines()[1]
    assert baseline[1] == "stable-baselines3"


def test_ours_alone_is_measured_and_a_check_that_asks_for_nothing_is_passed_at_once():
    anything = Criterion(survival=0.0, speed_error=9.0, pattern_fraction=0.0, robots=2, seconds=2.2)
    config = replace(TimeToGait.quick(), baseline_budget=0.0, check=anything)
    (found,) = time_to_gait(config)
    assert found.reached
    assert found.steps == 8 * Recipe().steps
