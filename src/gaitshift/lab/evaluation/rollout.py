"""Runs N robots with their controllers and switchers, in batches if wanted, and keeps the log."""

from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.control import Controller, Estimator, Switcher
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD, Command, HeadingLoop, SpeedLoop
from gaitshift.robot.state import Proprioception
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
    stride_frequency: float | None = None
    """Commanded stride frequency [Hz]; None: that of each robot's gait."""
    heading_loop: HeadingLoop = field(default_factory=HeadingLoop)
    """Keeps robots on their line along x."""
    speed_loop: SpeedLoop = field(default_factory=SpeedLoop)
    """Keeps their mean speed; `SpeedLoop(limit=0)` asks for the commanded speed as it is."""
    push: PushConfig = field(default_factory=PushConfig)
    """Disturbances."""
    joint_noise: float = 0.1
    """Joints start within ± this of the stance [rad]."""
    values: bool = False
    """Whether the log keeps what the policies' critics expect."""

    @property
    def steps(self) -> int:
        """Control steps of the run."""
        return max(1, round(self.seconds / CONTROL_PERIOD))


OVER_THE_EDGE = 0.5
"""Robots whose feet are all further below the ground than this have walked off it [m]."""


class Walk:
    """N robots that walk along x, one control step at a time.

    Where the world senses a specific force and no velocity, the controller and the switcher see the
    velocity that an `Estimator` computes.
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
        n = world.n
        noise = rng.uniform(-config.joint_noise, config.joint_noise, (n, 12))
        self._stance = controller.robot.stance_angles
        world.place(np.arange(n), xy=start_xy, yaw=np.zeros(n), joint_position=self._stance + noise)
        self._pusher = Pusher(config.push, n, rng)
        self._start_y = start_xy[:, 1]
        self.fallen: Bool[np.ndarray, " N"] = np.zeros(n, dtype=bool)
        """Which robots have fallen so far."""
        self.steps = 0
        """Control steps so far."""
        self.decision: Decision | None = None
        """The switcher's decision in the last step."""
        self.wanted = self._command()
        """The command in the last step, before the speed loop's trim."""
        self._estimator = Estimator(robot=controller.robot)
        self._estimate = self._estimator.begin(n)
        self.sensed = self._with_velocity(world.sensed)
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
        if truth.diverged.any():  # and is set down again
            ids = np.flatnonzero(truth.diverged)
            self._estimate = self._estimate.with_robots(ids, self._estimator.begin(len(ids)))
        self._seen = sensed = self._with_velocity(sensed)
        self.steps += 1
        is_off = (truth.clearance < -OVER_THE_EDGE).all(axis=1)
        self.fallen = self.fallen | truth.body_contact | truth.diverged | is_off
        controller.see(sensed, self._asked)
        self.sensed = replace(
            sensed,
            time=self.time,
            forward_speed_command=self.wanted.forward_speed,
            yaw_rate_command=self.wanted.yaw_rate,
            stride_frequency_command=self.wanted.stride_frequency,
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

    def _with_velocity(self, sensed: Proprioception) -> Proprioception:
        """What is sensed, with the estimated velocity where none is sensed but could be."""
        if sensed.velocity_b is not None or sensed.specific_force_b is None:
            return sensed
        self._estimate, sensed = self._estimator.step(self._estimate, sensed)
        return sensed

    def _command(self) -> Command:
        config, controller, n = self.config, self.controller, self.controller.n
        own = controller.repertoire.own_command(controller.gait)
        lateral = self.world.truth.base_position_w[:, 1] - self._start_y
        speed, frequency = config.speed, config.stride_frequency
        return Command(
            forward_speed=own.forward_speed if speed is None else np.full(n, speed),
            yaw_rate=config.heading_loop.yaw_rate(self.world.sensed.yaw, np.zeros(n), lateral),
            stride_frequency=own.stride_frequency if frequency is None else np.full(n, frequency),
        )


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
