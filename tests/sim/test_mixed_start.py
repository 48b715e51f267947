"""Episodes that begin in the midst of a stride: each leg is of a robot on its way."""

import numpy as np
import pytest

from gaitshift.gait import gaits
from gaitshift.sim.env import Curriculum, EnvConfig, GaitEnv
from hopping import FLAT, arbitrary_actions, keep_steps

TROT_STANCES = ((True, False, False, True), (False, True, True, False))
"""FL FR BL BR, of the trot's states in their order."""


def test_a_mixed_start_has_each_leg_of_a_robot_that_is_on_its_way(monkeypatch):
    env = GaitEnv(gaits.load("trot"), FLAT, 6, config=EnvConfig(episode_steps=40), threads=1)
    env.curriculum = Curriculum(mixed_starts=1.0)
    env.reset(seed=1)
    np.testing.assert_array_equal(env.world.sensed.joint_velocity, 0.0)  # all begin: none to mix
    env._age[:2] = 20
    actions = arbitrary_actions(2, 20, 6, size=0.2)
    steps = keep_steps(env, monkeypatch)
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
    assert not terminated.any()
    assert np.flatnonzero(truncated).tolist() == [0, 1]
    (before, truth), after = steps[-1], env.world.sensed
    for robot in (0, 1):
        down = []
        for leg in range(4):
            joints = slice(3 * leg, 3 * leg + 3)
            taken = after.joint_position[robot, joints]
            donors = [i for i in range(2, 6) if (before.joint_position[i, joints] == taken).all()]
            assert len(donors) == 1
            donor = donors[0]
            down.append(before.contact[donor, leg])
            np.testing.assert_array_equal(
                after.joint_velocity[robot, joints], before.joint_velocity[donor, joints]
            )
            np.testing.assert_array_equal(
                env._state.last_action[robot, joints], np.clip(actions[-1, donor, joints], -8, 8)
            )
        agree = [sum(d == s for d, s in zip(down, stance, strict=True)) for stance in TROT_STANCES]
        assert agree[env._state.machine_state[robot]] == max(agree)
        speeds = np.linalg.norm(truth.velocity_b[2:], axis=1)
        speed = np.linalg.norm(env.world.truth.velocity_b[robot])
        assert np.isclose(speed, speeds).sum() == 1
    np.testing.assert_allclose(env.world.truth.clearance[:2].min(axis=1), 0.0, atol=1e-12)
    tilts = before.gravity_b[2:, 2]
    assert all(np.isclose(tilt, tilts, atol=1e-9).any() for tilt in after.gravity_b[:2, 2])
    for robot in (2, 3, 4, 5):
        np.testing.assert_array_equal(after.joint_position[robot], before.joint_position[robot])


def test_the_share_of_mixed_starts_is_what_was_asked_for(monkeypatch):
    env = GaitEnv(gaits.load("trot"), FLAT, 64, config=EnvConfig(episode_steps=10), threads=1)
    env.curriculum = Curriculum(mixed_starts=0.3)
    env.reset(seed=4)
    env.spread_ages()
    counts, place = {True: 0, False: 0}, env.world.place

    def count(ids, **where):
        counts["attitude" in where] += len(ids)
        place(ids, **where)

    monkeypatch.setattr(env.world, "place", count)
    for _ in range(100):
        env.step(np.zeros((64, 12)))
    assert counts[False] == 64 * 10, "every start begins on its feet"
    assert counts[True] / counts[False] == pytest.approx(0.3, abs=4 * np.sqrt(0.21 / 640))
