"""The product S × U: Gymnasium's contract, one step told twice, and what ends an episode."""

import subprocess
import sys
from dataclasses import replace

import gymnasium as gym
import mujoco
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.reward import RewardConfig
from gaitshift.sim.terrain import flat, perlin, slope
from gaitshift.sim.world import PushConfig

FLAT = flat(20.0, 20.0)
FEET = ("FL", "FR", "BL", "BR")
STANCE = ANYMAL_B.stance_angles
DWELL, SWING_HEIGHT = 3, 0.004
EDGES = {0: ({1}, {0}, 1, 1.0), 1: ({0}, {1}, 0, 0.5)}
"""By state: feet that must be down, feet that must be up, next state, multiplier of b."""
HOP = RewardMachine.from_dict(
    {
        "name": "hop",
        "title": "Hop",
        "description": "The front feet take turns: something happens under arbitrary actions too.",
        "dwell": DWELL,
        "swing_height": SWING_HEIGHT,
        "ideal_phase": {"FL": 0.0, "FR": 0.5, "BL": 0.5, "BR": 0.0},
        "state": [
            {"name": "FL", "stance": ["FL", "BL", "BR"]},
            {"name": "FR", "stance": ["FR", "BL", "BR"]},
        ],
        "transition": [
            {"from": "FL", "to": "FR", "down": ["FR"], "up": ["FL"]},
            {"from": "FR", "to": "FL", "down": ["FL"], "up": ["FR"], "bonus": 0.5},
        ],
    }
)
RANGED = replace(HOP, dwell_range=(2, 8), speed=0.9, speed_range=(0.4, 1.5))
"""The same gait for several speeds and stride frequencies."""
UNHURRIED = RewardMachine.from_dict(
    HOP.to_dict()
    | {
        "dwell": 8,
        "dwell_range": [8, 8],
        "transition": [
            edge.to_dict() | {"dwell": 8, "bonus": 1.0, "swing_height": 0.0} for edge in HOP.edges
        ],
    }
)
"""The same gait at a slow stride, whatever the height of the swing."""
FOLD = np.array([[0.0, 4.0, -6.0] * 2 + [0.0, -4.0, 6.0] * 2])
"""An action that folds all legs, so that the body comes to the ground."""


def hop(n=3, *, ground=FLAT, threads=1, **config):
    return GaitEnv(HOP, ground, n, config=EnvConfig(**config), threads=threads)


def ranged(n, **config):
    return GaitEnv(RANGED, FLAT, n, config=EnvConfig(**config), threads=1)


def arbitrary_actions(seed, steps, n, size=1.0):
    """Actions (T, N, 12) that stagger about."""
    rng, action, actions = np.random.default_rng(seed), np.zeros((n, 12)), []
    for _ in range(steps):
        action = 0.8 * action + size * rng.normal(size=(n, 12))
        actions.append(action)
    return np.array(actions)


def run(env, actions, seed=5):
    """Everything that reset and the steps return."""
    return [env.reset(seed=seed), *(env.step(action) for action in actions)]


def keep_motions(env, monkeypatch):
    """Motions after each physics step, before any robot starts anew."""
    motions, step = [], env.world.step

    def kept(target):
        motions.append(step(target))
        return motions[-1]

    monkeypatch.setattr(env.world, "step", kept)
    return motions


def feed(env, monkeypatch):
    """Contacts (N, 4) to write into: the feet touch as they say, and are 0.2 m high where not."""
    contact, step = np.ones((env.num_envs, 4), dtype=bool), env.world.step

    def fed(target):
        clearance = np.where(contact, 0.0, 0.2)
        env.world.motion = replace(step(target), contact=contact.copy(), clearance=clearance)
        return env.world.motion

    monkeypatch.setattr(env.world, "step", fed)
    return contact


def commanded(env, observation):
    """Speeds [m/s] and strides [control steps] that an observation shows, (N,) each."""
    speed, stride = (
        observation[:, env.observe.slices[name]][:, 0].astype(float)
        for name in ("forward_speed_command", "stride_command")
    )
    return speed, 20.0 * stride  # in units of 20 steps


# Gymnasium's contract ---------------------------------------------------------------------------


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
    height = seen[env.vector.observe.slices["base_height"]].item()
    assert height < 0.3, "of a robot on its belly, not of one that has just begun anew"


