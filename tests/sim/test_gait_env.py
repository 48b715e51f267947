"""The product S × U: its spaces, one step told twice, and what is returned."""

import mujoco
import numpy as np
import pytest
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from gaitshift.errors import GaitshiftError
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.reward import RewardConfig
from hopping import (
    DWELL,
    EDGES,
    FLAT,
    HOP,
    STANCE,
    SWING_HEIGHT,
    arbitrary_actions,
    hop,
    keep_steps,
    ranged,
    run,
)


def test_observations_and_actions_lie_in_their_spaces():
    env = hop(3)
    observation, _ = env.reset(seed=0)
    assert env.observation_space.contains(observation)
    assert env.single_observation_space.contains(observation[0])
    assert env.action_space.shape == (3, 12)
    env.action_space.seed(0)
    for _ in range(5):
        observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
        assert env.observation_space.contains(observation)
        assert reward.shape == terminated.shape == truncated.shape == (3,)
        assert np.isfinite(reward).all()
        assert terminated.dtype == truncated.dtype == bool


def test_gymnasiums_own_episode_counter_counts_the_same_episodes():
    env = RecordEpisodeStatistics(hop(2, episode_steps=6))
    env.reset(seed=0)
    lengths, rewards, total = [], [], np.zeros(2)
    for _ in range(18):
        _, reward, _, truncated, info = env.step(np.zeros((2, 12)))
        total += reward
        if truncated.any():
            assert truncated.all()
            lengths.append(info["episode"]["l"].tolist())
            rewards.append((info["episode"]["r"], total))
            total = np.zeros(2)
    assert lengths == [[6, 6]] * 3
    for counted, summed in rewards:
        np.testing.assert_allclose(counted, summed, rtol=1e-5)


def test_machines_in_the_environment_step_as_a_loop_over_robots_and_feet_does(monkeypatch):
    reward = RewardConfig(stance_punctuality=1.0)
    env = hop(3, episode_steps=70, heading_range=0.0, reward=reward)
    env.reset(seed=1)
    steps = keep_steps(env, monkeypatch)
    states, deltas, changes, falls = [0] * 3, [0] * 3, 0, 0
    swings = [[np.inf] * 4 for _ in range(3)]
    one_hot, delta_slice = (
        env.walker.observation.slices["machine_state"],
        env.walker.observation.slices["steps_in_state"],
    )

    def check(observation, robot):
        shown = observation[robot, one_hot].tolist()
        assert shown == [float(u == states[robot]) for u in range(2)]
        delta = observation[robot, delta_slice].item()
        assert delta == pytest.approx(min(deltas[robot] / 20, 5))

    for action in arbitrary_actions(7, 300, 3, size=1.5):
        observation, reward, terminated, truncated, info = env.step(action)
        sensed, truth = steps[-1]
        for robot in range(3):
            contact = sensed.contact[robot].tolist()
            clearance = truth.clearance[robot].tolist()
            swing = swings[robot] = [
                max(s, c) for s, c in zip(swings[robot], clearance, strict=True)
            ]
            down, up, target, factor = EDGES[states[robot]]
            taken = (
                deltas[robot] + 1 >= DWELL
                and all(contact[foot] for foot in down)
                and all(not contact[foot] for foot in up)
            )
            share = min(min(max(swing[foot] / SWING_HEIGHT, 0.0), 1.0) for foot in down)
            late = max(deltas[robot] + 1 - DWELL - 2, 0) / (0.5 * DWELL)
            on_time = max(1.0 - late, 0.0)
            if taken:  # the foot of the state left begins its swing
                swing[states[robot]] = clearance[states[robot]]
            states[robot] = target if taken else states[robot]
            deltas[robot] = 0 if taken else deltas[robot] + 1
            changes += taken
            assert info["changed"][robot] == taken
            stance = [states[robot] == 0, states[robot] == 1, True, True]
            assert info["shows_stance"][robot] == (contact == stance)
            agreeing = sum(foot == due for foot, due in zip(contact, stance, strict=True))
            weight = env.config.reward.stance_feet
            late = max(deltas[robot] + 1 - DWELL - 2, 0) / (0.5 * DWELL)
            due = weight * max(1.0 - late, 0.0) * agreeing / 4
            assert info["reward_terms"]["stance_feet"][robot] == pytest.approx(due)
            terms = sum(float(term[robot]) for term in info["reward_terms"].values())
            bonus = env.config.reward.bonus * factor * share * on_time if taken else 0.0
            assert reward[robot] == pytest.approx(terms + bonus, abs=1e-9)
            if terminated[robot] or truncated[robot]:
                falls += bool(terminated[robot])
                check(info["final_obs"], robot)
                states[robot] = deltas[robot] = 0
                swings[robot] = [np.inf] * 4
            check(observation, robot)
    assert changes > 10
    assert falls > 0


