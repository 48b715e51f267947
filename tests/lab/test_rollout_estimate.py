"""Rollouts of robots that measure no velocity: who sees the estimate, and how good it is."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitshift.control import Driver, Estimator, policy
from gaitshift.lab.evaluation import RolloutConfig, rollout
from gaitshift.lab.evaluation.rollout import Walk
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.robot_file import read_robot
from gaitshift.sim.terrain import flat, from_spec
from gaitshift.sim.world import World
from unmeasured import Unmeasured

PONY = Path(__file__).parents[2] / "examples" / "robots" / "pony.toml"
LEVEL = flat(40.0, 12.0).moved(-2.0, 0.0)
NOISE = {"gyro": 0.03, "accelerometer": 0.15}
"""[rad/s, m/s²]"""


class Watched(Driver):
    """A driver that remembers what it was shown."""

    def __init__(self, gait, n):
        super().__init__({gait: policy.load(gait)}, n, start=gait)
        self.shown = []

    def act(self, sensed, command):
        self.shown.append(sensed)
        return super().act(sensed, command)

    def see(self, sensed, command):
        self.shown.append(sensed)
        super().see(sensed, command)


class Told:
    """A switcher that remembers what it was shown."""

    def __init__(self):
        self.shown = []

    def step(self, sensed, controller, truth):
        self.shown.append(sensed)


def walk(world, controller, *, switcher=None):
    start = np.stack([np.zeros(world.n), np.linspace(-2.0, 2.0, world.n)], axis=1)
    config = RolloutConfig(seconds=4.0)
    rng = np.random.default_rng(0)
    return Walk(world, controller, config, start_xy=start, rng=rng, switcher=switcher)


def log_of(world, gait, seconds):
    start = np.stack([np.zeros(world.n), np.linspace(-2.0, 2.0, world.n)], axis=1)
    driver = Driver({gait: policy.load(gait)}, world.n, start=gait)
    config = RolloutConfig(seconds=seconds)
    return rollout(world, driver, config, start_xy=start, rng=np.random.default_rng(0))


def test_controller_and_switcher_see_the_estimate_where_no_velocity_is_sensed():
    driver, switcher = Watched("trot", 2), Told()
    run = walk(Unmeasured(LEVEL, 2), driver, switcher=switcher)
    for _ in range(20):
        run.step()
        truth = run.world.truth.velocity_b
        for seen in (driver.shown[-1], switcher.shown[-1], run.sensed):
            np.testing.assert_allclose(seen.velocity_b, truth, rtol=0, atol=0.5)
            assert not np.array_equal(seen.velocity_b, truth)
    assert all(seen.velocity_b is not None for seen in driver.shown)


def test_a_velocity_that_is_sensed_is_seen_as_it_is():
    class Both(World):
        def step(self, target):
            sensed, truth = super().step(target)
            self.sensed = replace(sensed, specific_force_b=np.full((self.n, 3), 5.0))
            return self.sensed, truth

    driver = Watched("trot", 2)
    run = walk(Both(ANYMAL_B, LEVEL, 2), driver)
    for _ in range(10):
        run.step()
        np.testing.assert_array_equal(driver.shown[-1].velocity_b, run.world.truth.velocity_b)


def test_a_robot_that_is_set_down_again_is_estimated_anew():
    """Its accelerometer went mad first: 10 km/s would never be forgotten."""

    class Diverging(Unmeasured):
        steps = 0

        def step(self, target):
            sensed, truth = super().step(target)
            self.steps += 1
            if self.steps == 9:
                sensed.specific_force_b[1] = 1e6
            return sensed, replace(truth, diverged=np.array([False, self.steps == 10]))

    run = walk(Diverging(LEVEL, 2), Watched("trot", 2))
    for _ in range(60):
        run.step()
    error = run.sensed.velocity_b - run.world.truth.velocity_b
    assert np.abs(error).max() < 0.3


def test_a_robot_of_another_size_is_estimated_as_well():
    """Ponies that stagger at up to 0.5 m/s: within 0.02 m/s (root mean square)."""
    pony = read_robot(PONY)
    world, estimator = Unmeasured(LEVEL, 8, robot=pony), Estimator(robot=pony)
    world.place(np.arange(8), xy=np.zeros((8, 2)), yaw=np.linspace(-3.0, 3.0, 8))
    state, errors = estimator.begin(8), []
    phase = np.random.default_rng(0).uniform(-3.0, 3.0, (8, 12))
    for step in range(300):
        swing = 0.1 * np.sin(4.0 * np.pi * 0.01 * step + phase)
        sensed, truth = world.step(pony.stance_angles + swing)
        state, _ = estimator.step(state, sensed)
        errors.append(state.velocity_b - truth.velocity_b)
    assert np.sqrt(np.square(errors[100:]).mean()) < 0.02
    assert not truth.body_contact.any()


@pytest.mark.learned
@pytest.mark.parametrize(("gait", "ground"), [("trot", "perlin:0.10"), ("bound", "flat")])
def test_errors_stay_within_three_of_their_own_deviations(gait, ground):
    """In 99 % of the steps, on every axis; the log keeps what was sensed, so it can be repeated."""
    terrain = from_spec(ground, seed=1, length=12.0, width=12.0).moved(-2.0, 0.0)
    log = log_of(Unmeasured(terrain, 6, **NOISE), gait, 3.0)
    assert not log.fallen.any()
    estimator = Estimator(robot=ANYMAL_B)
    state, errors, deviations = estimator.begin(6), [], []
    for step in range(len(log.sensed.contact)):
        state, _ = estimator.step(state, log[step].sensed)
        errors.append(state.velocity_b - log.truth.velocity_b[step])
        deviations.append(state.velocity_deviation)
        np.testing.assert_allclose(state.velocity_b, log.sensed.velocity_b[step], atol=0.05)
    within = np.abs(errors) < 3.0 * np.array(deviations)[..., None]
    assert within.mean(axis=(0, 1)).min() > 0.99


@pytest.mark.learned
def test_a_trot_that_sees_the_estimate_keeps_its_speed():
    seeing, estimating = (
        log_of(world, "trot", 5.0).truth.forward_speed[200:].mean()
        for world in (World(ANYMAL_B, LEVEL, 4), Unmeasured(LEVEL, 4, **NOISE))
    )
    assert abs(seeing - estimating) < 0.03
