"""The simulated robot in real time over a link, and its log with the truth."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gaitshift.control.deployment import Link, Timing
from gaitshift.control.deployment.timing import Pace, uninterrupted
from gaitshift.lab.log import Log
from gaitshift.robot.command import COMMAND_PARTS, CONTROL_PERIOD
from gaitshift.sim.channel import Channel
from gaitshift.sim.simulated_robot import SimulatedRobot


class RobotRecorder:
    """Collects the log of a simulated robot from its first command on, in single precision.

    The robot knows sensors and truth. Gait, machine, counters and commanded speeds are those that
    its controller sends with each command; an entry holds those of the newest command, which is
    the answer to the entry's sensors where the link has no delay.
    """

    def __init__(self, robot: SimulatedRobot) -> None:
        self._robot = robot
        self._steps: list[Log] = []
        self._gaits: list[str] = []
        self._fallen = np.zeros(1, dtype=bool)

    def add(self) -> None:
        """Records the present state, before the control step that the newest command drives."""
        robot, world = self._robot, self._robot.world
        command = robot.inbox.newest
        if command is None:
            return
        decided, terrain = command.decision, world.terrains[0]
        if decided.gait not in self._gaits:
            self._gaits.append(decided.gait)
        if robot.is_driven and not command.is_stop:
            self._fallen = self._fallen | world.truth.body_contact | world.truth.diverged
        sensed = world.sensed.having(
            time=(len(self._steps) + 1) * CONTROL_PERIOD,
            **{f"{n}_command": np.array([getattr(decided, n)]) for n in COMMAND_PARTS},
        )
        self._steps.append(
            Log(
                sensed=sensed.as_type(np.float32),
                truth=world.truth.as_type(np.float32),
                k=np.array([decided.k]),
                threshold=np.array([decided.threshold]),
                gait=np.array([self._gaits.index(decided.gait)]),
                machine_state=np.array([decided.machine_state]),
                stance_shown=np.array([decided.stance_shown]),
                fallen=self._fallen,
                gaits=(),
                robot=world.robot.name,
                terrain=terrain.name,
                terrain_height=terrain.height,
                terrain_size=np.array(terrain.size),
                terrain_origin=np.array(terrain.origin),
            )
        )

    def log(self) -> Log | None:
        """The log so far; None before the first command."""
        if not self._steps:
            return None
        return replace(Log.stack(self._steps), gaits=tuple(self._gaits))


def run_robot(
    robot: SimulatedRobot,
    link: Link,
    *,
    sensors: Channel,
    commands: Channel,
    timing: Timing,
    see: Callable[[], None] = lambda: None,
) -> None:
    """Runs a robot in real time until it has stopped and come to rest.

    `sensors` and `commands` are the ways to its controller and back. `see` is called before each
    control step. A command that arrives during a step acts on the whole of it, since the step is
    simulated at its end.
    """
    with uninterrupted():
        pace = Pace(link.now())
        link.send(robot.sensors(link.now()))
        while not robot.is_over:
            for data, arrived in link.receive(until=min(pace.deadline, sensors.next_due)):
                commands.put(data, arrived)
            now = link.now()
            for data, _ in sensors.take(now):
                link.send(data)
            if now < pace.deadline:
                continue
            timing.jitter.append(now - pace.deadline)
            for data, arrived in commands.take(now):
                robot.receive(data, arrived)
            see()
            robot.step(now)
            sensors.put(robot.sensors(now), now)
            for data, _ in sensors.take(now):
                link.send(data)
            ended = link.now()
            timing.work.append(ended - now)
            timing.misses += pace.advance(ended)
