"""Running moments of what is seen, and those of a uniform draw where the range is known."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from gaitshift.learn.learner import Learner, as_tensors
from gaitshift.learn.normalization import RangeNormalization
from gaitshift.learn.presets import PRESETS
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import flat
from training import TROT


def test_a_uniform_draw_from_a_known_range_has_mean_0_and_deviation_1_from_the_start_on():
    normal = RangeNormalization(3, {2: (0.4, 1.6), 0: (3.0, -1.0)})
    normal.eps = 0.0
    rng = np.random.default_rng(0)
    draws = rng.uniform([-1.0, 0.0, 0.4], [3.0, 1.0, 1.6], (20_000, 3))
    narrow = draws.copy()
    narrow[:, [0, 2]] = [0.9, 1.2]
    for batch in (None, narrow, draws):
        if batch is not None:
            normal.update(torch.from_numpy(batch).float())
        seen = normal(torch.from_numpy(draws).float()).numpy()
        np.testing.assert_allclose(seen[:, [0, 2]].mean(axis=0), 0.0, atol=0.02)
        np.testing.assert_allclose(seen[:, [0, 2]].std(axis=0), 1.0, atol=0.02)
    both = np.concatenate([narrow, draws])[:, 1]
    assert normal.mean[1] == pytest.approx(both.mean(), abs=1e-4)
    assert normal.std[1] == pytest.approx(both.std(), abs=1e-4)


def test_an_entry_without_a_range_is_0_behind_the_normalisation():
    normal = RangeNormalization(2, {1: (0.7, 0.7)})
    seen = torch.tensor([[5.0, 0.7], [9.0, 0.7]])
    normal.update(seen)
    assert normal(seen)[:, 1].tolist() == [0.0, 0.0]


def learner(normalize_commands):
    preset = PRESETS["deployable"]()
    ppo = replace(preset.ppo, normalize_commands=normalize_commands)
    env = replace(preset.env, speed_margin=0.0)
    recipe = replace(preset, env=env, ppo=ppo, robots=4, steps=8, threads=1)
    torch.manual_seed(0)
    return Learner(GaitEnv(TROT, flat(20.0, 20.0), 4, config=recipe.env, threads=1), recipe)


def asked(made, speeds):
    """One observation as often as there are speeds, with these as commands."""
    seen = np.repeat(made.env.reset(seed=0)[0][:1], len(speeds), axis=0)
    seen[:, made.env.walker.observation.slices["forward_speed_command"]] = np.array(speeds)[:, None]
    return as_tensors(seen)


@pytest.mark.parametrize(("normalize_commands", "shrinks"), [("range", False), ("seen", True)])
def test_an_answer_to_a_speed_does_not_shrink_while_the_drawn_speeds_spread(
    normalize_commands, shrinks
):
    """The weights stay the same; only what is seen changes, as by a curriculum."""
    made, sizes = learner(normalize_commands), []
    actor = made.ppo.actor
    for layer in actor.mlp:  # a linear policy, so that an answer is proportional to its input
        if isinstance(layer, torch.nn.LeakyReLU):
            layer.negative_slope = 1.0
    actor.train()
    for spread in (0.1, 0.3, 0.6):
        actor.update_normalization(asked(made, np.linspace(1.0 - spread, 1.0 + spread, 256)))
        with torch.no_grad():
            slow, fast = actor(asked(made, [0.4, 1.6]))
        sizes.append(float((fast - slow).norm()))
    if shrinks:
        assert sizes[2] < 0.5 * sizes[0]
    else:
        np.testing.assert_allclose(sizes, sizes[0], rtol=1e-3)


def test_the_ranges_are_those_that_commands_are_drawn_from():
    env = learner("range").env
    ends = env.observed_commands()
    seen = np.concatenate([env.reset(seed=seed)[0] for seed in range(60)])
    places = env.walker.observation.slices
    for name in ("forward_speed_command", "stride_command", "body_height_command"):
        place = places[name].start
        low, high = sorted(ends[place])
        assert (seen[:, place].min(), seen[:, place].max()) == pytest.approx(
            (low, high), abs=0.08 * (high - low)
        )
    turn = places["yaw_rate_command"].start
    assert ends[turn] == (-0.5, 0.5)
    assert ends[places["lateral_speed_command"].start] == (0.0, 0.0), "of a trot"
