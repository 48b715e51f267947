"""Deployment recorded: in lock-step it is the in-process run to the bit; its logs are read."""

from dataclasses import fields

import numpy as np
import pytest

from gaitshift import table
from gaitshift.control import Autonomous, Driver
from gaitshift.control.deployment import Timing
from gaitshift.lab.deployment import RobotRecorder, SensedTable, run_robot
from gaitshift.lab.evaluation import RolloutConfig
from gaitshift.lab.evaluation.rollout import Walk
from gaitshift.lab.identification import passages
from gaitshift.lab.log import Log
from gaitshift.robot.command import HeadingLoop
from gaitshift.robot.description import ANYMAL_B
from gaitshift.shift import load_graph
from gaitshift.sim.channel import Channel, ChannelConfig
from gaitshift.sim.terrain import flat, from_spec
from gaitshift.sim.world import World
from lockstep import PERIOD, exchange, shifting, simulated, trotting

STEPS = 400
SPEED = 1.1


@pytest.fixture(scope="module")
def ground():
    return from_spec("flat@2.5,perlin:0.12@5,flat@3", seed=2, length=1.0, width=8.0)


@pytest.fixture(scope="module")
def in_process(ground):
    """Targets, gaits and x of an ordinary walk, and its start."""
    graph = load_graph()
    driver = Driver.load(graph.gaits, 1)
    act, targets, gaits = driver.act, [], []

    def told(sensed, command):
        targets.append(act(sensed, command)[0])
        return targets[-1][None].copy()

    driver.act = told
    walk = Walk(
        World(ANYMAL_B, ground, 1, threads=1),
        driver,
        RolloutConfig(seconds=9.0, speed=SPEED, heading_loop=HeadingLoop(lateral_gain=0.0)),
        start_xy=np.array([[1.5, 0.0]]),
        rng=np.random.default_rng(5),
        switcher=Autonomous(graph, 1),
    )
    start = walk.world.state()[0][:, 7:] - ANYMAL_B.stance_angles
    for _ in range(STEPS):
        walk.step()
        gaits.append(int(driver.gait[0]))
    return np.array(targets), gaits, walk.world.truth, start


@pytest.fixture(scope="module")
def behind_datagrams(ground, in_process):
    """The same walk behind datagrams: targets, gaits, robot, its log, the controller's table."""
    deployment = shifting(load_graph(), speed=SPEED)
    robot = simulated(ground, noise=in_process[3])
    recorder = RobotRecorder(robot)
    kept, targets, gaits = SensedTable(deployment.controller.repertoire.gaits), [], []

    def see():
        recorder.add()
        kept.add(deployment.last)
        targets.append(deployment.last.target)
        gaits.append(deployment.last.gait)

    exchange(deployment, robot, STEPS, see)
    return np.array(targets), gaits, robot, recorder.log(), kept


def test_in_lock_step_targets_have_the_bits_of_the_run_in_one_process(in_process, behind_datagrams):
    targets, gaits, truth, _ = in_process
    got, shifted, robot, _, _ = behind_datagrams
    assert set(gaits) == {0, 1}
    assert shifted[1:] == gaits[:-1]
    np.testing.assert_array_equal(got, targets)
    for field in fields(truth):
        np.testing.assert_array_equal(
            getattr(robot.world.truth, field.name), getattr(truth, field.name), field.name
        )


def test_the_robots_log_has_the_truth_and_what_the_controller_decided(behind_datagrams, tmp_path):
    _, gaits, _, log, _ = behind_datagrams
    log.save(tmp_path / "log.npz")
    read = Log.load(tmp_path / "log.npz")
    assert read.gaits == load_graph().gaits
    assert read.gait[:, 0].tolist() == gaits
    assert read.k.max() > read.threshold[read.k[:, 0].argmax(), 0] > 0.0
    np.testing.assert_allclose(read.time, PERIOD * np.arange(1, STEPS + 1))
    assert (read.sensed.forward_speed_command == np.float32(SPEED)).all()
    assert np.ptp(read.truth.base_position_w[:, 0, 0]) > 2.0


