"""The simulated robot behind datagrams: what it follows, and how it stops."""

from dataclasses import replace

import numpy as np
import pytest

from gaitshift.control.deployment.datagram import decode_command, decode_sensors, encode_command
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.simulated_robot import SimulatedRobot
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import World
from lockstep import PERIOD, exchange, simulated, trotting

STANCE = ANYMAL_B.stance_angles
SPREAD = np.linspace(-0.2, 0.2, 12)


def ground():
    return flat(40.0, 8.0)


def steps(robot, count, begin=0.0):
    for number in range(count):
        robot.step(begin + PERIOD * number)


def energy(robot):
    """Of a robot's motion, but for the mass of its parts [m²/s² and rad²/s²]."""
    return float((robot.world.state()[1] ** 2).sum())


def test_it_stands_until_the_first_command():
    robot = simulated(ground())
    steps(robot, 100)
    assert not robot.is_driven
    assert robot.world.sensed.contact.all()
    assert np.abs(robot.world.sensed.joint_position - STANCE).max() < 0.2


def test_its_sensors_are_those_of_its_world():
    robot = simulated(ground(), noise=SPREAD[None])
    steps(robot, 3)
    got = decode_sensors(robot.sensors(0.03))
    for name in ("contact", "foot_position_b", "joint_position", "joint_torque", "velocity_b"):
        np.testing.assert_array_equal(getattr(got.sensed, name), getattr(robot.world.sensed, name))
    assert (got.sequence, got.stamp, got.acknowledged) == (1, 30_000_000, 0)


def commanded(robot, deployment, count=30):
    exchange(deployment, robot, count)
    return PERIOD * count


def test_silence_damps_the_joints_for_good_and_it_comes_to_rest():
    robot, deployment = simulated(ground()), trotting()
    now = commanded(robot, deployment)
    late = deployment.step(now)
    steps(robot, 6, now)
    assert robot.is_lost
    assert decode_sensors(robot.sensors(now + 0.06)).is_stopped
    robot.receive(late, now + 0.06)
    height = robot.world.truth.base_position_w[0, 2]
    steps(robot, 1000, now + 0.07)
    assert robot.is_over
    assert robot.is_damped
    assert energy(robot) < 0.01
    assert robot.world.truth.base_position_w[0, 2] < height - 0.1  # it lies
    assert np.abs(robot.world.sensed.joint_torque).max() < 1.0


def test_it_is_not_stopped_a_step_too_early():
    robot, deployment = simulated(ground()), trotting()
    now = commanded(robot, deployment)
    steps(robot, 5, now)  # the last command came 10 to 50 ms before
    assert robot.is_driven


def test_a_stop_of_its_controller_is_no_fault():
    robot, deployment = simulated(ground()), trotting()
    now = commanded(robot, deployment)
    deployment.stop(now)
    exchange(deployment, robot, 110)
    assert deployment.is_over
    steps(robot, 220, PERIOD * 150)
    assert robot.is_over
    assert not robot.is_lost


def test_after_a_stop_no_other_command_is_followed():
    robot, deployment = simulated(ground()), trotting()
    now = commanded(robot, deployment)
    walking = decode_command(deployment.step(now))
    deployment.stop(now + PERIOD)
    robot.receive(deployment.step(now + PERIOD), now + PERIOD)
    wild = replace(walking, sequence=walking.sequence + 9, stamp=walking.stamp + 10**9)
    robot.receive(encode_command(wild), now + PERIOD)
    assert robot.inbox.newest.is_stop
    assert robot.inbox.counts.late == 1


def test_answers_to_sensors_long_past_or_never_sent_are_dropped():
    robot, deployment = simulated(ground()), trotting()
    now = commanded(robot, deployment, 10)
    answer = decode_command(deployment.step(now))
    for _ in range(20):
        robot.sensors(now)
    robot.receive(encode_command(answer), now)
    assert robot.inbox.counts.late == 1
    robot.receive(encode_command(replace(answer, answered=10**6)), now)
    assert robot.inbox.counts.malformed == 1


@pytest.mark.parametrize(("kp", "kd"), [(80.0, 2.0), (30.0, 2.0), (60.0, 3.0), (0.0, 2.0)])
def test_any_gains_give_their_torques_at_the_start_of_a_step(kp, kd):
    """Against the torques of a world that has these gains in its model."""
    robot, deployment = simulated(ground()), trotting()
    now = commanded(robot, deployment, 15)
    command = decode_command(deployment.step(now))
    target = robot._driven(command.target, kp, kd)
    own = robot.world.sensed
    position, velocity = own.joint_position[0], own.joint_velocity[0]
    np.testing.assert_allclose(
        80.0 * (target - position) - 2.0 * velocity,
        kp * (command.target - position) - kd * velocity,
        atol=1e-9,
    )
    if (kp, kd) == (80.0, 2.0):
        np.testing.assert_array_equal(target, command.target)


def test_it_is_one_robot_with_a_watchdog_in_range():
    with pytest.raises(GaitshiftError, match="got 2"):
        SimulatedRobot(World(ANYMAL_B, ground(), 2, threads=1), gains="default", watchdog=0.05)
    with pytest.raises(GaitshiftError, match="watchdog"):
        simulated(ground(), watchdog=0.0)
