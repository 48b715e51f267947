"""The baseline: its view of the environment, and what it is asked for, beside ours."""

from dataclasses import replace

import numpy as np

from gaitshift.control import policy
from gaitshift.gait import gaits
from gaitshift.lab.benchmark.baseline import ROBOTS, Baseline, GaitVecEnv
from gaitshift.lab.benchmark.trainer import GaitshiftTrainer
from gaitshift.learn.recipe import Recipe, Stage
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat
from hopping import FOLD

TROT = gaits.load("trot")
SMALL = Recipe(stages=(Stage(name="flat", iterations=4),), robots=4, steps=5, threads=1)


def test_the_baseline_sees_the_same_robots_step_for_step():
    config = EnvConfig(episode_steps=70, command_interval=9)
    plain, wrapped = (GaitEnv(TROT, flat(20.0, 20.0), 3, config=config) for _ in range(2))
    vec = GaitVecEnv(wrapped)
    vec.seed(11)
    np.testing.assert_array_equal(vec.reset(), plain.reset(seed=11)[0])
    rng, cut, fallen = np.random.default_rng(0), 0, 0
    for _ in range(150):
        actions = np.concatenate([FOLD, 0.3 * rng.normal(size=(2, 12))]).astype(np.float32)
        seen, reward, done, infos = vec.step(actions)
        expected, paid, terminated, truncated, info = plain.step(actions)
        np.testing.assert_array_equal(seen, expected)
        np.testing.assert_array_equal(reward, paid)
        np.testing.assert_array_equal(done, terminated | truncated)
        for robot in range(3):
            if not done[robot]:
                assert infos[robot] == {}
                continue
            assert set(infos[robot]) == {"terminal_observation", "TimeLimit.truncated"}
            last = infos[robot]["terminal_observation"]
            np.testing.assert_array_equal(last, info["final_obs"][robot])
            assert not np.array_equal(last, seen[robot])
            assert infos[robot]["TimeLimit.truncated"] is bool(truncated[robot])
            cut, fallen = cut + int(truncated[robot]), fallen + int(terminated[robot])
    assert cut >= 2
    assert fallen >= 2


def test_the_exported_baseline_acts_as_its_own_library_says(tmp_path):
    baseline = Baseline(TROT, SMALL, 3, tmp_path, rollout=32)
    baseline.advance()
    assert baseline.steps == 32 * ROBOTS
    loaded = policy.load(baseline.export())
    seen = np.random.default_rng(0).normal(size=(5, loaded.observation.size)).astype(np.float32)
    expected, _ = baseline._ppo.predict(seen, deterministic=True)
    assert np.abs(expected).max() > 1e-3
    np.testing.assert_allclose(loaded(seen), expected, atol=1e-5)


def test_the_baseline_is_asked_for_as_much_as_ours_after_as_many_steps(tmp_path):
    # 2 · 30 robots · 32 steps are 6 iterations of 4 robots · 80 steps: halfway from 4 to 8.
    recipe = replace(SMALL, steps=80, strict_from=4, strict_until=8, command_from=5)
    recipe = replace(recipe, command_until=9)
    baseline = Baseline(TROT, recipe, 0, tmp_path, rollout=32)
    asked = []
    for _ in range(3):
        baseline.advance()
        now = baseline._env.curriculum
        asked.append((now.strictness, now.command_scale))
    assert asked == [(0.0, 0.0), (0.0, 0.0), (0.5, 0.25)]


def test_both_learners_repeat_themselves_from_a_seed(tmp_path):
    seen = np.random.default_rng(0).normal(size=(2, 61)).astype(np.float32)

    def acts(learner):
        learner.advance()
        loaded = policy.load(learner.export())
        return loaded(seen[:, : loaded.observation.size])

    for build in (
        lambda seed: GaitshiftTrainer(TROT, SMALL, seed, tmp_path, iterations=2),
        lambda seed: Baseline(TROT, SMALL, seed, tmp_path, rollout=32),
    ):
        first = acts(build(0))
        np.testing.assert_array_equal(first, acts(build(0)))
        assert not np.array_equal(first, acts(build(1)))
