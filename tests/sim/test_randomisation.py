"""Robots that differ: each range against the mechanics of what it changes."""

import re

import mujoco
import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat, perlin
from gaitshift.sim.world import Randomisation, World

STANCE, MASS, G = ANYMAL_B.stance_angles, ANYMAL_B.mass, 9.81
GROUND = flat(20.0, 20.0)


def standing(n, steps=200, seed=1, push=None, **ranges):
    """Robots drawn from these ranges that stand for two seconds, pushed in the last half."""
    world = World(ANYMAL_B, GROUND, n, randomisation=Randomisation(**ranges))
    world.redraw(np.arange(n), np.random.default_rng(seed))
    world.place(np.arange(n), xy=np.zeros((n, 2)), yaw=np.zeros(n))
    for step in range(steps):
        if push is not None and step == steps // 2:
            world.push(np.tile(push, (n, 1)))
        world.step(np.tile(STANCE, (n, 1)))
    return world


def drawn(world, name):
    return world.bodies[:, list(Randomisation().ranges()).index(name)]


def test_feet_bear_the_robot_and_its_payload():
    world = standing(8, payload=(-5.0, 5.0))
    weight = (MASS + drawn(world, "payload")) * G
    assert np.ptp(weight) > 40.0
    np.testing.assert_allclose(world.truth.foot_force.sum(axis=1), weight, rtol=0.01)


def test_the_centre_of_pressure_moves_with_the_payload():
    """On level ground at rest it is below the centre of mass: by m·x / (M + m) off the bare one.

    Robots stand on legs that give way, so their base tilts; that moves the centre of mass too.
    """
    loads = {"payload": (5.0, 5.0), "payload_x": (-0.2, 0.2), "payload_y": (-0.1, 0.1)}
    bare, world = standing(1), standing(8, **loads)
    for axis, name in enumerate(("payload_x", "payload_y")):
        pressure = [
            (w.truth.foot_force * w.truth.foot_position_w[..., axis]).sum(axis=1)
            / w.truth.foot_force.sum(axis=1)
            - w.truth.base_position_w[:, axis]
            for w in (world, bare)
        ]
        moved = pressure[0] - pressure[1]
        expected = 5.0 * drawn(world, name) / (MASS + 5.0)
        assert np.corrcoef(moved, expected)[0, 1] > 0.99
        slope = np.polyfit(expected, moved, 1)[0]
        assert slope == pytest.approx(1.0, abs=0.25)


def test_robots_slide_where_a_push_exceeds_friction():
    """A force of 0.2 m·g for a second: at 0.1 it slides ½·0.1·g·1² = 0.49 m, at 0.4 it stands."""
    push = np.array([0.2 * MASS * G, 0.0, 0.0])
    slid = []
    for friction in (0.1, 0.4):
        world = standing(2, push=push, friction=(friction, friction))
        slid.append(world.truth.base_position_w[:, 0])
    assert slid[0] == pytest.approx(np.full(2, 0.49), rel=0.2)
    assert np.abs(slid[1]).max() < 0.15  # it leans on its legs


def test_strength_scales_the_limit_and_the_line_of_the_torque():
    """At rest the drive cuts off at 80 N·m; at 12 rad/s the line has fallen to 120 · 3/15 = 24."""
    world = World(ANYMAL_B, GROUND, 6, randomisation=Randomisation(strength=(0.5, 1.5)))
    world.redraw(np.arange(6), np.random.default_rng(0))
    for robot, model in enumerate(world._models.each):
        data = mujoco.MjData(model)
        data.qpos[2], data.qpos[7:], data.qvel[6:12] = 3.0, STANCE, 12.0
        data.ctrl[:] = STANCE + 3.0  # an error of 240 N·m
        mujoco.mj_forward(model, data)
        expected = drawn(world, "strength")[robot] * np.repeat([24.0, 80.0], 6)
        np.testing.assert_allclose(data.actuator_force, expected, rtol=1e-9)


