"""The standard trials and `evaluate`'s picture, on policies that are barely trained."""

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.gait import gaits
from gaitshift.lab.evaluation import SIZES, EvaluationConfig, run_trials
from gaitshift.lab.evaluation import commands as commands_module
from gaitshift.lab.evaluation import trials as trials_module
from gaitshift.lab.evaluation.evaluate import field_length, grounds_of
from gaitshift.lab.evaluation.trials import TRIALS, Row, Size, distances, lateral_errors
from gaitshift.learn.export import describe, export
from gaitshift.learn.learner import Learner
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.sensor_config import CHEAP
from gaitshift.sim.terrain import flat, from_spec
from synthetic import log_of

GROUNDS = sum(trial.figure == "survival" for trial in TRIALS)
"""Grounds to survive, each with a distance too."""

TINY = Size(pushed=6, episodes=3, seconds=0.3, distance=0.2)


@pytest.fixture(scope="module")
def walk_file(tmp_path_factory):
    """An untrained policy that holds the stance: its actions are all but zero."""
    torch.manual_seed(0)
    env = GaitEnv(
        gaits.load("walk"), flat(10.0, 10.0), 2, config=EnvConfig(command_share=0.0), threads=1
    )
    actor = Learner(
        env, Recipe(env=env.config, ppo=PpoConfig(hidden=(8, 8)), robots=2, steps=2)
    ).ppo.actor
    with torch.no_grad():
        for parameter in actor.mlp.parameters():
            parameter.mul_(0.01)
    path = tmp_path_factory.mktemp("policy") / "walk.onnx"
    export(actor.eval(), describe(env, {}), path)
    return path


@pytest.fixture(scope="module")
def tried(walk_file):
    """What trials give, and how their progress was told."""
    done = []
    result = run_trials(
        policy.load(walk_file), TINY, report=lambda now, total: done.append((now, total))
    )
    return result, done


def test_trials_give_a_row_for_every_ground_and_every_limit(tried):
    (rows, figures, log), done = tried
    titles = [row.trial for row in rows]
    assert len(set(titles)) == len(rows) == len(TRIALS) + GROUNDS + 8
    assert [title for title in titles if "perlin:0.20" in title]
    survival = [row for row in rows if row.trial.startswith("survival")]
    assert all(row.value == 1.0 for row in survival), "standing for 0.3 s is no feat"
    shares = [row for row in rows if row.trial.startswith("distance_share")]
    assert len(shares) == len(survival) == GROUNDS == 10
    assert all(row.value < 1.0 and row.limit is None for row in shares), "nobody walks"
    lateral = [row for row in rows if row.trial.startswith("lateral")]
    assert all(row.value is None and row.passed is False for row in lateral), "nobody walks"
    assert log.sensed.contact.shape == (30, 3, 4)
    assert figures["verdict"]["gait"] == "none", "there is nothing after the warm-up"
    assert done[-1][0] == done[-1][1]
    assert [now for now, _ in done] == sorted(now for now, _ in done)


def test_batches_have_all_robots_and_seeds_of_their_own(walk_file, monkeypatch):
    monkeypatch.setattr(trials_module, "BATCH", 16 * 30)
    size = replace(TINY, pushed=40)
    run = EvaluationConfig(seconds=size.seconds, sensors=CHEAP, seed=5, simulator="pybullet")
    configs = list(trials_module._batches(TRIALS[0], policy.load(walk_file), run, size))
    assert all(config.sensors == CHEAP for config in configs)
    assert [config.episodes for config in configs] == [16, 16, 8]
    assert [config.seed for config in configs] == [5, 6, 7]
    assert {config.simulator for config in configs} == {"pybullet"}


@pytest.mark.parametrize("trial", TRIALS, ids=lambda trial: trial.terrain)
def test_grounds_of_trials_are_long_enough_and_level_where_robots_start(trial):
    """Starts lie at 2 m; stairs and steps come again and again over the whole length."""
    ground = from_spec(trial.spec(20.0), seed=0, length=20.0, width=2.0)
    assert ground.size[0] >= 20.0
    if trial.piece is None:
        return
    profile = ground.height_at(np.stack([np.linspace(0, 20, 400), np.zeros(400)], axis=1))
    assert np.ptp(profile[:50]) == 0.0
    rises = np.flatnonzero(np.diff(profile) > 1e-6)
    assert len(rises) >= 3
    assert rises.max() > 300


@pytest.mark.parametrize("size", [SIZES["all"], TINY], ids=["all", "tiny"])
@pytest.mark.parametrize("speed", [0.3, 1.2])
def test_no_ground_of_a_trial_is_refused(size, speed):
    for trial in TRIALS:
        spec = trial.spec(field_length(speed, size.seconds))
        grounds_of(spec, seed=0, speed=speed, seconds=size.seconds)


def test_the_quick_trials_are_a_small_part_of_all():
    assert SIZES["all"].pushed == 1000
    assert SIZES["all"].episodes == 256
    assert SIZES["quick"].episodes * SIZES["quick"].seconds < 0.05 * 256 * 20


