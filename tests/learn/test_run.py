"""A run and its folder: written down, broken off, going on with the same bits."""

import csv
import errno
import json
import shutil
from dataclasses import fields, replace

import numpy as np
import onnx
import pytest
from tensorboard.summary.writer.record_writer import RecordWriter

from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.learn.ground import draw_grounds
from gaitshift.learn.presets import PRESETS
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.learn.run import Run
from gaitshift.sim.env import Curriculum, EnvConfig
from gaitshift.sim.push import PushConfig
from gaitshift.sim.reward import SHARES, RewardConfig
from training import TINY, TROT, KilledError, create, kill_at, rows, same_bits, weights


def test_a_run_reports_every_iteration_and_writes_it_down(whole):
    run, reported = whole
    written = rows(run.folder)
    assert [row["iteration"] for row in reported] == [1, 2, 3, 4, 5, 6]
    assert [row["stage"] for row in reported] == ["flat"] * 3 + ["rough"] * 3
    assert [row["steps"] for row in reported] == [32, 64, 96, 128, 160, 192]
    assert [row["wall_s"] for row in reported] == sorted(row["wall_s"] for row in reported)
    told = [{k: str(v) for k, v in row.items() if k != "wall_s"} for row in reported]
    assert written == told


def test_progress_has_a_column_for_every_figure_and_every_term_of_the_reward(whole):
    run, reported = whole
    figures = {"iteration", "stage", "steps", "wall_s", "reward", "speed", "changes_per_s"}
    figures |= {"stance_fraction", "survival", "value_loss", "action_std", "learning_rate"}
    figures |= {"diverged"}
    weights = {field.name for field in fields(RewardConfig)}
    terms = weights - {"bonus_mode", *SHARES}
    assert set(reported[0]) == figures | {f"reward/{name}" for name in terms}
    for row in reported:
        assert all(np.isfinite(value) for name, value in row.items() if name != "stage")
        assert row["reward"] == pytest.approx(sum(row[f"reward/{n}"] for n in terms), abs=1e-3)
        most = row["changes_per_s"] / 100 * run.recipe.env.reward.bonus
        assert 0 <= row["reward/bonus"] <= most + 1e-3, "a low swing is paid in part"


def test_a_run_ends_on_the_ground_and_with_the_pushes_of_its_last_stage(whole):
    run, _ = whole
    world = run.learner.env.world
    drawn = draw_grounds(TINY.stages[1], 2, run.config.seed)[: TINY.robots]
    for ground, expected in zip(world.terrains, drawn, strict=True):
        np.testing.assert_array_equal(ground.height, expected.height)
    assert run.learner.env.config.push.force == 100.0
    assert run.learner.env.curriculum == Curriculum(
        strictness=1.0, swing_factor=1.5, command_scale=1.0, randomisation=0.0, mixed_starts=0.5
    )
    settled = run.recipe.settling(run.recipe.iterations - 1)
    assert settled < 1.0
    assert run.learner.ppo.entropy_coef == settled * run.recipe.ppo.entropy
    factor = settled * run.recipe.stages[-1].kl_factor
    assert run.learner.ppo.desired_kl == factor * run.recipe.ppo.desired_kl != 0.0
    assert run.learner.ppo.gamma == pytest.approx(0.995), "1 / (1 - 0.99) steps, twice"
    assert run.learner.ppo.lam == pytest.approx(0.98), "1 / (1 - 0.95) steps, two and a half times"


def test_the_config_is_read_back_into_the_same_run(whole):
    run, _ = whole
    again = Run.resume(run.folder)
    assert again.recipe == TINY
    assert again.machine == TROT
    assert (again.config.seed, again.config.command) == (7, "gaitshift train trot")
    config = json.loads((run.folder / "config.json").read_text())
    assert {"python", "numpy", "torch", "mujoco-core"} <= set(config["versions"])