def test_an_episode_needs_a_step_and_a_speed_that_legs_can_run():
    with pytest.raises(GaitshiftError, match="episode_steps must be 1 or more, got 0"):
        EnvConfig(episode_steps=0)
    with pytest.raises(GaitshiftError, match=r"forward_speed must be 0 to 3 m/s, got -0\.1"):
        EnvConfig(forward_speed=-0.1)
    with pytest.raises(GaitshiftError, match=r"command_share must be 0 to 1, got 1\.1"):
        EnvConfig(command_share=1.1)
    with pytest.raises(GaitshiftError, match="command_interval must be 1 or more, got 0"):
        EnvConfig(command_interval=0)


# Chance -----------------------------------------------------------------------------------------


def test_the_same_seed_gives_the_same_bits():
    config = {"push": PushConfig(force=200.0, duration=5, interval=12), "command_interval": 9}
    actions = arbitrary_actions(2, 50, 3)
    ways = [run(hop(3, episode_steps=20, **config), actions) for _ in range(2)]
    for one, other in zip(*ways, strict=True):
        for part, twin in zip(one[:-1], other[:-1], strict=True):
            np.testing.assert_array_equal(part, twin)


def test_a_seed_begins_anew_whatever_came_before():
    env, actions = hop(3, episode_steps=20), arbitrary_actions(2, 30, 3)
    first = run(env, actions)
    again = run(env, actions)
    np.testing.assert_array_equal(first[-1][0], again[-1][0])


def test_the_number_of_threads_changes_no_bit():
    actions = arbitrary_actions(2, 40, 5)
    one, two = (run(hop(5, episode_steps=15, threads=threads), actions) for threads in (1, 2))
    np.testing.assert_array_equal(one[-1][0], two[-1][0])


def test_other_seeds_and_resets_without_a_seed_give_other_starts():
    env = hop(3)
    starts = [env.reset(seed=0)[0], env.reset(seed=1)[0], env.reset()[0], env.reset()[0]]
    for index, start in enumerate(starts):
        assert all(not np.array_equal(start, other) for other in starts[:index])
        assert len(np.unique(start, axis=0)) == 3, "robots start differently"


# One step, told a second time -------------------------------------------------------------------


def test_machines_in_the_environment_step_as_a_loop_over_robots_and_feet_does(monkeypatch):
    env = hop(3, episode_steps=70, heading_range=0.0)
    env.reset(seed=1)
    motions = keep_motions(env, monkeypatch)
    states, deltas, changes, falls = [0] * 3, [0] * 3, 0, 0
    swings = [[np.inf] * 4 for _ in range(3)]
    one_hot, delta_slice = env.observe.slices["machine_state"], env.observe.slices["steps_in_state"]

    def check(observation, robot):
        shown = observation[robot, one_hot].tolist()
        assert shown == [float(u == states[robot]) for u in range(2)]
        delta = observation[robot, delta_slice].item()
        assert delta == pytest.approx(min(deltas[robot] / 20, 5))

    for action in arbitrary_actions(7, 300, 3, size=1.5):
        observation, reward, terminated, truncated, info = env.step(action)
        motion = motions[-1]
        for robot in range(3):
            contact = motion.contact[robot].tolist()
            clearance = motion.clearance[robot].tolist()
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
            assert info["reward_terms"]["stance_feet"][robot] == weight * agreeing / 4
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
    slices = env.observe.slices
    env.reset(seed=2)
    qpos, _ = env.world.state()
    heading = 2 * np.arctan2(qpos[:, 6], qpos[:, 3])
    motions = keep_motions(env, monkeypatch)
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
                "contact": motions[-1].contact[robot],
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
    part = env.observe.slices["touch_height"]
    env.reset(seed=1)
    motions = keep_motions(env, monkeypatch)

    def heights(motion, robot):
        return motion.foot_position_w[robot, :, 2] - motion.base_position_w[robot, 2]

    kept = [heights(env.world.motion, robot) for robot in range(3)]
    ends = 0
    for action in arbitrary_actions(7, 120, 3, size=1.5):
        observation, _, terminated, truncated, info = env.step(action)
        for robot in range(3):
            for foot in np.flatnonzero(motions[-1].contact[robot]):
                kept[robot][foot] = heights(motions[-1], robot)[foot]
            shown = observation[robot, part]
            if terminated[robot] or truncated[robot]:
                ends += 1
                shown = info["final_obs"][robot, part]
            expected = np.clip(10 * (kept[robot] - kept[robot].mean()), -4, 4)
            np.testing.assert_allclose(shown, expected, atol=1e-5)
            if terminated[robot] or truncated[robot]:
                kept[robot] = heights(env.world.motion, robot)
    assert ends > 4


