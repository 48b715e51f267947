"""Training: recipes, grounds, runs that break off and go on, and values with a closed form."""

import csv
import json
import shutil
from dataclasses import fields, replace
from inspect import signature

import numpy as np
import onnx
import pytest
import stable_baselines3
import torch
from stable_baselines3.common.policies import ActorCriticPolicy
from tensordict import TensorDict

from gaitshift import table
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.lab.benchmark.baseline import GaitVecEnv
from gaitshift.learn.ground import draw_grounds, stage_at
from gaitshift.learn.learner import Learner
from gaitshift.learn.progress import last
from gaitshift.learn.recipe import PRESETS, PpoConfig, Recipe, Stage
from gaitshift.learn.run import Run
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.reward import BONUS_SHARES, RewardConfig
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import PushConfig

TROT = gaits.load("trot")
TINY = Recipe(
    env=EnvConfig(episode_steps=30, command_interval=11),
    ppo=PpoConfig(hidden=(16, 8), epochs=2, mini_batches=2),
    stages=(
        Stage(name="flat", iterations=3, push=50.0),
        Stage(
            name="rough",
            iterations=3,
            amplitude=0.1,
            slope=8.0,
            stair=0.04,
            step=0.06,
            redraw_every=2,
            push=100.0,
            swing_factor=1.5,
            kl_factor=3.0,
            horizon_factor=2.0,
            trace_factor=2.5,
            mixed_starts=0.5,
            settle=1.0,
            averaged=0.8,  # iterations 3.6 to 6: two checkpoints
        ),
    ),
    robots=4,
    steps=8,
    strict_from=1,
    strict_until=4,
    command_from=0,
    command_until=5,
    checkpoint_every=2,
    threads=1,
)
ABC = replace(
    TINY,
    stages=(
        Stage(name="a", iterations=3),
        Stage(name="b", iterations=4, amplitude=0.1),
        Stage(name="c", iterations=5, amplitude=0.2),
    ),
)


class KilledError(Exception):
    """Stands for whatever ends a process."""


def kill_at(iteration, error=KilledError):
    """A report that breaks the run off after this iteration, before its checkpoint."""

    def report(row):
        if row["iteration"] == iteration:
            raise error

    return report


def create(folder, *, seed=7, recipe=TINY, **options):
    return Run.create(folder, TROT, recipe, seed=seed, command="gaitshift train trot", **options)


def rows(folder):
    """progress.csv without the one column that depends on the clock."""
    with (folder / "progress.csv").open(newline="") as file:
        return [
            {name: value for name, value in row.items() if name != "wall_s"}
            for row in csv.DictReader(file)
        ]


def weights(run):
    """Every number of networks, statistics and optimiser, by name."""
    flat_state = {}

    def collect(name, value):
        if isinstance(value, dict):
            for key, part in value.items():
                collect(f"{name}/{key}", part)
        elif isinstance(value, list | tuple):
            for key, part in enumerate(value):
                collect(f"{name}/{key}", part)
        else:
            flat_state[name] = value.clone() if isinstance(value, torch.Tensor) else value

    collect("", run.learner.ppo.save())
    return flat_state


