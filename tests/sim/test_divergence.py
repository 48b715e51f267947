"""Simulations that diverge are noticed: the robot has failed, and no other robot is touched."""

import logging

import numpy as np
import pytest

from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.evaluation import EvaluationConfig, evaluate
from gaitshift.lab.evaluation.divergence import divergence_log
from gaitshift.robot.description import ANYMAL_B
from gaitshift.show.report import write_report
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.world import World
from worlds import (
    LEVEL,
    ROUGH,
    arrays_of,
    assert_same_bits,
    robots,
    run,
    throw_apart,
    wild_targets,
)

TROT = gaits.load("trot")


@pytest.mark.parametrize("value", [1e6, 1e12, 1e30, np.nan])
def test_a_diverged_robot_is_marked_and_set_down_where_it_was(value):
    world = robots(3, terrain=ROUGH)
    run(world, wild_targets(3, 20))
    before, yaw = world.truth.base_position_w, world.sensed.yaw
    throw_apart(world, 1, value)
    sensed, truth = run(world, wild_targets(3, 1))
    np.testing.assert_array_equal(truth.diverged, [False, True, False])
    np.testing.assert_allclose(truth.base_position_w[1, :2], before[1, :2])
    np.testing.assert_allclose(sensed.yaw[1], yaw[1])
    np.testing.assert_allclose(truth.clearance[1].min(), 0.0, atol=1e-12)
    assert all(np.isfinite(a).all() for a in arrays_of(sensed, truth).values() if a.dtype != bool)
    assert not run(world, wild_targets(3, 1))[1].diverged.any()


def test_a_diverged_robot_leaves_the_bits_of_the_others_alone():
    world, twin = robots(4, terrain=ROUGH), robots(4, terrain=ROUGH)
    targets = wild_targets(4, 20)
    for each in (world, twin):
        run(each, targets[:10])
    throw_apart(world, 2)
    for target in targets[10:]:
        world.step(target)
        twin.step(target)
        kept = np.array([0, 1, 3])
        for record, other in ((world.sensed, twin.sensed), (world.truth, twin.truth)):
            assert_same_bits([record.robots(kept)], [other.robots(kept)])


def test_the_last_second_before_a_divergence_is_kept():
    """The states that the world had before each of the last 100 steps."""
    world = robots(2)
    states = []
    for target in wild_targets(2, 130):
        states.append(world.state())
        world.step(target)
    states.append(world.state())
    throw_apart(world, 1)
    run(world, wild_targets(2, 1))
    (lost,) = world.divergences
    assert lost.robot == 1
    for kept, index in ((lost.qpos, 0), (lost.qvel, 1)):
        expected = np.array([state[index][1] for state in states[-100:]])
        np.testing.assert_allclose(kept, expected, rtol=1e-6, atol=1e-6)


def test_what_is_kept_begins_where_the_robot_was_placed():
    world = robots(2)
    run(world, wild_targets(2, 30))
    ids = np.array([1])
    world.place(ids, xy=np.zeros((1, 2)), yaw=np.zeros(1))
    run(world, wild_targets(2, 7))
    throw_apart(world, 1)
    run(world, wild_targets(2, 1))
    assert len(world.divergences[0].qpos) == 8


def test_a_robot_that_diverges_again_and_again_goes_on_and_is_named_a_few_times(caplog):
    world = robots(2)
    with caplog.at_level(logging.WARNING):
        for target in wild_targets(2, 20):
            throw_apart(world, 1)
            assert world.step(target)[1].diverged.tolist() == [False, True]
    assert [record.args[0] for record in caplog.records] == [1] * 8
    assert len(world.divergences) == 8


def test_no_file_of_mujoco_appears_in_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    world = robots(2)
    throw_apart(world, 0)
    assert run(world, wild_targets(2, 1))[1].diverged[0]
    assert list(tmp_path.iterdir()) == []


def test_an_episode_ends_where_its_robot_diverges():
    env = GaitEnv(TROT, LEVEL, 3, threads=1)
    env.reset(seed=0)
    throw_apart(env.world, 1)
    observation, reward, terminated, truncated, info = env.step(np.zeros((3, 12)))
    np.testing.assert_array_equal(terminated, [False, True, False])
    np.testing.assert_array_equal(info["diverged"], terminated)
    assert not truncated.any()
    for array in (observation, reward, info["final_obs"]):
        assert np.isfinite(array).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e30])
@pytest.mark.parametrize(
    "part", ["xy", "yaw", "joint_position", "joint_velocity", "base_velocity_w", "attitude"]
)
def test_a_place_that_is_no_place_is_refused_and_nothing_moves(part, bad):
    world = robots(2)
    run(world, wild_targets(2, 3))
    before = world.state(), (world.sensed, world.truth)
    sizes = {"xy": 2, "joint_position": 12, "joint_velocity": 12, "base_velocity_w": 3}
    given = {"xy": np.zeros((2, 2)), "yaw": np.zeros(2)}
    given[part] = np.zeros((2, sizes[part])) if part in sizes else np.zeros(2)
    if part == "attitude":
        given[part] = np.tile((1.0, 0.0, 0.0, 0.0), (2, 1))
    given[part].reshape(2, -1)[1, -1] = bad
    with pytest.raises(GaitshiftError, match=r"for robot 1$"):
        world.place(np.arange(2), **given)
    np.testing.assert_array_equal(before[0][0], world.state()[0])
    assert before[1] == (world.sensed, world.truth)


@pytest.mark.parametrize("bad", [np.nan, -np.inf, 1e30])
def test_a_push_that_is_no_force_is_refused_and_the_one_before_goes_on(bad):
    world, twin = robots(2), robots(2)
    for each in (world, twin):
        each.push(np.full((2, 3), 50.0))
    with pytest.raises(GaitshiftError, match=r"forces must be -10000 to 10000 N, got .* robot 1"):
        world.push(np.array([[0.0, 0.0, 0.0], [0.0, bad, 0.0]]))
    targets = wild_targets(2, 5)
    assert_same_bits(run(world, targets), run(twin, targets))


def test_a_divergence_is_replayed_as_the_states_that_were_kept(tmp_path):
    world = robots(2, terrain=ROUGH)
    run(world, wild_targets(2, 40))
    throw_apart(world, 1)
    run(world, wild_targets(2, 1))
    (lost,) = world.divergences
    log = divergence_log(lost, ANYMAL_B, TROT)
    log.save(tmp_path / "log.npz")
    read = type(log).load(tmp_path / "log.npz")
    assert read.qpos.shape == (41, 1, 19)
    np.testing.assert_allclose(read.qpos[:, 0], lost.qpos, rtol=0, atol=1e-6)
    assert read.gaits == ("trot",)
    np.testing.assert_array_equal(read.terrain_height, ROUGH.height)
    write_report(read, tmp_path / "index.html")
    assert (tmp_path / "index.html").stat().st_size > 100_000


def test_robots_that_diverge_count_as_fallen_in_an_evaluation(monkeypatch):
    """Robots 1 and 3 of five diverge in step 20; nobody else falls in half a second."""
    step, calls = World.step, []

    def wild(world, target):
        calls.append(1)
        if len(calls) == 20:
            throw_apart(world, [1, 3])
        return step(world, target)

    monkeypatch.setattr(World, "step", wild)
    figures, log = evaluate(policy.load("trot"), EvaluationConfig(episodes=5, seconds=0.5))
    assert figures["diverged"] == 2
    assert figures["survival"] == pytest.approx(3 / 5)
    fell = np.zeros((50, 5), dtype=bool)
    fell[19:, [1, 3]] = True
    np.testing.assert_array_equal(log.fallen, fell)
