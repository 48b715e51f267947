"""The beginnings and ends of episodes, on the ground and under pushes."""

import numpy as np
import pytest

from gaitshift.gait import RewardMachine, gaits
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.env import Curriculum, EnvConfig, GaitEnv
from gaitshift.sim.push import PushConfig
from gaitshift.sim.terrain import flat, perlin, slope
from hopping import FLAT, FOLD, arbitrary_actions, hop, keep_steps, run
from worlds import velocity_w


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
    slices = env.walker.observation.slices
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
    steps = keep_steps(env, monkeypatch)
    lift = np.zeros((2, 12))
    lift[1, 1:3] = FOLD[0, 1:3]
    for step in range(1, 60):
        observation, reward, terminated, truncated, info = env.step(lift if step > 10 else 0 * lift)
        if terminated.any():
            break
    assert step > 10
    assert terminated.tolist() == [False, True]
    assert not truncated.any()
    assert not steps[-1][1].body_contact.any()
    assert steps[-1][0].contact[1].tolist() == [False, True, True, True]
    terms = sum(term[1] for term in info["reward_terms"].values())
    assert reward[1] == pytest.approx(terms + env.config.reward.bonus)
    state = env.walker.observation.slices["machine_state"]
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
    position = env.world.truth.base_position_w
    np.testing.assert_allclose(position[0, :2], xy[0], atol=0.02)
    assert ground.contains(position[1:, :2], 0.5).all()


def test_ground_of_which_the_first_part_is_level_has_a_border_all_the_same():
    sizes = {"length": 6.0, "width": 4.0}
    env = hop(4, ground=(flat(6.0, 4.0), perlin(0.02, seed=0, **sizes)))
    env.reset(seed=0)
    position = env.world.truth.base_position_w[:, :2]
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
    truth, rise = env.world.truth, np.tan(np.radians(12.0))
    sole = truth.foot_position_w[..., 2] - truth.clearance
    for robot in range(6):
        along = truth.foot_position_w[robot, :, robot % 2]
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
    clearance = env.world.truth.clearance
    np.testing.assert_allclose(clearance.min(axis=1), 0.0, atol=1e-9)
    assert np.ptp(env.world.truth.base_position_w[:, :2], axis=0).min() > 1.0
    assert np.ptp(env.world.sensed.yaw) > 3.0
    np.testing.assert_allclose(np.sin(env.world.sensed.yaw), 0.0, atol=1e-9)


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
        velocities.append(velocity_w(env.world.truth))
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
    before = env.world.truth.base_position_w
    for _ in range(100):
        env.step(np.zeros((4, 12)))
    assert np.abs(env.world.truth.base_position_w - before)[:, :2].max() < 0.05


@pytest.mark.parametrize("cycles", [1.0, 2.5])
def test_a_robot_that_stands_in_one_state_for_too_long_has_fallen(cycles):
    """A trot that keeps its stance never lifts a foot: at 2.5 Hz a cycle has 40 control steps."""
    trot, still = gaits.load("trot"), np.zeros((2, 12))
    allowed = int(cycles * 40)
    env = GaitEnv(trot, FLAT, num_envs=2, config=EnvConfig(stall=cycles, command_share=0.0))
    env.reset(seed=0)
    ends = [env.step(still)[2].all() for _ in range(allowed + 1)]
    assert ends == [False] * allowed + [True]
    env.curriculum = Curriculum(strictness=0.9)
    env.reset(seed=0)
    assert not any(env.step(still)[2].any() for _ in range(allowed + 1)), "not while it explores"
    never = GaitEnv(trot, FLAT, num_envs=2, config=EnvConfig(command_share=0.0))
    never.reset(seed=0)
    assert not any(never.step(still)[2].any() for _ in range(allowed + 1))


def test_a_gait_that_stands_may_stand():
    env = GaitEnv(gaits.load("stand"), FLAT, num_envs=2, config=EnvConfig(stall=0.1))
    env.reset(seed=0)
    assert not any(env.step(np.zeros((2, 12)))[2].any() for _ in range(100))
