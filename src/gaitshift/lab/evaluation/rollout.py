"""Runs N robots with their controllers and switchers, in batches if wanted, and keeps the log."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.control import Controller, Estimation, Switcher
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD, Command, HeadingLoop, SpeedLoop
from gaitshift.shift import Decision
from gaitshift.sim.push import PushConfig, Pusher
from gaitshift.sim.simulator import Simulator


@dataclass(frozen=True, kw_only=True)
class RolloutConfig:
    """How robots are run."""

    seconds: float
    """Length of the run [s]."""
    speed: float | None = None
    """Commanded forward speed [m/s]; None: that of each robot's gait."""
    speeds: tuple[tuple[float, float], ...] = ()
    """Commanded forward speeds [m/s] in turn, each with its time [s], in place of `speed`; the last
    one stays."""
    stride_frequency: float | None = None
    """Commanded stride frequency [Hz]; None: that of each robot's gait."""
    lateral_speed: float = 0.0
    """Commanded lateral speed, to the left [m/s]."""
    body_height: float | None = None
    """Commanded body height, from that of the stance [m]; None: that of each robot's gait."""
    yaw_rate: float | None = None
    """Commanded yaw rate, to the left [rad/s]; None: robots keep to their lines along x."""
    heading_loop: HeadingLoop = field(default_factory=HeadingLoop)
    """Keeps robots on their line along x."""
    speed_loop: SpeedLoop = field(default_factory=SpeedLoop)
    """Keeps their mean speed; `SpeedLoop(gain=0)` asks for the commanded speed as it is."""
    push: PushConfig = field(default_factory=PushConfig)
    """Disturbances."""
    joint_noise: float = 0.1
    """Joints start within ± this of the stance [rad]."""
    values: bool = False
    """Whether the log keeps what the policies' critics expect."""

    def speed_at(self, time: float) -> float | None:
        """The commanded forward speed at a time since the start [s]."""
        for speed, seconds in self.speeds[:-1]:
            if time < seconds - 1e-9:
                return speed
            time -= seconds
        return self.speeds[-1][0] if self.speeds else self.speed

    @property
    def steps(self) -> int:
        """Control steps of the run."""
        return max(1, round(self.seconds / CONTROL_PERIOD))


OVER_THE_EDGE = 0.5
"""Robots whose feet are all further below the ground than this have walked off it [m]."""


class Walk:
    """N robots that walk along x, one control step at a time.

    Where the world senses a specific force and no velocity, the controller and the switcher see the
    velocity of an `Estimator`.
    """

    def __init__(
        self,
        world: Simulator,
        controller: Controller,
        config: RolloutConfig,
        *,
        start_xy: Float[np.ndarray, "N 2"],
        rng: np.random.Generator,
        switcher: Switcher | None = None,
    ) -> None:
        """Places all robots of `world` at `start_xy` [m]; each walks along its own line."""
        self.world, self.controller, self.switcher = world, controller, switcher
        self.config = config
        """May be replaced between two steps, to command another speed."""
        self.steps = 0
        """Control steps so far."""
        n = world.n
        noise = rng.uniform(-config.joint_noise, config.joint_noise, (n, 12))
        self._stance = controller.robot.stance_angles
        world.place(np.arange(n), xy=start_xy, yaw=np.zeros(n), joint_position=self._stance + noise)
        self._pusher = Pusher(config.push, n, rng)
        self._start_y = start_xy[:, 1]
        self.fallen: Bool[np.ndarray, " N"] = np.zeros(n, dtype=bool)
        """Which robots have fallen so far."""
        self.decision: Decision | None = None
        """The switcher's decision in the last step."""
        self._heading: Float[np.ndarray, " N"] = np.zeros(n)
        self.wanted = self._command()
        """The command in the last step, before the speed loop's trim."""
        self._estimation = Estimation(controller.robot, n)
        self.sensed = self._estimation.see(world.sensed)
        """Proprioception in the last step, with the time and the command."""
        self._seen = self.sensed
        self._asked = self.wanted
        self._speed_state = config.speed_loop.start(n)

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return self.steps * CONTROL_PERIOD

    def step(
        self,
        see: Callable[[], None] = lambda: None,
        force_w: Float[np.ndarray, "N 3"] | float = 0.0,
    ) -> None:
        """One control step; `see` is called at its end, before the next command is computed.

        `force_w` [N] acts on the bases in addition to the pushes of the config.
        """
        world, controller = self.world, self.controller
        target = controller.act(self._seen, self._asked)
        target[self.fallen] = self._stance
        world.push(self._pusher.step() + force_w)
        sensed, truth = world.step(target)
        self._estimation.restart(np.flatnonzero(truth.diverged))  # which are set down again
        self._seen = sensed = self._estimation.see(sensed)
        self.steps += 1
        is_off = (truth.clearance < -OVER_THE_EDGE).all(axis=1)
        self.fallen = self.fallen | truth.body_contact | truth.diverged | is_off
        controller.see(sensed, self._asked)
        self.sensed = sensed.having(
            time=self.time,
            **self.wanted.sensed(),
            value=controller.value() if self.config.values else None,
        )
        if self.switcher is not None:
            self.decision = self.switcher.step(self.sensed, controller, truth)
        see()
        self.wanted = self._command()
        self._speed_state, asked = self.config.speed_loop.step(
            self._speed_state, self.wanted.forward_speed, sensed.forward_speed
        )
        self._asked = replace(self.wanted, forward_speed=asked)

    def _command(self) -> Command:
        config, controller, n = self.config, self.controller, self.controller.n
        own = controller.repertoire.own_command(controller.gait)

        def given(value: float | None, otherwise: Float[np.ndarray, " N"]) -> np.ndarray:
            return otherwise if value is None else np.full(n, value)

        return Command(
            forward_speed=given(config.speed_at(self.time), own.forward_speed),
            yaw_rate=self._turn(),
            stride_frequency=given(config.stride_frequency, own.stride_frequency),
            lateral_speed=np.full(n, config.lateral_speed),
            body_height=given(config.body_height, own.body_height),
        )

    def _turn(self) -> Float[np.ndarray, " N"]:
        """Yaw rates that keep robots on their lines along x, or turn them as commanded."""
        config, yaw = self.config, self.world.sensed.yaw
        if config.yaw_rate is not None:
            self._heading, turn = config.heading_loop.turning(yaw, self._heading, config.yaw_rate)
            return turn
        self._heading = yaw
        aside = self.world.truth.base_position_w[:, 1] - self._start_y
        if config.lateral_speed != 0:
            aside = 0.0  # there is no line to keep
        return config.heading_loop.yaw_rate(yaw, np.zeros(len(yaw)), aside)