def test_the_action_shown_and_paid_for_is_the_clipped_one():
    env = hop(1)
    env.reset(seed=0)
    limit = float(env.single_action_space.high[0])
    action = np.zeros((1, 12))
    action[0, 4] = limit + 1000.0
    observation, _, _, _, info = env.step(action)
    shown = observation[0, env.observe.slices["last_action"]]
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
    shown = set(env.observe.slices)
    assert not {name for name in shown if name.endswith("_command")} | {"last_action"} & shown
    for action in arbitrary_actions(0, 5, 2, size=0.3):
        *_, info = env.step(action)
        turning = env.world.motion.base_angular_velocity_b[:, 2]
        np.testing.assert_allclose(info["reward_terms"]["yaw_rate"], -25.0 * turning**2)
        silent = {name for name, term in info["reward_terms"].items() if not term.any()}
        assert len(info["reward_terms"]) - len(silent) == 7, "the terms of Table I alone"


# Commands ---------------------------------------------------------------------------------------


def draws(env, resets=30):
    """Speeds and strides of the first commands of many episodes, (resets · N,) each."""
    seen = [commanded(env, env.reset(seed=seed)[0]) for seed in range(resets)]
    return (np.concatenate(part) for part in zip(*seen, strict=True))


def test_commands_are_drawn_from_the_gaits_ranges_and_reach_their_ends():
    speed, stride = draws(ranged(10, command_share=1.0))
    assert speed.min() == pytest.approx(0.4, abs=0.03)
    assert speed.max() == pytest.approx(1.5, abs=0.03)
    np.testing.assert_allclose(np.unique(np.rint(stride)), np.arange(4, 17, 2))
    np.testing.assert_allclose(stride, np.rint(stride), atol=1e-4)
    assert abs(np.corrcoef(speed, stride)[0, 1]) < 0.2, "each is drawn by itself"


@pytest.mark.parametrize("share", [0.0, 0.3, 0.6])
def test_the_other_draws_are_the_gaits_own_speed_and_stride(share):
    speed, stride = draws(ranged(10, command_share=share))
    at_home = np.isclose(speed, 0.9)
    # Of 300 draws a share of 0.3 has a standard deviation of 0.026.
    assert np.mean(at_home) == pytest.approx(1 - share, abs=0.1)
    # A dwell drawn between 2 and 8 is rounded to 3, the gait's own, in one case of six.
    assert np.mean(np.isclose(stride, 6.0)) == pytest.approx(1 - share * 5 / 6, abs=0.1)


def test_at_a_command_scale_of_0_all_is_the_gaits_own_and_in_between_ranges_shrink_towards_it():
    env = ranged(10, command_share=1.0)
    env.command_scale = 0.0
    speed, stride = draws(env, resets=3)
    np.testing.assert_allclose(speed, 0.9, rtol=1e-6)
    np.testing.assert_allclose(stride, 6.0, rtol=1e-6)
    env.command_scale = 0.5
    speed, stride = draws(env)
    # Half of the way from 0.9 to 0.4 and to 1.5; dwells between 2.5 and 5.5, rounded.
    assert 0.65 <= speed.min() < 0.68
    assert 1.17 < speed.max() <= 1.2
    assert set(np.rint(stride).tolist()) == {6.0, 8.0, 10.0}


def test_a_speed_of_the_config_takes_the_place_of_the_gaits_own():
    speed, _ = draws(ranged(4, command_share=0.0, forward_speed=1.1), resets=2)
    np.testing.assert_allclose(speed, 1.1, rtol=1e-6)


def test_commands_change_at_their_interval_and_where_an_episode_begins_and_at_no_other_time():
    env = ranged(3, episode_steps=25, command_interval=10, command_share=1.0)
    last = commanded(env, env.reset(seed=0)[0])[0]
    changes = []
    for step in range(1, 51):
        observation, *_ = env.step(np.zeros((3, 12)))
        speed = commanded(env, observation)[0]
        assert (speed != last).all() or (speed == last).all()
        changes += [step] if (speed != last).all() else []
        last = speed
    assert changes == [9, 19, 25, 34, 44, 50]


def test_a_commanded_stride_holds_the_machine_back_for_its_dwell_and_no_longer(monkeypatch):
    machine = replace(HOP, dwell_range=(3, 30))
    env = GaitEnv(machine, FLAT, 12, config=EnvConfig(command_share=1.0), threads=1)
    dwell = np.rint(commanded(env, env.reset(seed=0)[0])[1] / 2)
    assert dwell.min() < 8
    assert dwell.max() > 25
    contact = feed(env, monkeypatch)
    first, waited = np.ones(12, dtype=bool), np.zeros(12)
    for _ in range(100):
        # The feet always stand as the next state has them: only the dwell holds it back.
        contact[:, 0], contact[:, 1] = ~first, first
        *_, info = env.step(np.zeros((12, 12)))
        waited += 1
        np.testing.assert_array_equal(info["changed"], waited == dwell)
        first ^= info["changed"]
        waited[info["changed"]] = 0


