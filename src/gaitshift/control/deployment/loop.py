"""The control loop of one robot behind a link: sensors in, joint targets out, and a soft stop.

`Deployment` takes datagrams and times and returns datagrams. It reads no clock and no socket, so
a test drives it step by step. `run` drives it in real time (`real_time`).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from gaitshift.control.controller import Controller
from gaitshift.control.deployment import datagram
from gaitshift.control.deployment.config import DeploymentConfig
from gaitshift.control.deployment.datagram import Sensors, decode_sensors
from gaitshift.control.deployment.inbox import Inbox
from gaitshift.control.deployment.joint_limits import JointLimits
from gaitshift.control.deployment.layout import Malformed
from gaitshift.control.deployment.soft_stop import DURATION, SoftStop
from gaitshift.control.estimator import Estimation
from gaitshift.control.switcher import Switcher, uncounted
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import (
    COMMAND_PARTS,
    CONTROL_PERIOD,
    Command,
    HeadingLoop,
    SpeedLoop,
)
from gaitshift.robot.state import Proprioception
from gaitshift.shift import Decision

FAREWELL = 5
"""Datagrams at the end of a stop, without stiffness; ours: so that the loss of some costs nothing.
"""

_SENT_KEPT = 1000
"""Commands whose time of sending is kept, for round trips; ours: 10 s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class ControlStep:
    """One control step: what the controller saw, decided and sent."""

    sensed: Proprioception
    """The newest sensors, with the time since the start and the command in the step that ended."""
    sequence: int
    """Their number; the same as in the step before if none arrived in between."""
    decision: Decision
    """Of the switcher; uncounted in the first step."""
    gait: int
    """Index of the gait that acts next."""
    target: Float[np.ndarray, " 12"]
    """Joint targets that were sent [rad]."""


