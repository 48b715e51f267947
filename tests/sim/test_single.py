"""One robot as a plain environment, against a vector of one."""

import gymnasium as gym
import numpy as np

from hopping import FOLD, arbitrary_actions


def test_one_robot_as_a_plain_environment_goes_the_way_of_a_vector_of_one():
    one = gym.make("gaitshift/trot-v0").unwrapped
    many = gym.make_vec("gaitshift/trot-v0", num_envs=1)
    np.testing.assert_array_equal(one.reset(seed=4)[0], many.reset(seed=4)[0][0])
    for action in arbitrary_actions(1, 30, 1):
        seen, reward, *ended, info = one.step(action[0])
        all_seen, rewards, terminated, truncated, infos = many.step(action)
        np.testing.assert_array_equal(seen, all_seen[0])
        assert (reward, *ended) == (rewards[0], terminated[0], truncated[0])
        assert info["changed"] == infos["changed"][0]


def test_one_robot_as_a_plain_environment_is_shown_its_fall():
    env = gym.make("gaitshift/trot-v0").unwrapped
    env.reset(seed=0)
    for _ in range(200):
        seen, _, terminated, _, _ = env.step(FOLD[0])
        if terminated:
            break
    assert terminated
    height = seen[env.vector.walker.observation.slices["base_height"]].item()
    assert height < 0.3, "of a robot on its belly, not of one that has just begun anew"