def rollout(
    world: Simulator,
    controller: Controller,
    config: RolloutConfig,
    *,
    start_xy: Float[np.ndarray, "N 2"],
    rng: np.random.Generator,
    switcher: Switcher | None = None,
    finish_x: float = np.inf,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Log:
    """Runs all robots of `world` along x from `start_xy` [m], each on its own line.

    The run ends early when every robot has fallen or passed `finish_x` [m]. `report` is called with
    the number of steps done and the total.
    """
    walk = Walk(world, controller, config, start_xy=start_xy, rng=rng, switcher=switcher)
    recorder = Recorder(walk)
    for step in range(config.steps):
        walk.step(recorder.add)
        if step % 25 == 24:
            report(step + 1, config.steps)
        if (walk.fallen | (world.truth.base_position_w[:, 0] >= finish_x)).all():
            break
    report(config.steps, config.steps)
    return recorder.log()


class Recorder:
    """Collects the steps of a walk's `Log` in single precision: 45 kB per robot and second."""

    def __init__(self, walk: Walk) -> None:
        self._walk = walk
        self._steps: list[Log] = []

    @property
    def steps(self) -> int:
        """Number of recorded steps."""
        return len(self._steps)

    def add(self) -> None:
        """Records the step that ended."""
        self._steps.append(_single(step_of(self._walk)))

    def log(self) -> Log:
        """The log of all recorded steps; the recorder is empty afterwards."""
        steps, self._steps = self._steps, []
        return Log.stack(steps)


def step_of(walk: Walk) -> Log:
    """The last step of a walk, as an entry of a log."""
    controller, world, decision = walk.controller, walk.world, walk.decision
    terrain, nothing = world.terrains[0], np.zeros(world.n)
    return Log(
        sensed=walk.sensed,
        truth=world.truth,
        k=nothing if decision is None else decision.k,
        threshold=nothing if decision is None else decision.threshold,
        gait=controller.gait.copy(),
        machine_state=controller.machine_state.copy(),
        stance_shown=controller.repertoire.stance_shown(controller.gait, world.truth.foot_contact),
        fallen=walk.fallen.copy(),
        gaits=controller.repertoire.gaits,
        robot=controller.robot.name,
        terrain=terrain.name,
        terrain_height=terrain.height,
        terrain_size=np.array(terrain.size),
        terrain_origin=np.array(terrain.origin),
    )


def _single(log: Log) -> Log:
    """A step with its proprioception and privileged state in single precision."""
    return replace(log, sensed=log.sensed.as_type(np.float32), truth=log.truth.as_type(np.float32))


Outcome = TypeVar("Outcome")
"""A dataclass of arrays with one entry per run."""


def in_batches(
    run: Callable[[int, int], Outcome],
    total: int,
    *,
    most: int,
    seed: int,
    report: Callable[[int, int], None],
) -> Outcome:
    """The outcomes of `total` runs, at most `most` at a time.

    `run` takes the number of runs and the seed of a batch, `report` the runs done and the total.
    """
    parts: list[Outcome] = []
    for index, first in enumerate(range(0, total, most)):
        n = min(most, total - first)
        parts.append(run(n, 1000 * seed + index))
        report(first + n, total)
    kind: Any = type(parts[0])
    names = [field.name for field in fields(kind)]
    return kind(**{n: np.concatenate([getattr(part, n) for part in parts]) for n in names})
