"""Commands in training: drawn from their ranges, at their times, and asked for alike."""

from dataclasses import replace

import numpy as np
import pytest

from gaitshift.control.observation import FULL_SLICES
from gaitshift.gait import gaits
from gaitshift.sim.env import Curriculum, EnvConfig, GaitEnv
from gaitshift.sim.env.commander import Commander
from hopping import FLAT, HOP, RANGED, arbitrary_actions, commanded, feed, ranged


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


def test_speeds_are_drawn_beyond_the_ends_by_a_share_of_the_range_but_not_backwards():
    """The range is 0.4 to 1.5 m/s."""
    for margin, ends in ((0.2, (0.18, 1.72)), (0.5, (0.0, 2.05))):
        env = ranged(10, command_share=1.0, speed_margin=margin)
        speed, _ = draws(env, resets=60)
        assert (speed.min(), speed.max()) == pytest.approx(ends, abs=0.03)
        assert env.commands()["speed_range"] == [0.4, 1.5], "which the policy promises"


def aside(env, resets=30):
    """Lateral speeds [m/s] and body heights [m] of the first commands of many episodes."""
    places = env.walker.observation.slices
    side, height = (places[f"{name}_command"] for name in ("lateral_speed", "body_height"))
    seen = [env.reset(seed=seed)[0] for seed in range(resets)]
    return tuple(np.concatenate([one[:, place] for one in seen])[:, 0] for place in (side, height))


def test_a_lateral_speed_and_a_height_are_drawn_from_their_ranges_or_nominal():
    side, height = aside(ranged(10, command_share=1.0))
    assert (side.min(), side.max()) == pytest.approx((-0.3, 0.3), abs=0.02)
    assert (height.min() / 10, height.max() / 10) == pytest.approx((-0.1, 0.05), abs=0.005)
    side, height = aside(ranged(10, command_share=0.3))
    for asked, home in ((side, 0.0), (height, -0.2)):  # heights are observed in units of 10 cm
        assert np.mean(np.isclose(asked, home)) == pytest.approx(0.7, abs=0.1)
    env = ranged(10, command_share=1.0)
    env.curriculum = Curriculum(command_scale=0.5)
    side, height = aside(env)
    assert np.abs(side).max() == pytest.approx(0.15, abs=0.01)
    assert (height.min() / 10, height.max() / 10) == pytest.approx((-0.06, 0.015), abs=0.004)


def test_a_span_of_heights_is_for_gaits_that_have_no_range_of_their_own():
    config = EnvConfig(observed=FULL_SLICES, command_share=1.0, height_span=0.03)
    env = GaitEnv(HOP, FLAT, 10, config=config, threads=1)
    _, height = aside(env)
    assert (height.min() / 10, height.max() / 10) == pytest.approx((-0.03, 0.03), abs=0.003)
    assert env.commands()["height_range"] == [-0.03, 0.03]
    ends = GaitEnv(RANGED, FLAT, 1, config=config, threads=1).commands()["height_range"]
    assert ends == [-0.1, 0.05]


def test_a_gait_that_stands_is_not_asked_to_turn():
    env = GaitEnv(gaits.load("stand"), FLAT, 4, config=EnvConfig(command_interval=5), threads=1)
    env.reset(seed=0)
    turn = env.walker.observation.slices["yaw_rate_command"]
    for action in arbitrary_actions(0, 20, 4, size=0.2):
        assert not env.step(action)[0][:, turn].any()


def commander(n, **config):
    """Commands of robots on lines along x, drawn every ten steps, and a function for a step."""
    config = EnvConfig(command_interval=10, command_share=0.5, **config)
    made = Commander(RANGED, config, n, np.random.default_rng(0))
    made.restart(np.arange(n), np.zeros(n), 1.0)

    def rate(step, yaw, scale=1.0):
        made.update(np.full(n, step), yaw, scale)
        return made.command.yaw_rate

    return made, rate


def test_a_share_of_the_robots_turns_at_a_rate_of_its_own_until_the_next_draw():
    _, rate = commander(400, turn_share=0.25, heading_range=0.1)
    # The yaws change, so that only a robot that turns has the same command in all steps.
    rates = [rate(step, np.full(400, 0.01 * step)) for step in range(9, 19)]
    is_turning = np.ptp(rates, axis=0) == 0.0
    assert is_turning.mean() == pytest.approx(0.25, abs=0.07)
    asked = rates[0][is_turning]
    assert (asked.min(), asked.max()) == pytest.approx((-0.5, 0.5), abs=0.05)
    assert abs(asked.mean()) < 0.1
    again = [rate(step, np.full(400, 0.01 * step), 0.2) for step in (19, 20)]
    assert not np.isin(again[0], asked).any(), "all are drawn anew"
    slow = again[0][again[0] == again[1]]
    assert np.abs(slow).max() == pytest.approx(0.1, abs=0.01)


def test_a_robot_that_has_turned_keeps_the_heading_that_it_has_then():
    made, rate = commander(400, turn_share=0.5, heading_range=1e-9)
    yaw = np.full(400, 0.2)
    is_turning = ~np.isclose(rate(9, yaw), -0.3)  # the others turn back, by 1.5 times the error
    np.testing.assert_allclose(made.heading, np.where(is_turning, 0.2, 0.0), atol=1e-6)
    later = rate(19, yaw)
    keeps = is_turning & (np.abs(later) < 1e-6)
    assert keeps.sum() == pytest.approx(100, abs=30), "half of a half go straight on"


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
    env.curriculum = Curriculum(command_scale=0.0)
    speed, stride = draws(env, resets=3)
    np.testing.assert_allclose(speed, 0.9, rtol=1e-6)
    np.testing.assert_allclose(stride, 6.0, rtol=1e-6)
    env.curriculum = Curriculum(command_scale=0.5)
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
        "lateral_speed": 0.3,
        "body_height": -0.02,
        "height_range": [-0.1, 0.05],
    }
    told = ranged(1, command_share=0.0, forward_speed=1.1).commands()
    assert told == {
        "forward_speed": 1.1,
        "speed_range": [1.1, 1.1],
        "stride_frequency": pytest.approx(100 / 6),
        "stride_frequency_range": [pytest.approx(100 / 6)] * 2,
        "lateral_speed": 0.0,
        "body_height": -0.02,
        "height_range": [-0.02, -0.02],
    }
