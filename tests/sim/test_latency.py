"""The way of joint targets to the joints: late by whole physics steps, out of order, lost."""

import mujoco
import numpy as np
import pytest

from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.latency import Latency
from gaitshift.sim.sensor_config import SensorConfig
from worlds import PERIOD, PHYSICS_STEP, STANCE, assert_same_bits, fly, plain, run, wild_targets

STEPS = 4
"""Physics steps of a control step."""
HELD = -1
"""Number of the target that joints hold at the start."""


def link(n, *, seed=0, **config):
    made = Latency(
        SensorConfig(**config),
        n,
        physics_step=PHYSICS_STEP,
        rng=np.random.default_rng(seed),
    )
    made.restart(np.arange(n), np.full((n, 12), float(HELD)))
    return made


def followed(made, sent):
    """The number of the target that each robot follows in each physics step (T, N)."""
    rows = []
    for number in range(sent):
        parts = made.send(np.full((made.n, 12), float(number)))
        assert sum(steps for steps, _ in parts) == STEPS
        for steps, target in parts:
            assert (target == target[:, :1]).all()
            rows += [target[:, 0].copy()] * steps
    return np.array(rows).astype(int)


@pytest.mark.parametrize("late", range(10))
def test_a_delay_is_exact_in_physics_steps(late):
    """The target of control step m is followed from physics step 4 m + late on."""
    delay = late * PHYSICS_STEP
    seen = followed(link(3, delay=(delay, delay), loss=1e-12), 30)
    step = np.arange(len(seen)) - late
    np.testing.assert_array_equal(seen, np.tile(np.maximum(step // STEPS, HELD)[:, None], 3))


def test_each_robot_has_its_own_delay_within_the_range_and_keeps_it():
    made = link(400, delay=(0.005, 0.02))
    seen = followed(made, 40)
    first = (seen == 0).argmax(axis=0)
    assert set(first) == set(range(2, 9))
    np.testing.assert_array_equal(seen[20:], np.arange(20, 160)[:, None] - first >> 2)


def test_jitter_is_uniform_about_the_delay():
    """± 2 physics steps about 3: half as many are rounded to 1 as to 2 or 3, and 3/8 come later."""
    seen = followed(link(4000, delay=(0.0075, 0.0075), jitter=0.005), 1)
    first = np.where(seen[-1] == 0, (seen == 0).argmax(axis=0), STEPS)
    share = np.bincount(first, minlength=5) / 4000
    np.testing.assert_allclose(share, [0.0, 1 / 8, 1 / 4, 1 / 4, 3 / 8], rtol=0, atol=0.025)


def test_a_target_that_a_later_one_overtakes_is_never_followed():
    """With jitter over several control steps, numbers of targets never fall."""
    seen = followed(link(50, delay=(0.03, 0.03), jitter=0.03), 300)
    assert (np.diff(seen, axis=0) >= 0).all()
    skipped = 300 - np.array([len(np.unique(robot)) for robot in seen.T])
    assert skipped.min() > 30


def test_jitter_does_not_deliver_before_the_sending():
    seen = followed(link(50, delay=(0.0, 0.0), jitter=0.03), 100)
    assert (seen <= np.arange(400)[:, None] // STEPS).all()


def test_lost_targets_have_their_share_and_the_last_one_is_held():
    """Within three standard errors, and as often in a row as by chance."""
    share, sent = 0.2, 2000
    seen = followed(link(20, delay=(0.0, 0.0), loss=share), sent)[::STEPS]
    lost = seen != np.arange(sent)[:, None]
    assert lost.mean() == pytest.approx(share, abs=3 * np.sqrt(share * 0.8 / lost.size))
    both = (lost[1:] & lost[:-1]).mean()
    assert both == pytest.approx(share**2, abs=3 * np.sqrt(share**2 / lost.size))
    np.testing.assert_array_equal(seen[1:][lost[1:]], seen[:-1][lost[1:]])


def test_a_restarted_robot_forgets_targets_on_their_way():
    made = link(3, delay=(0.02, 0.02))
    followed(made, 5)
    made.restart(np.array([1]), np.full((1, 12), -7.0))
    seen = followed(made, 3)
    np.testing.assert_array_equal(seen[:8, 1], -7)
    np.testing.assert_array_equal(seen[:8, 0], np.repeat([3, 4], STEPS))


def test_the_same_seed_gives_the_same_bits():
    config = {"delay": (0.0, 0.02), "jitter": 0.004, "loss": 0.1}
    once, again, other = (followed(link(6, seed=seed, **config), 50) for seed in (3, 3, 4))
    np.testing.assert_array_equal(once, again)
    assert (once != other).any()


def late_run(world, targets, late):
    """A plain MuJoCo simulation of robot 0 with targets that arrive some physics steps late."""
    data = plain(world)
    held = data.qpos[7:].copy()
    for step in range(STEPS * len(targets)):
        sent = (step - late) // STEPS
        data.ctrl[:] = held if sent < 0 else targets[sent, 0]
        mujoco.mj_step(world.model, data)
    return data.qpos.copy()


@pytest.mark.parametrize("late", [1, 4, 7])
def test_a_robot_follows_late_targets_as_in_mujoco(late):
    delay = late * PHYSICS_STEP
    config = SensorConfig(delay=(delay, delay))
    world = fly(1, yaw=[0.3], sensors=config)
    world.set_state(*world.state())  # the joints hold still where they are
    targets = wild_targets(1, 20)
    expected = late_run(world, targets, late)
    run(world, targets)
    np.testing.assert_allclose(world.state()[0][0], expected, rtol=0, atol=1e-9)


def test_robots_with_other_delays_do_not_change_a_robot():
    """A control step that is cut where others' targets arrive gives it the same bits."""
    alike, mixed = (
        fly(9, sensors=SensorConfig(delay=delay), yaw=np.zeros(9), xy=np.zeros((9, 2)))
        for delay in ((0.005, 0.005), (0.0, 0.01))
    )
    targets, start = np.tile(wild_targets(1, 40), (1, 9, 1)), alike.state()
    for world in (alike, mixed):
        world.set_state(*start)
        run(world, targets)
    difference = np.abs(mixed.state()[0] - alike.state()[0][0]).max(axis=1)
    assert (difference == 0.0).any()
    assert (difference > 1e-3).any()


def test_targets_that_all_arrive_at_once_give_the_bits_of_a_perfect_link():
    n, targets = 4, wild_targets(4, 30)
    assert_same_bits(run(fly(n), targets), run(fly(n, sensors=SensorConfig(loss=1e-12)), targets))


def test_a_robot_stands_with_late_targets():
    """With the stance as its target it stays up and in its stance, however late the target is."""
    world = fly(2, sensors=SensorConfig(delay=(0.0, 0.03), jitter=0.005, loss=0.05))
    for _ in range(round(3.0 / PERIOD)):
        world.step(np.tile(STANCE, (2, 1)))
    assert world.sensed.contact.all()
    assert np.abs(world.sensed.joint_position - ANYMAL_B.stance_angles).max() < 0.2