def test_every_preset_and_every_field_survives_the_config_file(tmp_path):
    unusual = replace(
        TINY,
        env=EnvConfig(
            reward=RewardConfig(slip=-9.0, bonus=50.0, bonus_mode="multiply_clipped"),
            push=PushConfig(force=11.0, duration=3, interval=17, vertical=0.9),
            observed=("contact", "machine_state"),
            gains="paper",
            forward_speed=0.4,
        ),
        ppo=PpoConfig(hidden=(5,), mirror=False, clip_values=True, reward_scale=3.0),
    )
    for number, recipe in enumerate([unusual, *(preset() for preset in PRESETS.values())]):
        recipe = replace(recipe, robots=2)
        folder = tmp_path / str(number)
        create(folder, recipe=recipe)
        assert Run.resume(folder).recipe == recipe


@pytest.mark.parametrize("iteration", [3, 5])
def test_a_run_that_was_killed_and_goes_on_ends_with_the_same_bits(tmp_path, whole, iteration):
    unbroken, _ = whole
    folder = tmp_path / "broken"
    with pytest.raises(KilledError):
        create(folder).train(kill_at(iteration))
    run = Run.resume(folder)
    assert run.iteration == iteration - 1
    run.train()
    assert same_bits(weights(run), weights(unbroken))
    assert rows(folder) == rows(unbroken.folder)
    np.testing.assert_array_equal(initializers(folder), initializers(unbroken.folder))


def initializers(folder):
    """All numbers of a policy's network."""
    graph = onnx.load(folder / "policy.onnx").graph
    return np.concatenate([onnx.numpy_helper.to_array(part).ravel() for part in graph.initializer])


def test_a_run_that_was_killed_twice_at_other_steps_ends_with_the_same_bits(tmp_path, whole):
    folder = tmp_path / "broken"
    with pytest.raises(KilledError):
        create(folder).train(kill_at(1))
    with pytest.raises(KilledError):
        Run.resume(folder).train(kill_at(4))
    # The process died while it wrote a line.
    with (folder / "progress.csv").open("a") as file:
        file.write("5,rough,16")
    run = Run.resume(folder)
    run.train()
    assert same_bits(weights(run), weights(whole[0]))
    assert rows(folder) == rows(whole[0].folder)


def test_a_killed_run_of_robots_that_differ_and_sense_with_errors_ends_with_the_same_bits(tmp_path):
    env = replace(PRESETS["deployable"]().env, episode_steps=30, command_interval=11)
    recipe = replace(TINY, env=env)
    unbroken, broken = create(tmp_path / "whole", recipe=recipe), tmp_path / "broken"
    unbroken.train()
    with pytest.raises(KilledError):
        create(broken, recipe=recipe).train(kill_at(4))
    run = Run.resume(broken)
    run.train()
    assert same_bits(weights(run), weights(unbroken))
    assert rows(broken) == rows(unbroken.folder)