def test_the_reward_and_the_observation_speak_of_the_same_command():
    env = ranged(8, command_share=1.0, command_interval=10)
    observation, _ = env.reset(seed=1)
    for action in arbitrary_actions(0, 25, 8, size=0.2):
        asked = commanded(env, observation)[0]
        observation, _, _, _, info = env.step(action)
        error = asked - info["forward_speed"]
        np.testing.assert_allclose(
            info["reward_terms"]["forward_velocity"], 10 * np.exp(-(error**2)), rtol=1e-5
        )


def test_an_environment_tells_what_may_be_commanded():
    # Two states of 3 steps: 100 / 6 Hz; of 8 and of 2: 100 / 16 and 100 / 4 Hz.
    assert ranged(1).commands() == {
        "forward_speed": 0.9,
        "speed_range": [0.4, 1.5],
        "stride_frequency": pytest.approx(100 / 6),
        "stride_frequency_range": [pytest.approx(6.25), pytest.approx(25.0)],
    }
    told = ranged(1, command_share=0.0, forward_speed=1.1).commands()
    assert told == {
        "forward_speed": 1.1,
        "speed_range": [1.1, 1.1],
        "stride_frequency": pytest.approx(100 / 6),
        "stride_frequency_range": [pytest.approx(100 / 6)] * 2,
    }


# The price of chatter ---------------------------------------------------------------------------

CHATTER = [
    # Feet down of a trotting robot, and how many of them came down once too often.
    ("", 0),
    ("FL FR BL BR", 0),  # every foot may land once in an episode before it is lifted
    ("FL BR", 0),
    ("FL BL BR", 1),  # BL was not lifted: the machine still waits in FL_BR
    *(("FL BR", 0),) * 20,
    ("FR BL", 2),  # FR and BL again; now the machine changes, and has lifted FL and BR
    ("FR", 0),
    ("FL FR BL", 1),  # FL may land, BL not
    ("FR BL", 0),
    ("FL FR BL", 1),  # FL has landed already
    *(("FR BL", 0),) * 20,
    ("FL BR", 1),  # BR may land, FL has; the machine changes and has lifted FR and BL
    *(("FL BR", 0),) * 20,
    ("FR BL", 0),
]
WALK_CHATTER = [
    # The same of a walking robot: the machine lifts FL, BR, FR, BL in turn.
    ("FR BL BR", 0),
    *(("FR BL BR", 0),) * 20,
    ("FL FR BL", 0),  # FL lands, and BR is lifted
    *(("FL FR BL", 0),) * 20,
    ("FL BL BR", 0),  # BR lands, and FR is lifted
    *(("FL BL BR", 0),) * 20,
    ("FL FR BR", 0),  # FR lands, and BL is lifted
    ("FR BR", 0),
    ("FL FR BR", 1),  # FL has landed already
]
EARLY = [
    # The same of a galloping robot: BR, BL, FR, FL in turn.
    ("BR", 0),
    ("BR FR", 1),  # two states too early
    *(("BR", 0),) * 12,
    ("BL", 0),
    *(("BL", 0),) * 14,
    ("BL FR", 0),  # the next one, before the machine changes
    ("FR", 0),
    ("FR BL", 1),  # lifted, but not due
    *(("FR", 0),) * 12,
    ("FL", 0),
]


@pytest.mark.parametrize("strictness", [0.0, 0.25, 1.0])
@pytest.mark.parametrize(
    ("gait", "table"), [("trot", CHATTER), ("walk", WALK_CHATTER), ("gallop", EARLY)]
)
def test_feet_that_come_down_out_of_place_are_paid_for(gait, table, strictness, monkeypatch):
    config = EnvConfig(command_share=0.0)
    env = GaitEnv(gaits.load(gait), FLAT, 2, config=config, threads=1)
    env.reset(seed=0)
    env.strictness = strictness
    contact = feed(env, monkeypatch)
    for feet, again in table:
        contact[:] = [foot in feet.split() for foot in FEET]
        *_, info = env.step(np.zeros((2, 12)))
        paid = env.config.reward.chatter * strictness * again
        np.testing.assert_allclose(info["reward_terms"]["chatter"], paid, err_msg=feet)


# The ends of episodes ---------------------------------------------------------------------------