def test_no_quantity_of_the_observation_is_a_step_late(monkeypatch):
    env = hop(3, command_interval=1000)
    slices = env.walker.observation.slices
    env.reset(seed=2)
    qpos, _ = env.world.state()
    heading = 2 * np.arctan2(qpos[:, 6], qpos[:, 3])
    steps = keep_steps(env, monkeypatch)
    for action in arbitrary_actions(3, 25, 3, size=0.4):
        observation, *_ = env.step(action)
        qpos, qvel = env.world.state()
        for robot in range(3):
            seen = {name: observation[robot, part] for name, part in slices.items()}
            down, velocity = np.zeros(3), np.zeros(3)
            back = np.zeros(4)
            mujoco.mju_negQuat(back, qpos[robot, 3:7])
            mujoco.mju_rotVecQuat(down, np.array([0.0, 0.0, -1.0]), back)
            mujoco.mju_rotVecQuat(velocity, qvel[robot, :3], back)
            forward = np.zeros(3)
            mujoco.mju_rotVecQuat(forward, np.array([1.0, 0.0, 0.0]), qpos[robot, 3:7])
            error = np.arctan2(forward[1], forward[0]) - heading[robot]
            error = (error + np.pi) % (2 * np.pi) - np.pi
            loop = env.config.heading_loop
            limit = loop.yaw_rate_limit
            now = {
                "joint_position": qpos[robot, 7:] - STANCE,
                "joint_velocity": qvel[robot, 6:] / 10,
                "gravity_b": down,
                "base_linear_velocity_b": velocity,
                "base_angular_velocity_b": qvel[robot, 3:6],
                "contact": steps[-1][0].contact[robot],
                "yaw_rate_command": [np.clip(-loop.heading_gain * error, -limit, limit)],
                "last_action": action[robot],
            }
            for name, value in now.items():
                np.testing.assert_allclose(seen[name], value, rtol=1e-5, atol=1e-5, err_msg=name)
    changed = np.abs(observation - env.step(action)[0]).max(axis=0)
    moving = np.concatenate([changed[slices[name]] for name in now if name != "last_action"])
    assert (moving > 1e-4).mean() > 0.8, "a late quantity would show"


def test_the_heights_shown_are_those_of_each_foots_last_touch_in_this_episode(monkeypatch):
    env = hop(3, episode_steps=40)
    part = env.walker.observation.slices["touch_height"]
    env.reset(seed=1)
    steps = keep_steps(env, monkeypatch)

    def heights(truth, robot):
        return truth.foot_position_w[robot, :, 2] - truth.base_position_w[robot, 2]

    kept = [heights(env.world.truth, robot) for robot in range(3)]
    ends = 0
    for action in arbitrary_actions(7, 120, 3, size=1.5):
        observation, _, terminated, truncated, info = env.step(action)
        for robot in range(3):
            for foot in np.flatnonzero(steps[-1][0].contact[robot]):
                kept[robot][foot] = heights(steps[-1][1], robot)[foot]
            shown = observation[robot, part]
            if terminated[robot] or truncated[robot]:
                ends += 1
                shown = info["final_obs"][robot, part]
            expected = np.clip(10 * (kept[robot] - kept[robot].mean()), -4, 4)
            np.testing.assert_allclose(shown, expected, atol=1e-5)
            if terminated[robot] or truncated[robot]:
                kept[robot] = heights(env.world.truth, robot)
    assert ends > 4


