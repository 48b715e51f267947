"""An environment whose robots have sensors with errors: policies see them, rewards do not."""

import numpy as np
import pytest

from gaitshift.gait import gaits
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.sensor_config import ANYMAL, PERFECT, SensorConfig
from gaitshift.sim.terrain import flat

TROT, GROUND = gaits.load("trot"), flat(20.0, 20.0)

NOISY = SensorConfig(
    encoder_noise=0.01,
    joint_velocity_noise=0.5,
    gyro_noise=0.1,
    accelerometer_noise=0.3,
    measures_velocity=False,
)
"""Errors in all that is measured but contacts, and nothing late."""


def stepped(sensors, steps=60, seed=5, **config):
    """Observations, rewards and the environment after arbitrary actions."""
    env = GaitEnv(TROT, GROUND, 4, config=EnvConfig(sensors=sensors, **config))
    env.reset(seed=seed)
    rng = np.random.default_rng(1)
    seen = [env.step(rng.uniform(-1, 1, (4, 12))) for _ in range(steps)]
    return np.stack([one[0] for one in seen]), np.stack([one[1] for one in seen]), env


def test_rewards_are_those_of_the_truth_whatever_is_sensed():
    """Without a wanted heading, whose command depends on the measured one."""
    noisy, reward, _ = stepped(NOISY, heading_range=0.0)
    clean, expected, _ = stepped(PERFECT, heading_range=0.0)
    np.testing.assert_allclose(reward, expected, rtol=0, atol=1e-9)
    assert np.abs(noisy - clean).max() > 0.1


def test_the_observed_velocity_is_an_estimate_near_the_truth():
    observations, _, env = stepped(NOISY, steps=100)
    at = env.walker.observation.slices["base_linear_velocity_b"]
    error = observations[-1, :, at] - env.world.truth.velocity_b
    assert 0.0 < np.abs(error).max() < 0.5
    assert env.world.sensed.velocity_b is None


def test_robots_that_restart_have_no_velocity_of_their_last_episode():
    env = GaitEnv(TROT, GROUND, 4, config=EnvConfig(sensors=NOISY, episode_steps=30))
    env.reset(seed=2)
    at = env.walker.observation.slices["base_linear_velocity_b"]
    for _ in range(30):
        observation, _, ended, cut, info = env.step(np.full((4, 12), 0.5))
    assert (ended | cut).all()
    assert np.abs(info["final_obs"][:, at]).max() > 0.01
    np.testing.assert_array_equal(observation[:, at], 0.0)


@pytest.mark.parametrize("sensors", [NOISY, ANYMAL], ids=lambda config: config.name)
def test_the_same_seed_gives_the_same_bits_also_in_a_used_environment(sensors):
    first, _, env = stepped(sensors)
    env.reset(seed=5)
    rng = np.random.default_rng(1)
    again = np.stack([env.step(rng.uniform(-1, 1, (4, 12)))[0] for _ in range(60)])
    np.testing.assert_array_equal(again, first)
    other, *_ = stepped(sensors, seed=6)
    assert (other != first).any()


def test_feet_that_are_down_and_not_felt_move_a_machine_and_earn_nothing():
    """A walk that stands still: each edge wants one foot up, and none of them ever is."""
    blind = SensorConfig(contact_missed=0.3, contact_error_time=0.05)
    walk = GaitEnv(gaits.load("walk"), GROUND, 4, config=EnvConfig(sensors=blind))
    walk.reset(seed=1)
    changed, earned = 0, 0.0
    for step in range(300):
        *_, info = walk.step(np.zeros((4, 12)))
        if step > 20:  # they settle from a small fall
            assert walk.world.truth.foot_contact.all()
            changed, earned = changed + info["changed"].sum(), earned + info["bonus"].sum()
    assert changed > 10
    assert earned == 0.0
