"""Recipes: the paper's figures, schedules by hand, and what cannot be run."""

from dataclasses import replace
from inspect import signature

import numpy as np
import pytest
import stable_baselines3
from stable_baselines3.common.policies import ActorCriticPolicy

from gaitshift.errors import GaitshiftError
from gaitshift.lab.benchmark.baseline import GaitVecEnv
from gaitshift.learn.learner import Learner
from gaitshift.learn.presets import PRESETS
from gaitshift.learn.recipe import Stage
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.reward import RewardConfig
from gaitshift.sim.terrain import flat
from training import ABC, TINY, TROT


def test_the_paper_preset_has_the_papers_figures():
    recipe = PRESETS["paper"]()
    assert (recipe.robots, recipe.steps, recipe.iterations) == (30, 100, 500)
    assert recipe.ppo.hidden == (256, 128, 32)
    assert [stage.amplitude for stage in recipe.stages] == [0.0]
    assert recipe.env.reward == RewardConfig.paper()
    assert recipe.env.forward_speed == 1.2
    assert recipe.env.gains == "paper"
    assert recipe.curriculum(0).strictness == recipe.curriculum(499).strictness == 0.0
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
        ({"trace_factor": 0.0}, "0.001 to 1000"),
        ({"horizon_factor": -1.0}, "0.001 to 1000"),
        ({"iterations": -1}, "0 to 1000000"),
        ({"fields": ("flat", "moon")}, "flat, perlin, slope, stair, step"),
        ({"fields": ()}, "flat, perlin, slope, stair, step"),
    ],
)
def test_stages_that_cannot_be_run_are_refused(faulty, right):
    with pytest.raises(GaitshiftError, match=f"{next(iter(faulty))}.*{right}"):
        replace(Stage(name="rough", iterations=5), **faulty)


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
        assert recipe.curriculum(iteration).strictness == share * grown


def test_commands_spread_in_a_straight_line_and_go_by_no_other_schedule():
    recipe = replace(TINY, command_from=8, command_until=16, strict_from=100, strict_until=101)
    table = {0: 0.0, 8: 0.0, 9: 0.125, 12: 0.5, 16: 1.0, 17: 1.0, 1000: 1.0}
    assert {i: recipe.curriculum(i).command_scale for i in table} == table


def test_each_stage_asks_for_its_own_swings_stances_and_mixed_starts():
    low, high = Stage(name="low", iterations=3), Stage(name="high", iterations=2)
    high = replace(high, swing_factor=1.4, stance_factor=0.7, mixed_starts=0.25)
    recipe = replace(TINY, stages=(low, high))
    asked = [recipe.curriculum(i) for i in range(7)]
    assert [now.swing_factor for now in asked] == [1.0] * 3 + [1.4] * 4
    assert [now.stance_factor for now in asked] == [1.0] * 3 + [0.7] * 4
    assert [now.mixed_starts for now in asked] == [0.0] * 3 + [0.25] * 4


def test_a_policy_settles_in_the_last_part_of_the_stage_it_ends_with():
    first, last = Stage(name="a", iterations=50, settle=1.0), Stage(name="b", iterations=50)
    recipe = replace(TINY, stages=(first, replace(last, settle=0.8)))
    table = {0: 1.0, 60: 1.0, 70: 0.775, 80: 0.55, 100: 0.1}
    assert {i: pytest.approx(recipe.settling(i)) for i in table} == table
    assert recipe.with_iterations(50).settling(25) == pytest.approx(0.55), "it ends with the first"
    assert replace(recipe, stages=(first, replace(last, settle=0.0))).settling(100) == 1.0


def test_each_iteration_has_its_stage_and_its_number_within_it():
    table = {0: ("a", 0), 2: ("a", 2), 3: ("b", 0), 6: ("b", 3), 7: ("c", 0), 11: ("c", 4)}
    told = {i: (stage.name, within) for i in table for stage, within in [ABC.stage_at(i)]}
    assert told == table
    stage, within = ABC.stage_at(15)
    assert (stage.name, within) == ("c", 8), "beyond the end the last stage goes on"


def test_only_the_last_share_of_the_last_stage_is_averaged():
    first, last = Stage(name="a", iterations=60), Stage(name="b", iterations=40, averaged=0.5)
    recipe = replace(TINY, stages=(first, last))
    assert [recipe.is_averaged(n) for n in (0, 79, 80, 100)] == [False, False, True, True]
    alone = replace(recipe, stages=(first, replace(last, averaged=0.0)))
    assert not any(alone.is_averaged(n) for n in (0, 99, 100))