def test_a_cut_episodes_final_observation_is_what_an_uncut_twin_sees():
    cut, uncut = hop(3, episode_steps=15), hop(3, episode_steps=1000)
    actions = arbitrary_actions(4, 15, 3, size=0.3)
    *_, last = run(cut, actions)
    *_, twin = run(uncut, actions)
    observation, reward, terminated, truncated, info = last
    assert truncated.tolist() == [True] * 3
    assert terminated.tolist() == [False] * 3
    np.testing.assert_array_equal(info["final_obs"], twin[0])
    np.testing.assert_array_equal(info["_final_obs"], [True] * 3)
    np.testing.assert_array_equal(reward, twin[1])
    assert not np.array_equal(observation, info["final_obs"])
    assert "final_obs" not in twin[4]


def test_a_robot_is_shown_the_same_whether_or_not_another_falls():
    falling, standing = hop(2), hop(2)
    falling.reset(seed=3)
    standing.reset(seed=3)
    fallen = False
    for action in arbitrary_actions(0, 150, 2, size=0.3):
        twin, *_ = standing.step(action)
        action[0] = FOLD[0]
        observation, _, terminated, _, info = falling.step(action)
        fallen |= terminated[0]
        np.testing.assert_array_equal(observation[1], twin[1])
        if terminated.any():
            np.testing.assert_array_equal(info["_final_obs"], [True, False])
    assert fallen


def test_a_body_on_the_ground_terminates_and_is_shown_in_the_final_observation_alone():
    env = hop(2)
    env.reset(seed=0)
    slices = env.observe.slices
    for _ in range(200):
        action = np.concatenate([np.zeros((1, 12)), FOLD])
        observation, _, terminated, truncated, info = env.step(action)
        if terminated.any():
            break
    assert terminated.tolist() == [False, True]
    assert truncated.tolist() == [False, False]
    lying, fresh = info["final_obs"][1], observation[1]
    assert lying[slices["base_height"]].item() < 0.3
    np.testing.assert_allclose(lying[slices["last_action"]], FOLD[0])
    # The fresh episode: upright, on its feet in about the stance, nothing done yet.
    assert abs(fresh[slices["base_height"]].item() - ANYMAL_B.stance_height) < 0.06
    np.testing.assert_allclose(fresh[slices["gravity_b"]], [0, 0, -1], atol=1e-6)
    assert np.abs(fresh[slices["joint_position"]]).max() <= env.config.joint_noise + 1e-6
    assert np.abs(fresh[slices["base_linear_velocity_b"]]).max() <= 1.5 * env.config.velocity_noise
    for name in ("joint_velocity", "base_angular_velocity_b", "last_action", "steps_in_state"):
        assert not fresh[slices[name]].any(), name
    np.testing.assert_array_equal(fresh[slices["machine_state"]], [1, 0])


def test_a_machine_that_accepts_ends_the_episode_with_its_bonus_and_without_a_fall(monkeypatch):
    tick_off = RewardMachine.from_dict(
        {
            "name": "lift",
            "title": "Lift",
            "description": "The task is done when the front left foot is lifted.",
            "dwell": 5,
            "ideal_phase": {"FL": 0.0, "FR": 0.0, "BL": 0.0, "BR": 0.0},
            "state": [
                {"name": "standing", "stance": ["FL", "FR", "BL", "BR"]},
                {"name": "done", "accepting": True},
            ],
            "transition": [{"from": "standing", "to": "done", "down": ["BR"], "up": ["FL"]}],
        }
    )
    config = EnvConfig(velocity_noise=0.0, joint_noise=0.0)
    env = GaitEnv(tick_off, FLAT, 2, config=config, threads=1)
    env.reset(seed=0)
    motions = keep_motions(env, monkeypatch)
    lift = np.zeros((2, 12))
    lift[1, 1:3] = FOLD[0, 1:3]
    for step in range(1, 60):
        observation, reward, terminated, truncated, info = env.step(lift if step > 10 else 0 * lift)
        if terminated.any():
            break
    assert step > 10
    assert terminated.tolist() == [False, True]
    assert not truncated.any()
    assert not motions[-1].body_contact.any()
    assert motions[-1].contact[1].tolist() == [False, True, True, True]
    terms = sum(term[1] for term in info["reward_terms"].values())
    assert reward[1] == pytest.approx(terms + env.config.reward.bonus)
    state = env.observe.slices["machine_state"]
    np.testing.assert_array_equal(info["final_obs"][1, state], [0, 1])
    np.testing.assert_array_equal(observation[1, state], [1, 0])


