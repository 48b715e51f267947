"""A live run of robots, which executes orders between two steps."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from gaitshift.control import Autonomous, Driver
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.lab.evaluation.demo import RUN_OUT, START, WIDTH, DemoConfig
from gaitshift.lab.evaluation.rollout import Recorder, RolloutConfig, Walk, step_of
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot
from gaitshift.shift import GaitGraph, Oracle, between, load_graph, tuned, with_stand
from gaitshift.shift.graph_file import DEFAULT
from gaitshift.show.geometry import Frame
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.terrain import from_spec
from gaitshift.sim.world import World

MOST_ROBOTS = 16
"""Largest number of robots on a page."""

PUSH_TIME = 0.2
"""Duration of a push [s]."""

STAND = "stand"
"""The gait at zero command, where it has a policy."""

LYING = 2.0
"""Time from the first robot's fall until all restart [s]."""


@dataclass(frozen=True, kw_only=True)
class LiveConfig:
    """Settings of a live run: robots, ground, condition."""

    track: str = DemoConfig.track
    """Spec of the ground."""
    robots: int = 1
    """Number of robots; charts show the first, and the others are drawn as its ghosts."""
    sensors: SensorConfig = PERFECT
    """Sensors of the robots and their link to the joints."""
    seed: int = 0
    """Seed of the ground, the starts and the sensors."""
    start: str = "trot"
    """The gait at the start, and the one for flat ground."""
    rough_gait: str = "bound"
    """The gait for rough ground."""
    condition: str = DEFAULT
    """When to shift, by the name of a shipped graph of two gaits."""
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])
    """Numbers of the condition that differ from its file (`shift.there_and_back`)."""
    is_autonomous: bool = True
    """Whether robots shift by themselves."""
    speed: float | None = None
    """Commanded speed [m/s]; None: that of the gait."""
    stride_frequency: float | None = None
    """Commanded stride frequency [Hz]; None: that of the gait."""
    lateral_speed: float = 0.0
    """Commanded lateral speed, to the left [m/s]."""
    yaw_rate: float | None = None
    """Commanded yaw rate, to the left [rad/s]; None: robots keep to their lines."""
    body_height: float | None = None
    """Commanded body height, from that of the stance [m]; None: that of the gait."""

    def __post_init__(self) -> None:
        if not 1 <= self.robots <= MOST_ROBOTS:
            raise GaitshiftError(f"robots must be 1 to {MOST_ROBOTS}, got {self.robots}")
        if self.seed < 0:
            raise GaitshiftError(f"seed must be 0 or larger, got {self.seed}")

    @property
    def graph(self) -> GaitGraph:
        """The gait graph of the shifts, with these numbers."""
        shipped = between(load_graph(self.condition), flat=self.start, rough=self.rough_gait)
        return tuned(shipped, **self.numbers)