def same_bits(one, other):
    return one.keys() == other.keys() and all(
        torch.equal(value, other[name]) if isinstance(value, torch.Tensor) else value == other[name]
        for name, value in one.items()
    )


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that was never broken off, and the rows that it reported."""
    run = create(tmp_path_factory.mktemp("training") / "whole")
    reported = []
    run.train(reported.append)
    return run, reported


# Recipes ----------------------------------------------------------------------------------------


def test_the_paper_preset_has_the_papers_figures():
    recipe = PRESETS["paper"]()
    assert (recipe.robots, recipe.steps, recipe.iterations) == (30, 100, 500)
    assert recipe.ppo.hidden == (256, 128, 32)
    assert [stage.amplitude for stage in recipe.stages] == [0.0]
    assert recipe.env.reward == RewardConfig.paper()
    assert recipe.env.forward_speed == 1.2
    assert recipe.env.gains == "paper"
    assert recipe.strictness(0) == recipe.strictness(499) == 0.0
    assert recipe.env.command_share == recipe.env.heading_range == 0.0


def test_the_paper_preset_has_the_defaults_of_stable_baselines3_but_for_those_told():
    def defaults(kind):
        return {name: p.default for name, p in signature(kind.__init__).parameters.items()}

    recipe = PRESETS["paper"]()
    ours, theirs, network = recipe.ppo, defaults(stable_baselines3.PPO), defaults(ActorCriticPolicy)
    assert (ours.epochs, ours.learning_rate) == (theirs["n_epochs"], theirs["learning_rate"])
    assert (ours.discount, ours.gae_lambda) == (theirs["gamma"], theirs["gae_lambda"])
    assert (ours.clip, ours.entropy) == (theirs["clip_range"], theirs["ent_coef"])
    assert (ours.clip_values, theirs["clip_range_vf"]) == (False, None)
    assert (ours.desired_kl, theirs["target_kl"]) == (0.0, None)
    assert ours.initial_std == np.exp(network["log_std_init"])
    samples = recipe.robots * recipe.steps
    assert ours.mini_batches == -(-samples // theirs["batch_size"])
    assert samples // ours.mini_batches == theirs["batch_size"] - 1

    env = GaitEnv(TROT, flat(20.0, 20.0), 2, config=recipe.env, threads=1)
    ppo = Learner(env, replace(recipe, robots=2)).ppo
    adam = ppo.optimizer.param_groups[0]
    assert (ppo.value_loss_coef, theirs["vf_coef"]) == (1.0, 0.5)
    assert (ppo.max_grad_norm, theirs["max_grad_norm"]) == (1.0, 0.5)
    assert (ppo.normalize_advantage_per_mini_batch, theirs["normalize_advantage"]) == (False, True)
    baseline = stable_baselines3.PPO("MlpPolicy", GaitVecEnv(env), device="cpu")
    assert (adam["eps"], baseline.policy.optimizer.param_groups[0]["eps"]) == (1e-8, 1e-5)
    assert (ppo.schedule, adam["lr"]) == ("fixed", theirs["learning_rate"])


@pytest.mark.parametrize(
    "faulty",
    [
        {"robots": 0},
        {"robots": 65537},
        {"steps": 0},
        {"strict_from": 4, "strict_until": 4},
        {"strict_from": -1},
        {"command_from": 5, "command_until": 5},
        {"command_from": -1},
        {"stages": ()},
        {"stages": (Stage(name="flat", iterations=0),)},
        {"stages": (Stage(name="flat", iterations=5), Stage(name="rough", iterations=-1))},
    ],
)
def test_recipes_that_cannot_be_run_are_refused(faulty):
    name = "iterations" if "stages" in faulty else next(iter(faulty))
    with pytest.raises(GaitshiftError, match=name):
        replace(TINY, **faulty)


@pytest.mark.parametrize(
    ("faulty", "right"),
    [
        ({"settle": 1.5}, "0 to 1"),
        ({"averaged": -0.1}, "0 to 1"),
        ({"trace_factor": 0.0}, "above 0"),
        ({"horizon_factor": -1.0}, "above 0"),
        ({"fields": ("flat", "moon")}, "flat, perlin, slope, stair, step"),
        ({"fields": ()}, "flat, perlin, slope, stair, step"),
    ],
)
def test_stages_that_cannot_be_run_are_refused(faulty, right):
    with pytest.raises(GaitshiftError, match=f"{next(iter(faulty))}.*{right}"):
        Stage(name="rough", iterations=5, **faulty)


@pytest.mark.parametrize(
    ("iterations", "stages"),
    [
        (1, [("a", 1)]),
        (3, [("a", 3)]),
        (5, [("a", 3), ("b", 2)]),
        (12, [("a", 3), ("b", 4), ("c", 5)]),
        (20, [("a", 3), ("b", 4), ("c", 13)]),
    ],
)
def test_a_recipe_is_cut_or_its_last_stage_drawn_out(iterations, stages):
    recipe = ABC.with_iterations(iterations)
    assert [(stage.name, stage.iterations) for stage in recipe.stages] == stages
    assert recipe.iterations == iterations


def test_a_recipe_that_repeats_a_stage_is_cut_in_order_too():
    easy, hard = Stage(name="a", iterations=2), Stage(name="b", iterations=3)
    recipe = replace(TINY, stages=(easy, hard, easy)).with_iterations(6)
    assert [(s.name, s.iterations) for s in recipe.stages] == [("a", 2), ("b", 3), ("a", 1)]


def test_no_iterations_are_too_few():
    with pytest.raises(GaitshiftError, match="iterations must be 1 or more, got 0"):
        ABC.with_iterations(0)


@pytest.mark.parametrize("share", [1.0, 0.5])
def test_strictness_grows_in_a_straight_line_up_to_its_share(share):
    recipe = replace(TINY, strict_from=10, strict_until=30, strict_share=share)
    table = {0: 0.0, 10: 0.0, 15: 0.25, 20: 0.5, 30: 1.0, 31: 1.0, 1000: 1.0}
    for iteration, grown in table.items():
        assert recipe.strictness(iteration) == share * grown


def test_commands_spread_in_a_straight_line_and_go_by_no_other_schedule():
    recipe = replace(TINY, command_from=8, command_until=16, strict_from=100, strict_until=101)
    table = {0: 0.0, 8: 0.0, 9: 0.125, 12: 0.5, 16: 1.0, 17: 1.0, 1000: 1.0}
    assert {i: recipe.command_scale(i) for i in table} == table


def test_a_policy_settles_in_the_last_part_of_the_stage_it_ends_with():
    first, last = Stage(name="a", iterations=50, settle=1.0), Stage(name="b", iterations=50)
    recipe = replace(TINY, stages=(first, replace(last, settle=0.8)))
    table = {0: 1.0, 60: 1.0, 70: 0.775, 80: 0.55, 100: 0.1}
    assert {i: pytest.approx(recipe.settling(i)) for i in table} == table
    assert recipe.with_iterations(50).settling(25) == pytest.approx(0.55), "it ends with the first"
    assert replace(recipe, stages=(first, replace(last, settle=0.0))).settling(100) == 1.0


# Grounds ----------------------------------------------------------------------------------------


def test_each_iteration_has_its_stage_and_its_number_within_it():
    table = {0: ("a", 0), 2: ("a", 2), 3: ("b", 0), 6: ("b", 3), 7: ("c", 0), 11: ("c", 4)}
    told = {i: (stage.name, within) for i in table for stage, within in [stage_at(ABC, i)]}
    assert told == table
    stage, within = stage_at(ABC, 15)
    assert (stage.name, within) == ("c", 8), "beyond the end the last stage goes on"


ROUGH = Stage(name="rough", iterations=50, amplitude=0.15, slope=12.0, stair=0.06, step=0.1)


def measures(ground):
    """Largest |height|, steepest gradient [degrees] and highest edge [m] of a ground."""
    along_y, along_x = np.gradient(ground.height, *ground.cell[::-1])
    # On a plane the gradient is the same all over; on stairs it is an edge over a cell.
    gradient = np.degrees(np.arctan(np.hypot(along_x, along_y).max()))
    edge = np.abs(np.diff(ground.height, axis=1)).max()
    return np.abs(ground.height).max(), gradient, edge


def sorts(grounds):
    """Names of the kinds, told by the ground itself: level, a plane, steps along x, or noise."""
    told = []
    for ground in grounds:
        if np.ptp(ground.height) == 0:
            told.append("level")
            continue
        bent = np.abs(np.diff(ground.height, n=2, axis=1)).max() > 1e-9
        same_across = np.ptp(ground.height, axis=0).max() == 0
        told.append("noise" if bent and not same_across else "stairs" if bent else "plane")
    return told


def test_the_same_numbers_give_the_same_grounds_and_others_others():
    def drawn(within, seed):
        rough = (ground for ground in draw_grounds(ROUGH, within, seed) if not ground.is_flat)
        return [ground.height.tobytes() for ground in rough]

    assert drawn(5, 1) == drawn(5, 1)
    for other in (drawn(10, 1), drawn(5, 2)):
        assert all(one != another for one, another in zip(drawn(5, 1), other, strict=True))
    assert len(set(drawn(5, 1))) == 9, "and no two rough fields are alike"


def test_three_fields_stay_level_two_are_noise_and_the_others_a_slope_and_stairs():
    for within in (0, 20, 45):
        grounds = draw_grounds(ROUGH, within, 3)
        assert sorts(grounds) == ["level"] * 3 + ["noise"] * 2 + ["plane"] + ["stairs"] * 6
        assert len({ground.extent for ground in grounds}) == 1, "robots share one rectangle"


def test_the_last_stage_has_more_level_fields_and_fewer_edges():
    grounds = draw_grounds(Recipe().stages[-1], 20, 3)
    assert sorts(grounds) == ["level"] * 5 + ["noise"] * 2 + ["plane"] + ["stairs"] * 4


def test_slopes_rise_in_any_direction():
    angles = []
    for within in range(0, 50):
        for ground in draw_grounds(ROUGH, within, 0)[5:6]:
            along_y, along_x = np.gradient(ground.height, *ground.cell[::-1])
            angles.append(np.arctan2(along_y.mean(), along_x.mean()))
    quarters = np.bincount(np.floor(np.array(angles) / (np.pi / 2)).astype(int) + 2, minlength=4)
    assert quarters.min() >= 5, "of 50 slopes"


def test_no_ground_exceeds_what_its_stage_says_and_late_ones_come_near_it():
    found = np.array(
        [
            [measures(ground) for ground in draw_grounds(ROUGH, within, 0)]
            for within in range(0, 50, 2)
        ]
    )
    limits = {"noise": (slice(3, 5), 0, 0.15), "plane": (slice(5, 6), 1, 12.0)}
    limits |= {"stairs": (slice(6, 9), 2, 0.06), "steps": (slice(9, 12), 2, 0.1)}
    for name, (fields_, measure, limit) in limits.items():
        most = found[:, fields_, measure].max(axis=1)
        assert most.max() <= limit * (1 + 1e-9), name
        assert most[13:].max() > 0.8 * limit, name
        # The first fields reach 0.3 of it, and 0.3 + 0.7 · 4 / 25 after four iterations.
        assert most[:3].max() <= 0.412 * limit * (1 + 1e-9), name


@pytest.mark.parametrize(
    ("measure", "rough"),
    [("amplitude", [3, 4]), ("slope", [5]), ("stair", [6, 7, 8]), ("step", [9, 10, 11])],
)
def test_a_stage_of_one_kind_leaves_the_fields_of_the_others_level(measure, rough):
    stage = Stage(name="one", iterations=10, **{measure: 0.1})
    assert stage.is_rough
    grounds = draw_grounds(stage, 9, 0)
    assert [i for i, ground in enumerate(grounds) if not ground.is_flat] == rough


def test_a_stage_without_measures_is_level():
    stage = Stage(name="flat", iterations=5)
    assert not stage.is_rough
    (ground,) = draw_grounds(stage, 3, 0)
    assert ground.is_flat


# A run and its folder ---------------------------------------------------------------------------


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
    weights = {field.name for field in fields(RewardConfig)}
    terms = weights - {"bonus_mode", *BONUS_SHARES}
    assert set(reported[0]) == figures | {f"reward/{name}" for name in terms}
    for row in reported:
        assert all(np.isfinite(value) for name, value in row.items() if name != "stage")
        assert row["reward"] == pytest.approx(sum(row[f"reward/{n}"] for n in terms), abs=1e-3)
        most = row["changes_per_s"] / 100 * run.recipe.env.reward.bonus
        assert 0 <= row["reward/bonus"] <= most + 1e-3, "a low swing is paid in part"


def test_a_run_ends_on_the_ground_and_with_the_pushes_of_its_last_stage(whole):
    run, _ = whole
    world = run.learner.env.world
    drawn = draw_grounds(TINY.stages[1], 2, run.seed)[: TINY.robots]
    for ground, expected in zip(world.terrains, drawn, strict=True):
        np.testing.assert_array_equal(ground.height, expected.height)
    assert run.learner.env.config.push.force == 100.0
    assert run.learner.env.swing_factor == 1.5
    assert run.learner.env.mixed_starts == 0.5
    assert run.learner.env.strictness == run.learner.env.command_scale == 1.0
    settled = run.recipe.settling(run.recipe.iterations - 1)
    assert settled < 1.0
    assert run.learner.ppo.entropy_coef == settled * run.recipe.ppo.entropy
    factor = settled * run.recipe.stages[-1].kl_factor
    assert run.learner.ppo.desired_kl == factor * run.recipe.ppo.desired_kl != 0.0
    assert run.learner.ppo.gamma == pytest.approx(0.995), "1 / (1 - 0.99) steps, twice"
    assert run.learner.ppo.lam == pytest.approx(0.98), "1 / (1 - 0.95) steps, two and a half times"


def test_the_policy_left_behind_is_the_trained_actor_and_says_how_it_was_made(whole):
    run, _ = whole
    loaded = policy.load(run.folder / "policy.onnx")
    assert loaded.gait == "trot"
    info, trot = loaded.info, gaits.load("trot")
    assert (info.forward_speed, info.speed_range) == (trot.speed, list(trot.speed_range))
    # Two states; control steps of 0.01 s.
    assert info.stride_frequency == pytest.approx(50 / trot.dwell)
    slow, fast = trot.dwell_range[::-1]
    assert info.stride_frequency_range == pytest.approx([50 / slow, 50 / fast])
    training = loaded.info.training
    assert (training["seed"], training["iterations"], training["steps"]) == (7, 6, 192)
    assert training["command"] == "gaitshift train trot"


def test_the_policy_left_behind_is_the_mean_of_the_last_actors(whole):
    """Against the weights of the two checkpoints, layer by layer in numpy."""
    run, _ = whole
    loaded = policy.load(run.folder / "policy.onnx")
    size = loaded.observation.size
    seen = np.random.default_rng(0).normal(size=(3, size)).astype(np.float32)
    earlier, last = (
        torch.load(run.folder / "checkpoints" / f"{n:06d}.pt", weights_only=True)["ppo"][
            "actor_state_dict"
        ]
        for n in (4, 6)
    )
    with torch.no_grad():
        flow = run.learner.ppo.actor.obs_normalizer(torch.from_numpy(seen)).numpy()
    for layer in (0, 2, 4):
        weight, bias = (
            (earlier[f"mlp.{layer}.{name}"] + last[f"mlp.{layer}.{name}"]).numpy() / 2
            for name in ("weight", "bias")
        )
        flow = flow @ weight.T + bias
        if layer < 4:
            flow = np.where(flow > 0, flow, 0.01 * flow)
    np.testing.assert_allclose(loaded(seen), flow, atol=1e-5)
    assert not torch.equal(earlier["mlp.0.weight"], last["mlp.0.weight"])


def test_only_the_last_share_of_the_last_stage_is_averaged():
    first, last = Stage(name="a", iterations=60), Stage(name="b", iterations=40, averaged=0.5)
    recipe = replace(TINY, stages=(first, last))
    assert [recipe.is_averaged(n) for n in (0, 79, 80, 100)] == [False, False, True, True]
    alone = replace(recipe, stages=(first, replace(last, averaged=0.0)))
    assert not any(alone.is_averaged(n) for n in (0, 99, 100))


def test_the_config_is_read_back_into_the_same_run(whole):
    run, _ = whole
    again = Run.resume(run.folder)
    assert again.recipe == TINY
    assert again.machine == TROT
    assert (again.seed, again.command) == (7, "gaitshift train trot")
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


# Breaking off and going on ----------------------------------------------------------------------


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


def test_the_last_line_comes_back_as_it_was_written(tmp_path):
    lines = [
        {"iteration": 2, "stage": "flat", "speed": 1.0, "gait": "none", "clean": False},
        {"iteration": 4, "stage": "1", "speed": 2.5e-05, "gait": "trot", "clean": True},
        {"iteration": 6, "stage": "rough", "speed": None, "gait": "", "clean": True},
    ]
    for line in lines:
        table.append(tmp_path / "lines.csv", line)
    for iteration, line in ((3, 0), (4, 1), (5, 1), (9, 2)):
        found = last(tmp_path / "lines.csv", iteration)
        assert found == lines[line]
        assert list(map(type, found.values())) == list(map(type, lines[line].values()))
    assert last(tmp_path / "lines.csv", 1) == last(tmp_path / "none.csv", 9) == {}


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (b"\n2,", b"\ntwo,", "progress.csv, line 3 is damaged"),
        (b"\n2,flat,", b"\n2,flat,flat,", "progress.csv, line 3 is damaged"),
        (b"iteration,", b"iteratio,", "progress.csv, line 2 is damaged"),
        (b"\n2,flat,", b"\n2,fl\xff\xfe,", "progress.csv is damaged: "),
    ],
)
def test_a_damaged_progress_is_named_and_left_alone(copied, old, new, says):
    path = copied / "progress.csv"
    damaged = path.read_bytes().replace(old, new, 1)
    assert damaged != path.read_bytes()
    path.write_bytes(damaged)
    with pytest.raises(GaitshiftError) as caught:
        Run.resume(copied).train()
    assert says in str(caught.value)
    assert "\n" not in str(caught.value)
    assert path.read_bytes() == damaged


def test_a_config_of_another_network_than_the_checkpoints_is_named(copied):
    file = copied / "config.json"
    for hidden in ([32, 8], [16]):
        config = json.loads(file.read_text())
        config["recipe"]["ppo"]["hidden"] = hidden
        file.write_text(json.dumps(config))
        line = refusal(copied)
        assert "000006.pt does not fit" in line
        assert "config.json" in line


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


# Folders that are refused -----------------------------------------------------------------------


def test_an_empty_folder_is_taken(tmp_path):
    create(tmp_path)
    assert (tmp_path / "config.json").is_file()


def test_a_folder_with_something_in_it_is_refused_and_left_alone(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(GaitshiftError, match="not empty; give another --out, --overwrite"):
        create(tmp_path)
    with pytest.raises(GaitshiftError, match="not a training run and is not overwritten"):
        create(tmp_path, overwrite=True)
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.txt"]


@pytest.mark.parametrize("overwrite", [False, True])
def test_a_file_in_the_place_of_the_folder_is_refused_and_left_alone(tmp_path, overwrite):
    file = tmp_path / "run"
    file.write_text("years of work")
    with pytest.raises(GaitshiftError, match=str(file)):
        create(file, overwrite=overwrite)
    assert file.read_text() == "years of work"


def test_overwriting_an_earlier_run_leaves_nothing_of_it(tmp_path, whole):
    folder = tmp_path / "run"
    shutil.copytree(whole[0].folder, folder)
    with pytest.raises(GaitshiftError, match="--resume"):
        create(folder)
    create(folder, seed=9, overwrite=True)
    assert [file.name for file in (folder / "checkpoints").iterdir()] == ["000000.pt"]
    assert sorted(file.name for file in folder.iterdir()) == ["checkpoints", "config.json"]
    assert Run.resume(folder).iteration == 0


def refusal(folder):
    """The one line with which a folder is refused."""
    with pytest.raises(GaitshiftError) as caught:
        Run.resume(folder)
    line = str(caught.value)
    assert "\n" not in line
    assert str(folder) in line
    return line


@pytest.fixture
def copied(tmp_path, whole):
    """A folder of a run, to be damaged."""
    return shutil.copytree(whole[0].folder, tmp_path / "run")


def test_a_folder_that_is_no_run_cannot_go_on(tmp_path):
    assert "not a training run: it has no config.json" in refusal(tmp_path)
    assert "not a training run" in refusal(tmp_path / "nowhere")


def damage_whole(config):
    return config[: len(config) // 2]


def damage_key(config):
    return config.replace(b'"recipe"', b'"receipt"')


def damage_field(config):
    return config.replace(b'"robots"', b'"robotsandmore"')


def damage_bytes(config):
    return b"\xff\xfe\x00" + config


def damage_shape(config):
    return b"[1, 2, 3]"


@pytest.mark.parametrize(
    "damage", [damage_whole, damage_key, damage_field, damage_bytes, damage_shape]
)
def test_a_damaged_config_is_named(copied, damage):
    file = copied / "config.json"
    file.write_bytes(damage(file.read_bytes()))
    assert "config.json is damaged" in refusal(copied)


def test_a_config_whose_machine_breaks_the_laws_is_named(copied):
    file = copied / "config.json"
    config = json.loads(file.read_text())
    config["machine"]["transition"][0]["to"] = "nowhere"
    file.write_text(json.dumps(config))
    assert "nowhere" in refusal(copied)


def test_a_damaged_checkpoint_is_named_and_without_it_the_run_goes_on_from_the_one_before(
    copied, whole
):
    last = copied / "checkpoints" / "000006.pt"
    last.write_bytes(last.read_bytes()[:2000])
    assert "000006.pt is damaged; remove it" in refusal(copied)
    last.unlink()
    run = Run.resume(copied)
    assert run.iteration == 4
    run.train()
    assert same_bits(weights(run), weights(whole[0]))
    assert rows(copied) == rows(whole[0].folder)


def test_a_run_without_checkpoints_cannot_go_on(copied):
    shutil.rmtree(copied / "checkpoints")
    assert "no checkpoint" in refusal(copied)


# Values with a closed form ----------------------------------------------------------------------

DISCOUNT = 0.9
ORACLE = Recipe(
    env=EnvConfig(observed=("contact",)),
    ppo=PpoConfig(
        hidden=(32,),
        discount=DISCOUNT,
        epochs=4,
        mini_batches=2,
        learning_rate=5e-3,
        desired_kl=0.0,
        reward_scale=1.0,
        mirror=False,
    ),
    robots=32,
    steps=16,
    threads=1,
)


def learned_values(env, recipe, observations, *, iterations):
    """V of the observations, as the critic has it after some iterations; the actor stays as it is.

    Where every action is worth the same an actor that learns strays, and with it what is seen.
    """
    torch.set_num_threads(1)
    torch.manual_seed(0)
    learner = Learner(env, recipe)
    learner.ppo.actor.requires_grad_(False)
    for _ in range(iterations):
        learner.iterate()
    seen = torch.from_numpy(np.asarray(observations, dtype=np.float32))
    with torch.no_grad():
        return learner.ppo.critic(TensorDict({"policy": seen}, batch_size=[len(seen)])).squeeze(1)


class EveryStepIsWorthOne(GaitEnv):
    """The true environment with another reward."""

    falls = cuts = 0

    def step(self, actions):
        observation, reward, terminated, truncated, info = super().step(actions)
        self.falls += int(terminated.sum())
        self.cuts += int(truncated.sum())
        return observation, np.ones_like(reward), terminated, truncated, info


def test_a_reward_of_one_for_ever_is_worth_its_geometric_sum_though_episodes_are_cut_short():
    # 1 + γ + γ² + … = 1 / (1 - γ) = 10; five steps alone would be worth at most 4.1.
    # Only the action is shown: the critic must not tell by the observation that an episode is over.
    config = EnvConfig(observed=("last_action",), episode_steps=5)
    recipe = replace(ORACLE, env=config, robots=16)
    env = EveryStepIsWorthOne(TROT, flat(20.0, 20.0), 16, config=config, threads=1)
    seen = 0.5 * np.random.default_rng(0).normal(size=(400, 12))
    values = learned_values(env, recipe, seen, iterations=60)
    assert (env.falls, env.cuts) == (0, 16 * 60 * 16 // 5)
    assert values.mean().item() == pytest.approx(10.0, rel=0.02)


class Toss(GaitEnv):
    """Noise to look at, a reward of 1 a step, and an end by the toss of a coin."""

    chance = 0.25

    def __init__(self):
        super().__init__(TROT, flat(20.0, 20.0), 32, config=ORACLE.env, threads=1)
        self.rng = np.random.default_rng(0)

    def step(self, actions):
        ended = self.rng.random(32) < self.chance
        none = np.zeros(32, dtype=bool)
        info = {"reward_terms": {}, "bonus": none, "changed": none, "shows_stance": none}
        info |= {"forward_speed": np.zeros(32), "final_obs": self.noise(), "_final_obs": ended}
        return self.noise(), np.ones(32), ended, none, info

    def noise(self):
        return self.rng.normal(size=(32, 4)).astype(np.float32)


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_nothing_is_earned_after_a_fall(scale):
    # V = 1 + γ (1 - p) V, so V = 1 / (1 - 0.9 · 0.75) = 3.077; the scale is PPO's alone.
    recipe = replace(ORACLE, ppo=replace(ORACLE.ppo, reward_scale=scale))
    seen = np.random.default_rng(1).normal(size=(400, 4))
    values = learned_values(Toss(), recipe, seen, iterations=60)
    assert values.mean().item() == pytest.approx(scale * 3.077, rel=0.1)


class Entrance(GaitEnv):
    """Two places: an episode begins in A, whose step costs 10, and stays in B, worth 1 a step.

    In B episodes are cut by the toss of a coin; they end in B, and the next begins in A.
    """

    a, b = np.eye(4, dtype=np.float32)[:2]

    def __init__(self):
        super().__init__(TROT, flat(20.0, 20.0), 32, config=ORACLE.env, threads=1)
        self.rng = np.random.default_rng(0)
        self.in_b = np.zeros(32, dtype=bool)

    def reset(self, **_):
        self.in_b[:] = False
        return self.look(), {}

    def look(self):
        return np.where(self.in_b[:, None], self.b, self.a)

    def step(self, actions):
        reward = np.where(self.in_b, 1.0, -10.0)
        cut = self.in_b & (self.rng.random(32) < 0.3)
        self.in_b = np.ones(32, dtype=bool)
        final = self.look()
        self.in_b = ~cut
        none = np.zeros(32, dtype=bool)
        info = {"reward_terms": {}, "bonus": none, "changed": none, "shows_stance": none}
        info |= {"forward_speed": np.zeros(32), "final_obs": final, "_final_obs": cut}
        return self.look(), reward, none, cut, info


def test_a_cut_episode_is_worth_what_its_true_last_observation_is_worth():
    # V(B) = 1 / (1 - γ) = 10 and V(A) = -10 + γ V(B) = -1, as if nothing were cut. Valued by the
    # first observation of the next episode, B would lose: V(B) = 1 + γ (0.7 V(B) + 0.3 V(A)).
    recipe = replace(ORACLE, ppo=replace(ORACLE.ppo, normalize_observations=False))
    a, b = learned_values(Entrance(), recipe, [Entrance.a, Entrance.b], iterations=100)
    assert b.item() == pytest.approx(10.0, rel=0.1)
    assert a.item() == pytest.approx(-1.0, abs=1.0)


# The mirror -------------------------------------------------------------------------------------

SEEN = ("machine_state", "contact", "base_linear_velocity_b", "yaw_rate_command", "joint_position")


def learner_of(machine, *, mirror):
    config = EnvConfig(observed=SEEN)
    env = GaitEnv(machine, flat(20.0, 20.0), 2, config=config, threads=1)
    ppo = PpoConfig(hidden=(8,), mirror=mirror)
    return Learner(env, replace(TINY, env=config, ppo=ppo, robots=2, steps=4))


@pytest.mark.parametrize(("gait", "states"), [("trot", [0.0, 1.0]), ("bound", [1.0, 0.0])])
def test_each_batch_is_followed_by_its_mirror_image(gait, states):
    symmetry = learner_of(gaits.load(gait), mirror=True).ppo.symmetry
    assert symmetry.use_data_augmentation
    # In the first state, on FL and BL, drifting left and turning right, joints 1 … 12 tenths.
    joints = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2]
    mirrored_joints = [-0.4, 0.5, 0.6, -0.1, 0.2, 0.3, -1.0, 1.1, 1.2, -0.7, 0.8, 0.9]
    seen = torch.tensor([[1.0, 0, 1, 0, 1, 0, 1.2, 0.3, -0.1, -0.4, *joints], [0.0] * 22])
    image = torch.tensor([*states, 0, 1, 0, 1, 1.2, -0.3, -0.1, 0.4, *mirrored_joints])
    obs, actions = symmetry.data_augmentation_func(
        env=None,
        obs=TensorDict({"policy": seen}, batch_size=[2]),
        actions=torch.tensor([joints, [0.0] * 12]),
    )
    assert obs.batch_size == torch.Size([4])
    torch.testing.assert_close(obs["policy"][:2], seen)
    torch.testing.assert_close(obs["policy"][2], image)
    torch.testing.assert_close(actions[0], torch.tensor(joints))
    torch.testing.assert_close(actions[2], torch.tensor(mirrored_joints))
    assert not obs["policy"][3].any()
    assert actions.shape == (4, 12)


def test_an_observation_and_its_mirror_image_are_drawn_to_the_same_return():
    learner = learner_of(TROT, mirror=True)
    learner.iterate()
    augmented = []
    augment = learner.ppo.symmetry.augment_batch

    def kept(batch, size):
        augment(batch, size)
        augmented.append((batch.returns.clone(), batch.observations["policy"].clone(), size))

    learner.ppo.symmetry.augment_batch = kept
    learner.iterate()
    assert augmented
    for returns, observations, size in augmented:
        assert len(returns) == len(observations) == 2 * size
        torch.testing.assert_close(returns[size:], returns[:size])


def test_a_gait_with_a_leading_side_and_a_recipe_without_mirror_learn_from_what_was_seen_alone():
    assert learner_of(TROT, mirror=False).ppo.symmetry is None
    leading = {
        "name": "three-beat",
        "title": "Three beats",
        "description": "Always the left front foot first.",
        "dwell": 5,
        "ideal_phase": {"FL": 0.0, "FR": 0.3, "BL": 0.6, "BR": 0.6},
        "state": [
            {"name": "FL", "stance": ["FL"]},
            {"name": "FR", "stance": ["FR"]},
            {"name": "hind", "stance": ["BL", "BR"]},
        ],
        "transition": [
            {"from": "FL", "to": "FR", "down": ["FR"], "up": ["FL"]},
            {"from": "FR", "to": "hind", "down": ["BL", "BR"], "up": ["FR"]},
            {"from": "hind", "to": "FL", "down": ["FL"], "up": ["BL", "BR"]},
        ],
    }
    machine = RewardMachine.from_dict(leading)
    assert machine.mirrored_states() is None
    assert learner_of(machine, mirror=True).ppo.symmetry is None


# A true training, if a short one ----------------------------------------------------------------


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
