"""A simulated robot behind datagrams: it measures, follows commands, and damps when they end."""

import numpy as np
from jaxtyping import Float

from gaitshift.control.deployment.config import WATCHDOG_RANGE
from gaitshift.control.deployment.datagram import (
    Command,
    Sensors,
    decode_command,
    encode_sensors,
)
from gaitshift.control.deployment.inbox import Inbox
from gaitshift.control.deployment.layout import Malformed
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.limits import MOST_ANGLE
from gaitshift.sim.world import World

DAMPED = 2.0
"""Time for which a stopped robot is simulated on [s]; ours: it has come to rest by then."""


class SimulatedRobot:
    """One robot of a `World` as a controller on the other side of a link knows it.

    It stands in its stance until the first command. From then on it follows the newest command in
    every control step. If none arrives for the time of its watchdog, its joints are damped for
    good, whatever arrives later. After a command that belongs to a stop it follows no others than
    such.

    The world's joint controllers have fixed gains. Other gains are turned into targets that give
    the same torques at the start of a control step; within the step the model's stiffness resists
    the motion a little more.
    """

    def __init__(self, world: World, *, gains: str, watchdog: float) -> None:
        """`world` has one robot and the preset `gains`; `watchdog` is a time [s]."""
        if world.n != 1:
            raise GaitshiftError(f"robots must be 1 behind a link, got {world.n}")
        low, high = WATCHDOG_RANGE
        if not low <= watchdog <= high:
            raise GaitshiftError(f"watchdog must be {low:g} to {high:g}, got {watchdog}")
        self.world = world
        self.inbox: Inbox[Command] = Inbox(decode_command, self._is_timely)
        """Commands that arrived."""
        self.is_damped = False
        """Whether it has stopped and its joints are only damped."""
        self.is_lost = False
        """Whether it stopped because commands ended without a stop."""
        self._gains, self._watchdog = world.robot.gains_of(gains), watchdog
        self._stance = world.sensed.need("joint_position", "a robot")[0].copy()
        self._sent, self._followed, self._damped = 0, 0, 0

    def sensors(self, now: float) -> bytes:
        """The datagram of its present measurements, at this time of its clock [s]."""
        self._sent += 1
        return encode_sensors(
            Sensors(
                sequence=self._sent,
                stamp=int(1e9 * now),
                acknowledged=self._followed,
                sensed=self.world.sensed,
                is_stopped=self.is_lost,
            )
        )

    def receive(self, data: bytes, arrived: float) -> None:
        """Takes a datagram that arrived at this time [s]; one that is not valid is counted."""
        self.inbox.add(data, arrived)

    def step(self, now: float) -> None:
        """One control step of 10 ms that ends at this time [s]."""
        command = self.inbox.newest
        if command is not None and now - self.inbox.arrived > self._watchdog:
            self.is_lost = self.is_lost or not (self.is_damped or command.is_stop)
            self.is_damped = True
        if command is None:
            target = self._stance
        elif self.is_damped:
            self._damped += 1
            target = self._driven(self._stance, 0.0, self._gains.kd)
        else:
            self._followed = command.sequence
            target = self._driven(command.target, command.kp, command.kd)
        self.world.step(target[None])

    @property
    def is_driven(self) -> bool:
        """Whether a command has arrived and it has not stopped."""
        return self.inbox.newest is not None and not self.is_damped

    @property
    def is_over(self) -> bool:
        """Whether it has stopped and come to rest."""
        return self._damped * CONTROL_PERIOD >= DAMPED

    def _is_timely(self, command: Command) -> bool:
        """Whether it answers sensors that are not long past; a stop may answer older ones."""
        if command.answered > self._sent:
            raise Malformed("answered")
        before = self.inbox.newest
        if before is not None and before.is_stop:
            return command.is_stop
        age = (self._sent - command.answered) * CONTROL_PERIOD
        return command.is_stop or age <= self._watchdog

    def _driven(
        self, target: Float[np.ndarray, " 12"], kp: float, kd: float
    ) -> Float[np.ndarray, " 12"]:
        """Targets for the model's gains that give the torques of these gains now [rad]."""
        own, sensed = self._gains, self.world.sensed
        if (kp, kd) == (own.kp, own.kd):
            return target
        position, velocity = (
            sensed.need(f"joint_{n}", "a robot")[0] for n in ("position", "velocity")
        )
        torque = kp * (target - position) - kd * velocity
        return np.clip(position + (torque + own.kd * velocity) / own.kp, -MOST_ANGLE, MOST_ANGLE)