def test_a_robot_that_falls_in_its_last_step_is_terminated_and_not_truncated():
    env = hop(1)
    env.reset(seed=0)
    steps = next(step for step in range(1, 200) if env.step(FOLD)[2].any())
    short = hop(1, episode_steps=steps)
    short.reset(seed=0)
    for _ in range(steps):
        _, _, terminated, truncated, _ = short.step(FOLD)
    assert (terminated.item(), truncated.item()) == (True, False)


def test_spread_ages_cut_the_first_episodes_at_different_steps_and_the_next_after_a_whole_one():
    env = hop(6, episode_steps=40)
    env.reset(seed=0)
    env.spread_ages()
    ends = [[] for _ in range(6)]
    for step in range(85):
        _, _, terminated, truncated, _ = env.step(np.zeros((6, 12)))
        assert not terminated.any()
        for robot in np.flatnonzero(truncated):
            ends[robot].append(step)
    assert len({end[0] for end in ends}) > 3
    assert all(end[1] - end[0] == 40 for end in ends)


# Starts on the way --------------------------------------------------------------------------------

TROT_STANCES = ((True, False, False, True), (False, True, True, False))
"""FL FR BL BR, of the trot's states in their order."""


def test_a_mixed_start_has_each_leg_of_a_robot_that_is_on_its_way(monkeypatch):
    env = GaitEnv(gaits.load("trot"), FLAT, 6, config=EnvConfig(episode_steps=40), threads=1)
    env.mixed_starts = 1.0
    env.reset(seed=1)
    np.testing.assert_array_equal(env.world.motion.joint_velocity, 0.0)  # all begin: none to mix
    env._age[:2] = 20
    actions = arbitrary_actions(2, 20, 6, size=0.2)
    motions = keep_motions(env, monkeypatch)
    for action in actions:
        _, _, terminated, truncated, _ = env.step(action)
    assert not terminated.any()
    assert np.flatnonzero(truncated).tolist() == [0, 1]
    before, after = motions[-1], env.world.motion
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
                env._last_action[robot, joints], np.clip(actions[-1, donor, joints], -8, 8)
            )
        agree = [sum(d == s for d, s in zip(down, stance, strict=True)) for stance in TROT_STANCES]
        assert agree[env._state[robot]] == max(agree)
        speeds = np.linalg.norm(before.base_linear_velocity_w[2:], axis=1)
        assert np.isclose(np.linalg.norm(after.base_linear_velocity_w[robot]), speeds).sum() == 1
    np.testing.assert_allclose(after.clearance[:2].min(axis=1), 0.0, atol=1e-12)
    tilts = before.gravity_b[2:, 2]
    assert all(np.isclose(tilt, tilts, atol=1e-9).any() for tilt in after.gravity_b[:2, 2])
    for robot in (2, 3, 4, 5):
        np.testing.assert_array_equal(after.joint_position[robot], before.joint_position[robot])


def test_the_share_of_mixed_starts_is_what_was_asked_for(monkeypatch):
    env = GaitEnv(gaits.load("trot"), FLAT, 64, config=EnvConfig(episode_steps=10), threads=1)
    env.mixed_starts = 0.3
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


# The ground and the pushes ----------------------------------------------------------------------


def test_a_robot_that_comes_near_the_border_starts_anew_inside():
    ground = perlin(0.02, seed=0, length=6.0, width=4.0)
    env = hop(3, ground=ground, terrain_margin=0.5)
    env.reset(seed=0)
    x0, x1, _, y1 = ground.extent
    # Robot 0 just inside the margin of 0.5 m, robots 1 and 2 just outside, along x and along y.
    xy = np.array([[x0 + 0.6, 0.0], [x1 - 0.4, 0.0], [3.0, y1 - 0.4]])
    env.world.place(np.arange(3), xy=xy, yaw=np.zeros(3))
    _, _, terminated, truncated, info = env.step(np.zeros((3, 12)))
    assert truncated.tolist() == [False, True, True]
    assert not terminated.any()
    np.testing.assert_array_equal(info["_final_obs"], [False, True, True])
    position = env.world.motion.base_position_w
    np.testing.assert_allclose(position[0, :2], xy[0], atol=0.02)
    assert ground.contains(position[1:, :2], 0.5).all()


def test_ground_of_which_the_first_part_is_level_has_a_border_all_the_same():
    sizes = {"length": 6.0, "width": 4.0}
    env = hop(4, ground=(flat(6.0, 4.0), perlin(0.02, seed=0, **sizes)))
    env.reset(seed=0)
    position = env.world.motion.base_position_w[:, :2]
    assert env.world.terrains[1].contains(position, env.config.terrain_margin).all()
    env.world.place(np.arange(4), xy=np.tile([5.7, 0.0], (4, 1)), yaw=np.zeros(4))
    _, _, _, truncated, _ = env.step(np.zeros((4, 12)))
    assert truncated.all()