def test_the_lateral_error_is_taken_at_the_distance_and_who_never_arrives_is_beyond_all():
    """Robots at 1 m/s: drifting by 0.1 m a metre from y = 2; too slow; fallen before."""
    x, place = np.arange(300) / 100, np.zeros((300, 3, 3))
    place[:, 0, 0], place[:, 0, 1] = x, 2.0 - 0.1 * x
    place[:, 1, 0] = 0.3 * x
    place[:, 2, 0] = x
    log = log_of(np.zeros((300, 3, 4), dtype=bool), base_position_w=place)
    log.fallen[50:, 2] = True
    assert lateral_errors(log, 2.0) == pytest.approx([0.2, np.inf, np.inf])


def test_the_distance_is_taken_along_x_until_the_fall():
    """Robots at 1 m/s from x = 5 for 3 s: one goes on, one falls after 1 s, one at once."""
    place = np.zeros((301, 1, 3))
    place[:, 0, 0] = 5.0 + np.arange(301) / 100
    log = log_of(np.zeros((301, 3, 4), dtype=bool), base_position_w=place)
    log.fallen[101:, 1] = True
    log.fallen[:, 2] = True
    assert distances(log) == pytest.approx([3.0, 1.0, 0.0], abs=1e-5)


@pytest.mark.parametrize(
    ("value", "bound", "limit", "passed"),
    [
        (0.97, "at_least", 0.97, True),
        (0.96, "at_least", 0.97, False),
        (0.5, "at_most", 0.5, True),
        (0.51, "at_most", 0.5, False),
        (None, "at_most", 0.5, False),
        (0.1, "at_least", None, None),
    ],
)
def test_a_row_passes_on_the_right_side_of_its_limit(value, bound, limit, passed):
    assert Row(trial="x", value=value, bound=bound, limit=limit).passed is passed


def test_evaluate_prints_one_object_and_draws(walk_file, tmp_path, capsys):
    picture = tmp_path / "walk.png"
    options = ["--episodes", "2", "--seconds", "2.5", "--json", "--plot", str(picture)]
    main(["evaluate", str(walk_file), *options])
    said = json.loads(capsys.readouterr().out)
    assert said["gait"] == "walk"
    assert said["verdict"]["gait"] == "stand"
    assert set(said["verdict"]["scores"]) == set(gaits.names())
    assert picture.stat().st_size > 10_000


def test_trials_are_printed_as_one_object_or_as_a_table(walk_file, tried, capsys, monkeypatch):
    monkeypatch.setattr("gaitshift.cli.evaluate.run_trials", lambda *_, **__: tried[0])
    main(["evaluate", str(walk_file), "--trials", "quick", "--json"])
    said = json.loads(capsys.readouterr().out)
    assert len(said["trials"]) == len(TRIALS) + GROUNDS + 8
    assert said["size"]["name"] == "quick"
    main(["evaluate", str(walk_file), "--trials", "quick"])
    table = capsys.readouterr().out
    assert "limits met" in table
    assert "speed_error [m/s]" in table


@pytest.mark.slow
def test_commands_are_asked_for_over_their_ranges_and_what_comes_of_them_is_told(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.setattr(commands_module, "ROBOTS", 2)
    monkeypatch.setattr(commands_module, "SECONDS", 2.5)
    main(["evaluate", "trot", "--commands", "--json"])
    rows = json.loads(capsys.readouterr().out)["commands"]
    info = policy.load("trot").info
    assert len(rows) == 10
    own = (info.forward_speed, info.stride_frequency)
    assert [row["stride_frequency"] for row in rows[:5]] == [own[1]] * 5
    assert [row["forward_speed"] for row in rows[5:]] == [own[0]] * 5
    assert [rows[0]["forward_speed"], rows[4]["forward_speed"]] == info.speed_range
    ends = [rows[5]["stride_frequency"], rows[9]["stride_frequency"]]
    assert ends == pytest.approx(info.stride_frequency_range)
    speeds = [row["speed_mean"] for row in rows[:5]]
    assert speeds == sorted(speeds), "who is asked to go faster goes faster"
    assert rows[9]["cycles_per_s"] > rows[5]["cycles_per_s"] + 0.5
    main(["evaluate", "trot", "--commands"])
    assert "1.60 m/s, 2.50 Hz" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (
            ["--trials", "quick", "--terrain", "slope:10"],
            "--terrain must not be given with --trials",
        ),
        (["--commands", "--seconds", "3"], "--seconds must not be given with --commands"),
        (["--commands", "--plot", "walk.png"], "must not be given with --trials, --log or --plot"),
        (["--plot", "walk.gif"], "walk.gif: the name of a figure must end in"),
    ],
)
def test_what_cannot_be_done_is_said_before_the_work(walk_file, options, says, capsys):
    with pytest.raises(SystemExit) as end:
        main(["evaluate", str(walk_file), *options])
    assert end.value.code == 2
    assert says in capsys.readouterr().err
