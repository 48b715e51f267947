"""The ids by which Gymnasium knows the gaits, and its own check of them."""

import subprocess
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

from gaitshift.gait import gaits
from gaitshift.sim.env import EnvConfig, GaitEnv


@pytest.mark.parametrize("gait", gaits.names())
# Advice that Gymnasium does not demand: observations here are measurements without a largest value.
@pytest.mark.filterwarnings("ignore:.*A Box observation space (min|max)imum value is")
@pytest.mark.filterwarnings("ignore:.*we recommend using a symmetric and normalized space")
def test_gymnasiums_checker_finds_nothing_to_complain_about(gait):
    check_env(gym.make(f"gaitshift/{gait}-v0").unwrapped)


@pytest.mark.parametrize("gait", gaits.names())
def test_make_vec_knows_every_shipped_gait(gait):
    env = gym.make_vec(f"gaitshift/{gait}-v0", num_envs=3)
    assert isinstance(env, GaitEnv)
    assert env.machine.name == gait
    assert env.num_envs == 3
    assert env.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP


@pytest.mark.parametrize("make", ["make", "make_vec"])
def test_an_id_with_our_module_needs_no_import_of_ours(make):
    program = f"""
import gymnasium
env = gymnasium.{make}("gaitshift.sim.env:gaitshift/trot-v0")
env.reset(seed=0)
env.step(env.action_space.sample())
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr


def test_registered_environments_take_terrain_and_config():
    config = EnvConfig(observed=("contact",), episode_steps=7)
    keywords = {"terrain": "perlin:0.1", "terrain_seed": 3, "config": config}
    many = gym.make_vec("gaitshift/trot-v0", num_envs=2, **keywords)
    one = gym.make("gaitshift/trot-v0", **keywords)
    assert many.observation_space.shape == (2, 4)
    assert one.observation_space.shape == (4,)
    assert many.world.terrains[0].height.max() > 0
    ground = one.unwrapped.vector.world.terrains[0]
    np.testing.assert_array_equal(many.world.terrains[0].height, ground.height)
