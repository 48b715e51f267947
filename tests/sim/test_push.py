"""Pushes: against mechanics and the law of their times."""

import numpy as np

from gaitshift.sim.push import PushConfig, Pusher
from worlds import (
    GRAVITY,
    MASS,
    PERIOD,
    UP,
    assert_same_bits,
    fly,
    plain,
    robots,
    run,
    stand,
    wild_targets,
)


def test_a_push_gives_the_mass_centre_its_force_over_mass():
    """100 N along world x for 0.3 s of flight, whatever the heading and whatever the legs do.

    Within 0.02 m/s: the integrator's error, which halves with its step.
    """
    force, duration = np.array([100.0, 0.0, 0.0]), 0.3
    world = fly(3, yaw=[0.0, 1.0, -2.0])
    before = [plain(world, i).subtree_linvel[1].copy() for i in range(3)]
    world.push(np.tile(force, (3, 1)))
    run(world, wild_targets(3, round(duration / PERIOD)))
    weight = np.array([0.0, 0.0, -MASS * GRAVITY])
    for i in range(3):
        gained = plain(world, i).subtree_linvel[1] - before[i]
        np.testing.assert_allclose(gained, (force + weight) / MASS * duration, rtol=0, atol=0.02)


def test_a_push_acts_at_the_base_origin():
    """It turns the robot by its lever arm about the mass centre, 2.6 cm below the origin."""
    force = np.array([60.0, 100.0, 30.0])
    world = fly(2, yaw=[0.5, -2.0])
    turned = np.zeros((2, 3))
    world.push(np.tile(force, (2, 1)))
    for _ in range(10):
        for i in range(2):
            data = plain(world, i)
            turned[i] += np.cross(data.xpos[1] - data.subtree_com[1], force) * PERIOD
        stand(world, 1)
    for i in range(2):
        np.testing.assert_allclose(plain(world, i).subtree_angmom[1], turned[i], atol=0.005)
    assert np.linalg.norm(turned, axis=1).min() > 0.3


def test_pushes_last_20_steps_200_apart_and_begin_anywhere_in_the_first_180():
    """One robot in 180 is pushed in the very first step; binomial, five standard deviations."""
    n = 10_000
    pusher = Pusher(PushConfig(force=50.0), n, np.random.default_rng(7))
    pushed = np.array([pusher.step().any(axis=1) for _ in range(400)])
    first = pushed.argmax(axis=0)
    step_of = (np.arange(400)[:, None] - first) % 200
    np.testing.assert_array_equal(pushed, (np.arange(400)[:, None] >= first) & (step_of < 20))
    assert (first.min(), first.max()) == (0, 179)
    share, deviation = 1 / 180, np.sqrt(1 / 180 * 179 / 180 / n)
    shares = np.bincount(first, minlength=180) / n
    assert np.abs(shares - share).max() < 5 * deviation
    assert abs(pushed[0].mean() - share) < 5 * deviation


def test_a_push_ends_with_the_next_call():
    pushed, alone = (robots(2, base_velocity_w=UP) for _ in range(2))
    pushed.push(np.full((2, 3), 50.0))
    pushed.push(np.zeros((2, 3)))
    assert_same_bits(stand(pushed, 10), stand(alone, 10))
