"""A robot and its controller driven in lock-step through their datagrams, without any real time."""

import numpy as np

from gaitshift.control import Autonomous, Driver, Scheduled
from gaitshift.control.deployment import Deployment, DeploymentConfig
from gaitshift.control.deployment.datagram import Sensors, decode_command, encode_sensors
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.state import Proprioception
from gaitshift.sim.simulated_robot import SimulatedRobot
from gaitshift.sim.world import World
from sensing import FEET

PERIOD = 0.01
ANGLES = ANYMAL_B.stance_angles + 0.01 * np.arange(12)
"""Joint angles unlike for each joint [rad]."""


def simulated(terrain, *, start=(1.5, 0.0), noise=None, watchdog=0.05, gains="default"):
    """A robot at rest on a terrain; `noise` is added to its stance [rad]."""
    world = World(ANYMAL_B, terrain, 1, gains=gains, threads=1)
    joints = ANYMAL_B.stance_angles + (np.zeros((1, 12)) if noise is None else noise)
    world.place(np.arange(1), xy=np.array([start]), yaw=np.zeros(1), joint_position=joints)
    return SimulatedRobot(world, gains=gains, watchdog=watchdog)


def trotting(**config):
    """A deployment that trots and never shifts."""
    return Deployment(Driver.load(("trot",), 1), Scheduled(()), DeploymentConfig(**config))


def shifting(graph, **config):
    """A deployment that shifts by this graph."""
    driver = Driver.load(graph.gaits, 1)
    return Deployment(driver, Autonomous(graph, 1), DeploymentConfig(**config))


def exchange(deployment, robot, steps, see=lambda: None):
    """Control steps in which no datagram is late or lost; `see` is called before each."""
    for _ in range(steps):
        now = PERIOD * robot.inbox.counts.accepted
        deployment.receive(robot.sensors(now), now)
        answer = deployment.step(now)
        if answer is not None:
            robot.receive(answer, now)
        see()
        robot.step(now)


def standing_sensed(angles=ANGLES, **others):
    """What a robot measures that stands still."""
    given = {
        "contact": np.array([[True, True, False, True]]),
        "foot_position_b": FEET[None].copy(),
        "orientation": np.array([[1.0, 0.0, 0.0, 0.0]]),
        "joint_position": angles[None],
        "joint_velocity": np.zeros((1, 12)),
        "joint_torque": np.arange(12.0)[None],
        "velocity_b": np.array([[0.1, -0.2, 0.3]]),
        "angular_velocity_b": np.array([[-0.1, 0.2, 0.4]]),
    }
    return Proprioception(**given | others)


def standing(sequence, now, **others):
    """The datagram of a robot that stands still."""
    sensed = standing_sensed(**others)
    return encode_sensors(
        Sensors(sequence=sequence, stamp=int(1e9 * now) + 1, acknowledged=0, sensed=sensed)
    )


def walked(deployment, steps, **others):
    """The commands of so many steps on a robot that stands still, each answered in time."""
    commands = []
    for number in range(1, steps + 1):
        now = PERIOD * number
        deployment.receive(standing(number, now, **others), now)
        commands.append(decode_command(deployment.step(now)))
    return commands