def test_robots_share_out_grounds_and_each_starts_on_its_own():
    sizes = {"length": 8.0, "width": 8.0}
    grounds = [slope(12.0, **sizes), slope(12.0, towards=90.0, **sizes)]
    env = hop(6, ground=flat(8.0, 8.0))
    env.set_terrain(grounds)
    env.reset(seed=0)
    motion, rise = env.world.motion, np.tan(np.radians(12.0))
    sole = motion.foot_position_w[..., 2] - motion.clearance
    for robot in range(6):
        along = motion.foot_position_w[robot, :, robot % 2]
        np.testing.assert_allclose(sole[robot], rise * along, atol=0.01)


def test_level_ground_has_no_border():
    env = hop(1, ground=flat(4.0, 4.0))
    env.reset(seed=0)
    env.world.place(np.array([0]), xy=np.array([[100.0, -50.0]]), yaw=np.zeros(1))
    _, _, terminated, truncated, _ = env.step(np.zeros((1, 12)))
    assert not terminated.item()
    assert not truncated.item()


def test_robots_start_on_the_ground_wherever_they_start():
    env = hop(16, ground=perlin(0.15, seed=1, length=8.0, width=8.0))
    env.reset(seed=0)
    clearance = env.world.motion.clearance
    np.testing.assert_allclose(clearance.min(axis=1), 0.0, atol=1e-9)
    assert np.ptp(env.world.motion.base_position_w[:, :2], axis=0).min() > 1.0
    assert np.ptp(env.world.motion.yaw) > 3.0
    np.testing.assert_allclose(np.sin(env.world.motion.yaw), 0.0, atol=1e-9)


def test_new_ground_lets_robots_go_on_as_they_moved():
    env = hop(3, episode_steps=12)
    env.reset(seed=0)
    centre = np.array([[9.0, 1.0], [10.0, -1.0], [11.0, 0.0]])
    env.world.place(np.arange(3), xy=centre, yaw=np.array([0.0, 1.0, 2.0]))
    actions = arbitrary_actions(6, 12, 3, size=0.2)
    for action in actions[:5]:
        env.step(action)
    qpos, qvel = env.world.state()
    env.set_terrain(perlin(0.05, seed=2, length=20.0, width=20.0))
    after, velocity = env.world.state()
    kept = np.arange(19) != 2
    np.testing.assert_array_equal(after[:, kept], qpos[:, kept])
    np.testing.assert_array_equal(velocity, qvel)
    assert np.abs(after[:, 2] - qpos[:, 2]).max() < 0.06
    for step, action in enumerate(actions[5:], start=6):
        observation, _, terminated, truncated, _ = env.step(action)
        assert np.isfinite(observation).all()
        assert not terminated.any()
        assert truncated.tolist() == [step == 12] * 3, "the episode's clock went on"


def test_a_push_moves_the_robot_its_way(monkeypatch):
    env = hop(8)
    env.reset(seed=0)
    env.push_at_most(400.0)
    forces, push = [], env.world.push

    def kept(force_w):
        forces.append(force_w.copy())
        push(force_w)

    monkeypatch.setattr(env.world, "push", kept)
    velocities = []
    for _ in range(env.config.push.interval + 2 * env.config.push.duration):
        env.step(np.zeros((8, 12)))
        velocities.append(env.world.motion.base_linear_velocity_w)
    forces, velocities = np.array(forces), np.array(velocities)
    assert np.linalg.norm(forces, axis=2).max() <= 400.0 * np.hypot(1, env.config.push.vertical)
    pushed = 0
    for robot in range(8):
        strong = np.linalg.norm(forces[:, robot, :2], axis=1) > 100.0
        begins = np.flatnonzero(strong[1:] & ~strong[:-1]) + 1
        for begin in begins[begins + 5 < len(velocities)]:
            force = forces[begin, robot, :2]
            gained = (velocities[begin + 4, robot] - velocities[begin - 1, robot])[:2]
            # 0.05 s of 100 N on 30 kg is 0.17 m/s; the legs take up some of it.
            assert gained @ force / np.linalg.norm(force) > 0.05
            pushed += 1
    assert pushed >= 4
    env.push_at_most(0.0)
    forces = []
    env.step(np.zeros((8, 12)))
    assert not np.any(forces)


