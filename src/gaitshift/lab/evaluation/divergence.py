"""The last second before a simulation diverged, as a log to replay."""

from dataclasses import replace

import numpy as np

from gaitshift.gait import RewardMachine
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import Robot
from gaitshift.sim.world import Divergence, World


def divergence_log(divergence: Divergence, robot: Robot, machine: RewardMachine) -> Log:
    """The log of one robot whose last entry is the state before the step that diverged.

    Poses and velocities are those of the run. Forces, torques and contacts are computed from them
    with the joint targets at the joint angles, and the machine's state from the contacts.
    """
    steps, terrain = len(divergence.qpos), divergence.terrain
    world = World(robot, terrain, steps)  # one robot for each entry
    world.set_state(divergence.qpos.astype(float), divergence.qvel.astype(float))
    contact = world.sensed.contact
    state = machine.enter(contact)
    entries = Log(
        sensed=world.sensed,
        truth=world.truth,
        k=np.zeros(steps),
        threshold=np.zeros(steps),
        gait=np.zeros(steps, dtype=np.int64),
        machine_state=state,
        stance_shown=machine.shows_stance(contact),
        fallen=np.zeros(steps, dtype=bool),
        gaits=(machine.name,),
        robot=robot.name,
        terrain=terrain.name,
        terrain_height=terrain.height,
        terrain_size=np.array(terrain.size),
        terrain_origin=np.array(terrain.origin),
    )
    log = entries[:, None]  # N robots of one instant become N instants of one robot
    times = CONTROL_PERIOD * np.arange(1, steps + 1)
    return replace(log, sensed=replace(log.sensed, time=times))