def test_gains_scale_the_error_and_the_damping():
    """In the first instant: kp·(target - q) - kd·q̇."""
    both = {"kp": (0.75, 1.25), "kd": (0.5, 1.5)}
    world = World(ANYMAL_B, GROUND, 5, randomisation=Randomisation(**both))
    world.redraw(np.arange(5), np.random.default_rng(4))
    speed = np.linspace(-2.0, 2.0, 12)
    for robot, model in enumerate(world._models.each):
        data = mujoco.MjData(model)
        data.qpos[2], data.qpos[7:], data.qvel[6:] = 3.0, STANCE, speed
        data.ctrl[:] = STANCE + 0.1
        mujoco.mj_forward(model, data)
        kp, kd = (drawn(world, name)[robot] for name in ("kp", "kd"))
        expected = 80.0 * kp * 0.1 - 2.0 * kd * speed
        np.testing.assert_allclose(data.actuator_force, expected, atol=1e-9)


def test_feet_sink_deeper_where_the_ground_is_softer():
    hard, soft = (standing(1, softness=(f, f)).truth.clearance.min() for f in (1.01, 6.0))
    assert soft < hard < 0.0


def test_robots_stay_as_drawn_on_another_ground_and_others_keep_theirs():
    world = standing(4, payload=(-5.0, 5.0))
    before = drawn(world, "payload")
    world.set_terrain([perlin(0.05, seed=i, length=20.0, width=20.0) for i in range(3)])
    np.testing.assert_array_equal(drawn(world, "payload"), before)
    masses = [float(model.body_mass.sum()) for model in world._models.each]
    np.testing.assert_allclose(masses, MASS + before)
    world.redraw(np.array([2]), np.random.default_rng(9))
    np.testing.assert_array_equal(drawn(world, "payload") != before, [False, False, True, False])


def test_where_nothing_varies_nothing_is_drawn():
    rng = np.random.default_rng(0)
    World(ANYMAL_B, GROUND, 3).redraw(np.arange(3), rng)
    assert rng.random() == np.random.default_rng(0).random()


def test_an_environment_draws_anew_at_each_start_and_repeats_itself():
    config = EnvConfig(
        randomisation=Randomisation(friction=(0.4, 1.0), payload=(-3.0, 3.0)), episode_steps=5
    )
    runs = []
    for _ in range(2):
        env = GaitEnv(gaits.load("trot"), GROUND, 4, config=config)
        env.reset(seed=7)
        first = drawn(env.world, "friction")
        rewards = [env.step(np.zeros((4, 12)))[1] for _ in range(8)]
        assert (drawn(env.world, "friction") != first).all()
        runs.append((first, rewards))
    np.testing.assert_array_equal(runs[0][0], runs[1][0])
    np.testing.assert_array_equal(runs[0][1], runs[1][1])


@pytest.mark.parametrize(
    ("ranges", "says"),
    [
        ({"friction": (1.0, 0.4)}, "friction must be two numbers, rising, within 0.01 to 5, got"),
        ({"payload": (0.0, float("nan"))}, "payload must be two numbers"),
        ({"kp": (0.0, 1.0)}, "kp must be two numbers, rising, within 0.05 to 10, got [0.0, 1.0]"),
        ({"softness": (0.5, 1.0)}, "softness must be"),
    ],
)
def test_ranges_that_cannot_be_are_refused(ranges, says):
    with pytest.raises(GaitshiftError, match=re.escape(says)):
        Randomisation(**ranges)


def test_a_payload_that_leaves_no_base_is_refused():
    world = World(ANYMAL_B, GROUND, 1, randomisation=Randomisation(payload=(-18.0, -18.0)))
    with pytest.raises(GaitshiftError, match="payload must leave the base a mass above 0, got -18"):
        world.redraw(np.arange(1), np.random.default_rng(0))