def test_a_push_ends_with_the_episode(monkeypatch):
    push = PushConfig(force=50.0, duration=50, interval=60)
    env = hop(8, episode_steps=40, push=push)
    env.reset(seed=0)
    pushed = []
    monkeypatch.setattr(env.world, "push", lambda force_w: pushed.append(force_w.any(axis=1)))
    for _ in range(41):
        env.step(np.zeros((8, 12)))
    assert pushed[39].all(), "pauses last at most ten steps here"
    assert pushed[40].mean() < 0.5, "and episodes begin with one"


def test_without_pushes_a_standing_robot_stays_where_it_stands():
    env = hop(4, velocity_noise=0.0, joint_noise=0.0)
    env.reset(seed=0)
    before = env.world.motion.base_position_w
    for _ in range(100):
        env.step(np.zeros((4, 12)))
    assert np.abs(env.world.motion.base_position_w - before)[:, :2].max() < 0.05


@pytest.mark.parametrize("strictness", [0.0, 0.25, 1.0])
def test_strictness_is_how_far_the_bonus_depends_on_the_swing(strictness, monkeypatch):
    asked, step = 0.2, []
    config = EnvConfig(reward=RewardConfig(bonus_punctuality=0.0))
    envs = [
        GaitEnv(with_swing_height(height), FLAT, 4, config=config, threads=1)
        for height in (0.0, asked)
    ]
    for env in envs:
        env.strictness = strictness
        env.reset(seed=0)
    motions = keep_motions(envs[1], monkeypatch)
    swing = np.full((4, 2), np.inf)  # of FL and FR, which land in turn
    state = envs[1].observe.slices["machine_state"].start
    for action in arbitrary_actions(2, 150, 4, size=1.5):
        (_, free, *_), (seen, paid, *_, info) = (env.step(action) for env in envs)
        swing = np.maximum(swing, motions[-1].clearance[:, :2])
        for robot in np.flatnonzero(info["changed"]):
            entered = int(seen[robot, state] == 0.0)  # it stands on this one of the two now
            share = np.clip(swing[robot, entered] / asked, 0.0, 1.0)
            full = env.config.reward.bonus * HOP.edges[1 - entered].bonus
            lost = strictness * (1.0 - share) * full
            assert free[robot] - paid[robot] == pytest.approx(lost, abs=1e-9)
            step.append(share)
            swing[robot, 1 - entered] = motions[-1].clearance[robot, 1 - entered]
    assert len([share for share in step if 0 < share < 1]) > 5


def test_a_swing_factor_is_higher_swings_asked_for():
    envs = [
        GaitEnv(with_swing_height(height), FLAT, 4, config=EnvConfig(), threads=1)
        for height in (0.2, 0.3)
    ]
    envs[0].swing_factor = 1.5
    for env in envs:
        env.reset(seed=0)
    partly = 0
    for action in arbitrary_actions(2, 100, 4, size=1.5):
        (_, by_factor, *_), (_, by_machine, *_, info) = (env.step(action) for env in envs)
        np.testing.assert_allclose(by_factor, by_machine, atol=1e-9)
        partly += np.count_nonzero(
            info["changed"] & (info["bonus"] < 0.5 * envs[0].config.reward.bonus)
        )
    assert partly > 5


@pytest.mark.parametrize("strictness", [0.0, 0.25, 1.0])
def test_a_late_change_earns_less_of_the_bonus(strictness):
    """Against an env that does not ask: full until 2 steps late, nothing half a dwell after it."""
    seen = []
    envs = [
        GaitEnv(
            UNHURRIED,
            FLAT,
            4,
            config=EnvConfig(reward=RewardConfig(bonus_punctuality=weight)),
            threads=1,
        )
        for weight in (0.0, 1.0)
    ]
    for env in envs:
        env.strictness = strictness
        env.reset(seed=0)
    waited = np.zeros(4, dtype=int)
    for action in arbitrary_actions(2, 300, 4, size=1.5):
        (_, free, *_), (_, paid, ended, cut, info) = (env.step(action) for env in envs)
        waited += 1
        for robot in np.flatnonzero(info["changed"]):
            late = max(waited[robot] - 8 - 2, 0)
            lost = strictness * min(late / 4, 1.0) * envs[0].config.reward.bonus
            assert free[robot] - paid[robot] == pytest.approx(lost, abs=1e-9)
            seen.append(late)
        waited[info["changed"] | ended | cut] = 0
    assert min(seen) == 0
    assert {1, 2, 3} & set(seen)
    assert max(seen) > 4


def with_swing_height(height):
    """HOP with another swing height [m] in every guard."""
    edges = (replace(edge, swing_height=height) for edge in HOP.edges)
    return replace(HOP, edges=tuple(edges))