def test_the_action_shown_and_paid_for_is_the_clipped_one():
    env = hop(1)
    env.reset(seed=0)
    limit = float(env.single_action_space.high[0])
    action = np.zeros((1, 12))
    action[0, 4] = limit + 1000.0
    observation, _, _, _, info = env.step(action)
    shown = observation[0, env.walker.observation.slices["last_action"]]
    np.testing.assert_array_equal(shown, limit * np.eye(12)[4])
    paid = info["reward_terms"]["action_rate"].item()
    assert paid == pytest.approx(env.config.reward.action_rate * limit**2)


def test_an_action_that_is_no_number_is_refused():
    env = hop(2)
    env.reset(seed=0)
    action = np.zeros((2, 12))
    action[1, 5] = np.nan
    with pytest.raises(GaitshiftError, match="FR_KFE of robot 1"):
        env.step(action)


def test_what_was_returned_is_never_written_to_again():
    env = hop(3, episode_steps=4)
    kept = [(env.reset(seed=0)[0],)]
    copies = [(kept[0][0].copy(),)]
    for action in arbitrary_actions(0, 12, 3):
        observation, reward, terminated, truncated, info = env.step(action)
        terms = (*info["reward_terms"].values(), info["changed"], info.get("final_obs", reward))
        kept.append((observation, reward, terminated, truncated, *terms))
        copies.append(tuple(part.copy() for part in kept[-1]))
    for step, copy in zip(kept, copies, strict=True):
        for part, twin in zip(step, copy, strict=True):
            np.testing.assert_array_equal(part, twin)
    observations = [step[0] for step in kept]
    for index, observation in enumerate(observations):
        assert not any(np.shares_memory(observation, other) for other in observations[:index])


def test_writing_into_what_was_returned_changes_nothing_to_come():
    actions = arbitrary_actions(0, 12, 2)
    untouched = run(hop(2, episode_steps=5), actions)
    env = hop(2, episode_steps=5)
    env.reset(seed=5)[0][:] = 9.0
    for action, expected in zip(actions, untouched[1:], strict=True):
        mine = action.copy()
        observation, reward, *ended, _ = env.step(mine)
        np.testing.assert_array_equal(observation, expected[0])
        np.testing.assert_array_equal(reward, expected[1])
        observation[:], reward[:], mine[:] = 9.0, 9.0, 9.0
        for flags in ended:
            flags[:] = True


def test_every_entry_of_the_observation_lives():
    env = ranged(6, command_interval=20)
    env.reset(seed=0)
    actions = arbitrary_actions(1, 120, 6, size=1.5)
    seen = np.stack([env.step(action)[0] for action in actions])
    assert (np.ptp(seen, axis=(0, 1)) > 0).all()


def test_the_papers_environment_shows_no_command_and_asks_for_no_turn():
    env = GaitEnv(HOP, FLAT, 2, config=EnvConfig.paper(), threads=1)
    env.reset(seed=0)
    shown = set(env.walker.observation.slices)
    assert not {name for name in shown if name.endswith("_command")} | {"last_action"} & shown
    for action in arbitrary_actions(0, 5, 2, size=0.3):
        *_, info = env.step(action)
        turning = env.world.sensed.angular_velocity_b[:, 2]
        np.testing.assert_allclose(info["reward_terms"]["yaw_rate"], -25.0 * turning**2)
        silent = {name for name, term in info["reward_terms"].items() if not term.any()}
        assert len(info["reward_terms"]) - len(silent) == 7, "the terms of Table I alone"