class LiveRun:
    """N robots on a track. Not thread-safe."""

    def __init__(self, config: LiveConfig, policies: Mapping[str, Policy]) -> None:
        """Any of the policies' gaits may be used later."""
        self._policies = dict(policies)
        self.config = config
        self._recorder: Recorder | None = None
        self.restart()

    def restart(self, config: LiveConfig | None = None) -> None:
        """Restarts, with another config if one is given; a recording ends.

        Raises:
            GaitshiftError: the config is not possible; nothing changes then.
        """
        config = config or self.config
        ground = from_spec(
            f"{config.track},flat@{RUN_OUT}", seed=config.seed, length=1.0, width=WIDTH
        )
        self._driver = driver = Driver(self._policies, config.robots, start=config.start)
        switcher = self._switcher(config)
        world = World(
            driver.robot,
            ground,
            config.robots,
            gains=driver.gains,
            sensors=config.sensors,
            seed=config.seed,
        )
        rng = np.random.default_rng(config.seed)
        start = np.zeros((config.robots, 2))
        start[:, 0] = START
        start[1:, 0] += rng.uniform(-0.3, 0.3, config.robots - 1)
        start[1:, 1] = rng.uniform(-2.0, 2.0, config.robots - 1)
        self._walk = Walk(
            world, driver, self._rollout(config), start_xy=start, rng=rng, switcher=switcher
        )
        self.config, self._recorder = config, None
        self.finish_x = ground.extent[1] - RUN_OUT
        self._frame: Frame | None = None
        self._pushed_until, self._push_w = 0.0, np.zeros(3)
        self._fell_at: float | None = None
        self.ground = ground

    def change(self, config: LiveConfig) -> None:
        """Continues with another config at once; restarts if ground, robots or seed differ."""
        before = self.config
        anew = ("track", "robots", "seed", "start", "rough_gait")
        if any(getattr(before, name) != getattr(config, name) for name in anew):
            self.restart(config)
            return
        switcher = self._walk.switcher
        if config.is_autonomous != before.is_autonomous or not isinstance(switcher, Autonomous):
            self._walk.switcher = self._switcher(config)
        elif config.graph.statistics == before.graph.statistics:
            switcher.retune(self._graph(config))
        else:
            self._walk.switcher = self._switcher(config)
        self._walk.config = self._rollout(config)
        self.config = config

    def learn(self, policy: Policy) -> None:
        """Goes on with another policy of the same gait."""
        self._policies[policy.gait] = policy
        self._driver.policies[policy.gait] = policy

    def take(self, gait: str) -> None:
        """Changes the gait of all robots at once."""
        self._walk.controller.switch(np.arange(self.config.robots), gait, self._walk.world.sensed)

    def push(self, force: float, direction: float) -> None:
        """Pushes all bases for `PUSH_TIME`.

        Args:
            force: [N].
            direction: in the plane, from the world's x axis [rad].
        """
        self._push_w = force * np.array([np.cos(direction), np.sin(direction), 0.0])
        self._pushed_until = self._walk.time + PUSH_TIME

    def step(self) -> Frame:
        """One control step."""
        walk = self._walk
        pushed = walk.time < self._pushed_until - 1e-9
        force = np.tile(self._push_w * pushed, (self.config.robots, 1))
        walk.step(self._see, force)
        if walk.fallen[0] and self._fell_at is None:
            self._fell_at = walk.time
        assert self._frame is not None
        return self._frame

    @property
    def is_over(self) -> bool:
        """Whether the first robot is at the end, or fell more than `LYING` seconds ago."""
        if self._fell_at is not None:
            return self._walk.time > self._fell_at + LYING
        return bool(self._walk.world.truth.base_position_w[0, 0] > self.finish_x)

    @property
    def robot(self) -> Robot:
        """The robot description."""
        return self._walk.controller.robot

    @property
    def machines(self) -> dict[str, RewardMachine]:
        """The machine of each gait."""
        return {name: policy.machine for name, policy in self._policies.items()}

    @property
    def gaits(self) -> tuple[str, ...]:
        """Names of the gaits, by the index that frames use."""
        return self._walk.controller.repertoire.gaits

    @property
    def is_recording(self) -> bool:
        """Whether steps are recorded."""
        return self._recorder is not None

    def record(self) -> None:
        """Starts a recording."""
        self._recorder = Recorder(self._walk)

    def end_recording(self) -> Log | None:
        """Ends the recording and returns its log; None if it has fewer than 2 steps."""
        recorder, self._recorder = self._recorder, None
        return recorder.log() if recorder is not None and recorder.steps >= 2 else None

    def _see(self) -> None:
        self._frame = Frame.after(self._frame, step_of(self._walk))
        if self._recorder is not None:
            self._recorder.add()

    def _switcher(self, config: LiveConfig) -> Autonomous | None:
        if not config.is_autonomous:
            return None
        graph = self._graph(config)
        missing = {*graph.gaits} - {*self._policies}
        if missing:
            raise GaitshiftError(f"gait must be one with a policy, got '{min(missing)}'")
        if any(isinstance(one, Oracle) for one in graph.statistics.values()):
            raise GaitshiftError(
                f"condition must be one that robots can sense, got '{config.condition}', which "
                "needs the truth about the ground"
            )
        return Autonomous(graph, config.robots)

    def _graph(self, config: LiveConfig) -> GaitGraph:
        """The gait graph, and standing at zero command where there is a policy for it."""
        graph = config.graph
        known = STAND in self._policies and STAND not in graph.gaits
        return with_stand(graph, STAND) if known else graph

    @staticmethod
    def _rollout(config: LiveConfig) -> RolloutConfig:
        return RolloutConfig(
            seconds=np.inf,
            speed=config.speed,
            stride_frequency=config.stride_frequency,
            lateral_speed=config.lateral_speed,
            yaw_rate=config.yaw_rate,
            body_height=config.body_height,
        )


DIRECTIONS = {"left": np.pi / 2, "right": -np.pi / 2, "forwards": 0.0, "backwards": np.pi}
"""Directions of pushes, by name [rad]."""