def test_the_policy_of_every_checkpoint_is_judged_once_though_the_run_was_killed(tmp_path):
    """Killed between checkpoints 2 and 4, after a verdict on a policy that was then lost."""
    judged = []

    def judge(path):
        judged.append(policy.load(path).info.training["iterations"])
        return {"gait": "trot", "misses": "speed_error 0.2; clearance FL 0.01"}

    folder = tmp_path / "run"
    with pytest.raises(KilledError):
        create(folder).train(kill_at(3), judge)
    with (folder / "verdicts.csv").open("a") as file:
        file.write("4,none,\n")
    Run.resume(folder).train(judge=judge)
    with (folder / "verdicts.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert judged == [int(line["iteration"]) for line in lines] == [2, 4, 6]
    assert {line["gait"] for line in lines} == {"trot"}
    assert lines[0]["misses"] == "speed_error 0.2; clearance FL 0.01"


@pytest.mark.parametrize("half_a_line", [False, True])
def test_a_policy_whose_judging_was_broken_off_is_judged_first_when_the_run_goes_on(
    tmp_path, whole, half_a_line
):
    judged = []

    def judge(path):
        iterations = policy.load(path).info.training["iterations"]
        if iterations == 4 and 4 not in judged:
            judged.append(4)
            raise KilledError
        judged.append(iterations)
        return {"gait": "trot", "clean": False}

    folder = tmp_path / "run"
    with pytest.raises(KilledError):
        create(folder).train(judge=judge)
    if half_a_line:
        with (folder / "verdicts.csv").open("a") as file:
            file.write("4,tr")
    run = Run.resume(folder)
    run.train(judge=judge)
    assert judged == [2, 4, 4, 6]
    with (folder / "verdicts.csv").open(newline="") as file:
        assert [line["iteration"] for line in csv.DictReader(file)] == ["2", "4", "6"]
    assert same_bits(weights(run), weights(whole[0])), "and it trains as if it had not been"
    assert rows(folder) == rows(whole[0].folder)
    Run.resume(folder).train(judge=judge)
    assert judged == [2, 4, 4, 6], "nothing is judged twice"


def test_an_interrupted_run_leaves_the_policy_as_it_stands(tmp_path):
    folder = tmp_path / "run"
    with pytest.raises(KeyboardInterrupt):
        create(folder).train(kill_at(3, KeyboardInterrupt))
    assert policy.load(folder / "policy.onnx").info.training["iterations"] == 3


def test_a_finished_run_that_goes_on_changes_nothing(tmp_path, whole):
    folder = tmp_path / "copy"
    shutil.copytree(whole[0].folder, folder)
    run = Run.resume(folder)
    run.train()
    assert same_bits(weights(run), weights(whole[0]))
    assert rows(folder) == rows(whole[0].folder)


def test_the_same_seed_gives_the_same_weights_and_another_seed_others(tmp_path, whole):
    same = create(tmp_path / "same")
    first = weights(same)
    same.train()
    assert same_bits(weights(same), weights(whole[0]))
    assert rows(same.folder) == rows(whole[0].folder)
    other = create(tmp_path / "other", seed=8)
    assert not same_bits(weights(other), first), "seeds differ from the first weights on"
    other.train()
    assert rows(other.folder)[0]["reward"] != rows(whole[0].folder)[0]["reward"]


@pytest.mark.slow
def test_sixty_iterations_are_enough_to_find_the_cycle_of_a_gait(tmp_path):
    """The default recipe, cut short: nothing in it is of another size."""
    recipe = Recipe(threads=1).with_iterations(60)
    reported = []
    create(tmp_path / "run", seed=0, recipe=recipe).train(reported.append)

    def mean(some, name):
        return np.mean([row[name] for row in some])

    early, late = reported[:1], reported[-10:]
    # A dwell of 20 steps allows 5 changes a second.
    assert mean(early, "changes_per_s") < 1.5
    assert mean(late, "changes_per_s") > 3.0
    assert mean(late, "reward") > mean(early, "reward") + 3.0


def test_divergences_are_counted_and_the_first_are_kept(tmp_path):
    """Robot 1 diverges in the first step of every iteration."""
    run = create(tmp_path / "run")
    step = run.learner.env.step

    def wild(actions):
        if run.learner.env.world.divergences == []:
            run.learner.env.world._applied[1, 3] = 1e30
        return step(actions)

    run.learner.env.step = wild
    kept, reported = [], []
    run.train(reported.append, keep=lambda lost, path: kept.append((lost.robot, path.name)))
    assert [row["diverged"] for row in reported] == [1.0] * 6
    assert kept == [(1, f"{iteration:06d}-1.npz") for iteration in range(1, 7)]


def test_a_disk_that_fills_under_tensorboard_is_one_line_and_the_run_goes_on(
    tmp_path, whole, monkeypatch, capfd
):
    """TensorBoard's thread prints a traceback of its own, and hands the error to a later call."""

    def fails(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    def fill_the_disk(row):
        if row["iteration"] == 2:
            monkeypatch.setattr(RecordWriter, "write", fails)

    run = create(tmp_path / "full")
    with pytest.raises(GaitshiftError, match=r"tensorboard cannot be written: No space left"):
        run.train(fill_the_disk)
    assert "Traceback" not in capfd.readouterr().err
    monkeypatch.undo()
    again = Run.resume(tmp_path / "full")
    again.train()
    assert same_bits(weights(again), weights(whole[0]))