def test_the_controllers_table_is_one_of_any_robot(behind_datagrams, tmp_path):
    targets, gaits, _, log, kept = behind_datagrams
    path = tmp_path / "sensed.csv"
    kept.write(path)
    rows = table.read(path)
    assert len(rows) == STEPS
    written = np.array(
        [[float(row[f"target_{name}"]) for name in ANYMAL_B.joint_names] for row in rows]
    )
    np.testing.assert_array_equal(written, targets)
    assert [load_graph().gaits.index(row["gait"]) for row in rows] == gaits
    assert [int(row["sequence"]) for row in rows] == list(range(1, STEPS + 1))
    pytest.importorskip("pyarrow")
    labelled = [{**row, "rough": int(float(row["time"]) > 1.0)} for row in rows]
    table.write(tmp_path / "labelled.csv", labelled)
    (run,) = passages(tmp_path / "labelled.csv")
    np.testing.assert_array_equal(run.sensed.contact, log.sensed.contact)
    for name in ("foot_position_b", "joint_position", "joint_torque", "velocity_b", "gravity_b"):
        np.testing.assert_allclose(
            getattr(run.sensed, name), getattr(log.sensed, name), atol=2e-5, err_msg=name
        )
    np.testing.assert_allclose(run.sensed.yaw, log.sensed.yaw, atol=2e-5)


def test_a_table_of_no_step_is_a_file_without_rows(tmp_path):
    SensedTable(("trot",)).write(tmp_path / "sensed.csv")
    assert table.read(tmp_path / "sensed.csv") == []


class Controlled:
    """The link of a robot to a deployment under a fake clock; commands take no time."""

    def __init__(self, deployment, *, stop_after):
        self.time, self._deployment, self._stop_after = 0.0, deployment, stop_after
        self._answers, self.sent_at = [], []

    def now(self):
        return self.time

    def receive(self, until):
        self.time = max(self.time, until)
        answers, self._answers = self._answers, []
        return [(data, at) for data, at in answers]

    def send(self, data):
        self.sent_at.append(self.time)
        if self.time >= self._stop_after:
            self._deployment.stop(self.time)
        if self._deployment.inbox.newest is not None and self._deployment.is_over:
            return
        self._deployment.receive(data, self.time)
        answer = self._deployment.step(self.time)
        if answer is not None:
            self._answers.append((answer, self.time))


def robot_run(seconds, watchdog=0.05, **config):
    """A robot driven under a fake clock through channels, until its controller has stopped."""
    deployment = trotting(watchdog=watchdog)
    robot, link, timing = simulated(flat(40.0, 8.0), watchdog=watchdog), None, Timing()
    link = Controlled(deployment, stop_after=seconds)
    recorder = RobotRecorder(robot)
    ways = [Channel(ChannelConfig(**config), rng) for rng in np.random.default_rng(0).spawn(2)]
    run_robot(robot, link, sensors=ways[0], commands=ways[1], timing=timing, see=recorder.add)
    return robot, deployment, recorder.log(), timing


def test_a_robot_in_real_time_walks_until_its_controller_stops_and_then_lies_down():
    robot, deployment, log, timing = robot_run(3.0)
    assert not robot.is_lost
    assert deployment.fault == ""
    walked = log.truth.base_position_w[:, 0, 0]
    assert walked[290] - walked[0] > 2.0
    assert timing.misses == 0
    assert len(timing.work) == pytest.approx(300 + 100 + 5 + 6 + 200, abs=3)
    assert np.abs(log.truth.velocity_b[-1]).max() < 0.1
    assert not log.fallen.any()


def test_a_trot_survives_delay_disorder_and_loss():
    """Two control steps of delay in all, one datagram in twenty lost."""
    robot, deployment, log, _ = robot_run(4.0, delay=0.008, jitter=0.012, loss=0.05, watchdog=0.2)
    assert not robot.is_lost
    assert deployment.fault == ""
    assert robot.inbox.counts.late > 0
    assert robot.inbox.counts.malformed == 0
    lost = 1.0 - robot.inbox.counts.accepted / len(log.time)
    assert lost > 0.02
    walked = log.truth.base_position_w[:, 0, 0]
    assert walked[390] - walked[0] > 2.5
    assert not log.fallen.any()


def test_where_most_datagrams_are_lost_both_sides_stop():
    robot, deployment, log, _ = robot_run(30.0, loss=0.9)
    assert robot.is_over
    assert robot.is_lost or deployment.fault
    assert len(log.time) < 700