class Deployment:
    """A controller and a switcher on one robot, one control step at a time.

    The controller sees the newest sensors in every control step; where none arrived, it sees the
    last ones again. A velocity that is not sensed is estimated. Speed and heading are kept by the
    same loops as in `lab.evaluation.Walk`, but a robot does not know how far it is beside its line.
    Where no sensors arrive for the time of the watchdog, or the robot says that it has stopped, the
    soft stop begins by itself.
    """

    def __init__(
        self, controller: Controller, switcher: Switcher, config: DeploymentConfig
    ) -> None:
        """Begins with the first sensors; `controller` drives one robot."""
        if controller.n != 1:
            raise GaitshiftError(f"robots must be 1 in a deployment, got {controller.n}")
        for gait in controller.repertoire.gaits:
            datagram.gait_bytes(gait)
        self.controller, self.switcher, self.config = controller, switcher, config
        self.inbox: Inbox[Sensors] = Inbox(decode_sensors, self._is_timely)
        """Sensors that arrived."""
        self.last: ControlStep | None = None
        """The last control step; a stop has none."""
        self.fault = ""
        """Why it stops by itself, as one line; empty while it does not."""
        self.round_trips: list[float] = []
        """Times from a command to the first sensors that result from it [s]."""
        robot = controller.robot
        self._gains = robot.gains_of(controller.gains)
        self._limits = JointLimits.of(robot)
        self._estimation = Estimation(robot, 1)
        self._seen: tuple[int, Proprioception] | None = None
        self._steps, self._sent = 0, 0
        self._heading_loop, self._speed_loop = HeadingLoop(), SpeedLoop()
        self._speed_state = self._speed_loop.start(1)
        self._wanted = self._asked = controller.repertoire.own_command(controller.gait)
        self._heading = np.zeros(1)
        self._target: Float[np.ndarray, " 12"] | None = None
        self._decision: datagram.Decision | None = None
        self._stop: tuple[float, SoftStop] | None = None
        self._farewells = 0
        self._sent_at = dict[int, float]()

    def receive(self, data: bytes, arrived: float) -> None:
        """Takes a datagram that arrived at this time [s]; one that is not valid is counted."""
        if not self.inbox.add(data, arrived) or self.inbox.newest is None:
            return
        sent = self._sent_at.pop(self.inbox.newest.acknowledged, None)
        if sent is not None:
            self.round_trips.append(arrived - sent)

    def step(self, now: float) -> bytes | None:
        """One control step at this time [s]: the datagram to send; None before the first sensors.

        Raises:
            GaitshiftError: the sensors lack a signal that the controller needs, or a target is not
                finite. The caller then stops softly.
        """
        newest = self.inbox.newest
        if newest is None:
            return None
        if not self.fault and self._stop is None:
            self._watch(newest, now)
        if self._stop is not None:
            return self._stopping(newest, now, *self._stop)
        if self.fault:
            return None
        seen = self._control(newest)
        target = self._limited(newest, seen.target, self._gains.kp)
        data = self._command(newest, now, target, self._gains.kp, is_stop=False)
        self._target, self.last = target, replace(seen, target=target)
        return data

    def stop(self, now: float) -> None:
        """Begins the soft stop at this time [s], unless it has begun."""
        newest = self.inbox.newest
        if self._stop is not None or self._target is None or newest is None:
            return
        hold = newest.sensed.need("joint_position", "the soft stop")[0]
        self._stop = now, SoftStop(start=self._target, hold=hold, gains=self._gains)

    @property
    def is_over(self) -> bool:
        """Whether nothing is left to do for a stop: it is finished, or no target was ever sent."""
        return self._target is None or self._farewells >= FAREWELL

    def _is_timely(self, sensors: Sensors) -> bool:
        """Every datagram is; one with other signals than the first is malformed."""
        first = self.inbox.newest
        if first is not None:
            before, after = first.sensed, sensors.sensed
            for name in ("velocity_b", "specific_force_b"):
                if (getattr(before, name) is None) != (getattr(after, name) is None):
                    raise Malformed(name)
            if before.has_heading != after.has_heading:
                raise Malformed("yaw")
        return True

    def _watch(self, newest: Sensors, now: float) -> None:
        if now - self.inbox.arrived > self.config.watchdog:
            silence = 1000.0 * self.config.watchdog
            self.fault = f"no valid sensors for {silence:.0f} ms, so the loop stopped softly"
        elif newest.is_stopped and self._target is not None:
            self.fault = "the robot stopped by its own watchdog: commands came late or not at all"
        if self.fault:
            self.stop(now)

    def _control(self, newest: Sensors) -> ControlStep:
        """What the controller wants, within no limits yet; the gait may change before."""
        controller, sensed = self.controller, self._with_velocity(newest)
        speed = sensed.forward_speed
        if self._steps == 0:
            self._heading = self._yaw(sensed)
            self._wanted = self._asked = self._command_of(sensed)
            decision = uncounted(np.zeros(1, dtype=bool))
            seen = self._with_command(sensed)
        else:
            controller.see(sensed, self._asked)
            seen = self._with_command(sensed)
            decision = self.switcher.step(seen, controller)
            self._wanted = self._command_of(sensed)
            self._speed_state, asked = self._speed_loop.step(
                self._speed_state, self._wanted.forward_speed, speed
            )
            self._asked = replace(self._wanted, forward_speed=asked)
        target = controller.act(sensed, self._asked)[0]
        self._steps += 1
        self._decision = self._decided(seen, decision)
        return ControlStep(
            sensed=seen,
            sequence=newest.sequence,
            decision=decision,
            gait=int(controller.gait[0]),
            target=target,
        )

    def _with_velocity(self, newest: Sensors) -> Proprioception:
        """The sensors with a velocity; one that is not sensed is estimated once a datagram."""
        if self._seen is not None and newest.sequence == self._seen[0]:
            return self._seen[1]
        steps = 1 if self._seen is None else newest.sequence - self._seen[0]
        late = newest.sensed.having(period=steps * CONTROL_PERIOD)  # some were lost
        sensed = self._estimation.see(late).having(period=CONTROL_PERIOD)
        self._seen = newest.sequence, sensed
        return sensed

    def _with_command(self, sensed: Proprioception) -> Proprioception:
        """Sensors with the time and the command during the step that ended."""
        return sensed.having(
            time=self._steps * CONTROL_PERIOD,
            mass=self.controller.robot.mass,
            **self._wanted.sensed(),
        )

    def _command_of(self, sensed: Proprioception) -> Command:
        own = self.controller.repertoire.own_command(self.controller.gait)
        config = self.config
        self._heading, turn = self._heading_loop.turning(
            self._yaw(sensed), self._heading, config.yaw_rate
        )
        return Command(
            forward_speed=own.forward_speed if config.speed is None else np.full(1, config.speed),
            yaw_rate=turn,
            stride_frequency=own.stride_frequency,
            lateral_speed=np.full(1, config.lateral_speed),
            body_height=(
                own.body_height if config.body_height is None else np.full(1, config.body_height)
            ),
        )

    def _yaw(self, sensed: Proprioception) -> Float[np.ndarray, " 1"]:
        """The heading [rad]; always the first one where it is not measured."""
        return sensed.yaw if sensed.has_heading else self._heading

    def _decided(self, seen: Proprioception, decision: Decision) -> datagram.Decision:
        controller = self.controller
        shown = controller.repertoire.stance_shown(controller.gait, seen.contact)
        return datagram.Decision(
            gait=controller.repertoire.gaits[int(controller.gait[0])],
            machine_state=int(controller.machine_state[0]),
            stance_shown=bool(shown[0]),
            k=float(decision.k[0]),
            threshold=float(decision.threshold[0]),
            **{
                name: float(seen.need(f"{name}_command", "a datagram")[0]) for name in COMMAND_PARTS
            },
        )

    def _stopping(self, newest: Sensors, now: float, began: float, stop: SoftStop) -> bytes:
        time = now - began
        if time >= DURATION:
            self._farewells += 1
        kp = stop.kp(time)
        target = self._limited(newest, stop.target(time), kp)
        return self._command(newest, now, target, kp, is_stop=True)

    def _limited(
        self, newest: Sensors, target: Float[np.ndarray, " 12"], kp: float
    ) -> Float[np.ndarray, " 12"]:
        need = newest.sensed.need
        position, velocity = (need(f"joint_{n}", "a limit")[0] for n in ("position", "velocity"))
        return self._limits.clipped(target, position, velocity, kp, self._gains.kd)

    def _command(
        self,
        newest: Sensors,
        now: float,
        target: Float[np.ndarray, " 12"],
        kp: float,
        *,
        is_stop: bool,
    ) -> bytes:
        assert self._decision is not None
        self._sent += 1
        data = datagram.encode_command(
            datagram.Command(
                sequence=self._sent,
                stamp=int(1e9 * now),
                answered=newest.sequence,
                target=target,
                kp=kp,
                kd=self._gains.kd,
                is_stop=is_stop,
                decision=self._decision,
            )
        )
        self._sent_at[self._sent] = now
        self._sent_at.pop(self._sent - _SENT_KEPT, None)
        return data
