"""The walker that training and running share: the same actions give the same states and views."""

from dataclasses import fields

import numpy as np
import pytest

from driving import FEET, STANCE, exported
from gaitshift.control import Driver
from gaitshift.control.observation import GaitState
from gaitshift.gait import RewardMachine, gaits
from gaitshift.robot.command import Command
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat

SHUFFLE = RewardMachine.from_dict(
    {
        "name": "shuffle",
        "title": "Shuffle",
        "description": "Changes its state whenever the front left foot lifts or lands.",
        "dwell": 2,
        "ideal_phase": {"FL": 0.0, "FR": 0.5, "BL": 0.5, "BR": 0.0},
        "state": [
            {"name": "all", "stance": list(FEET)},
            {"name": "three", "stance": ["FR", "BL", "BR"]},
        ],
        "transition": [
            {"from": "all", "to": "three", "down": [], "up": ["FL"]},
            {"from": "three", "to": "all", "down": ["FL"], "up": []},
        ],
    }
)


def test_training_and_running_walk_alike_bit_for_bit(tmp_path):
    """The same actions on the same world: states, observations and joint targets."""
    shuffle = exported(tmp_path, SHUFFLE, seed=5)
    config = EnvConfig(heading_range=0.0, forward_speed=0.9, command_share=0.0)
    env = GaitEnv(SHUFFLE, flat(20.0, 20.0), 3, config=config, threads=1)
    driver = Driver({"shuffle": shuffle}, 3, start="shuffle")
    observation, _ = env.reset(seed=0)
    command = Command.straight(3, 0.9, stride_frequency=25.0)  # a cycle of 2 · 2 steps
    alone = env.walker.begin(env.world.sensed)
    changes = 0
    for _ in range(80):
        action = shuffle(observation)
        target = driver.act(env.world.sensed, command)
        np.testing.assert_array_equal(target, env.walker.target(action)[1])
        observation, _, terminated, _, info = env.step(action)
        assert not terminated.any()
        sensed = env.world.sensed
        driver.see(sensed, command)
        alone, _ = env.walker.step(alone, env.walker.target(action)[0], sensed, command)
        for field in fields(GaitState):
            for state in (driver.state, alone):
                ours = getattr(env._state, field.name)
                np.testing.assert_array_equal(getattr(state, field.name), ours)
        seen = shuffle.walker.observe(driver.state, sensed, command)
        np.testing.assert_array_equal(seen, observation)
        changes += int(info["changed"].sum())
    assert changes > 5


def test_an_action_means_the_stance_plus_so_much_and_no_more_than_its_limit():
    env = GaitEnv(gaits.load("trot"), flat(9.0, 9.0), 2, threads=1)
    action = np.array([np.linspace(-10.0, 10.0, 12), np.linspace(-30.0, 30.0, 12)])
    clipped, target = env.walker.target(action)
    np.testing.assert_array_equal(clipped[0], action[0])
    np.testing.assert_allclose(target[0] - STANCE, ANYMAL_B.action_scale * action[0], atol=1e-12)
    assert (np.abs(clipped[1]) <= 10.0).all()
    np.testing.assert_allclose(target[1, [0, -1]] - STANCE[[0, -1]], [-3.0, 3.0], atol=1e-12)
    assert ANYMAL_B.action_scale == pytest.approx(0.3)


def test_a_step_writes_to_nothing_it_is_given():
    env = GaitEnv(gaits.load("trot"), flat(9.0, 9.0), 2, threads=1)
    walker, sensed = env.walker, env.world.sensed
    state, command = walker.begin(sensed), Command.straight(2)
    before = {f.name: getattr(state, f.name).copy() for f in fields(GaitState)}
    for array in (*(getattr(state, name) for name in before), sensed.contact, sensed.foot_height):
        array.flags.writeable = False
    walker.step(state, np.ones((2, 12)), sensed, command)
    walker.observe(state, sensed, command)
    for name, array in before.items():
        np.testing.assert_array_equal(getattr(state, name), array)
