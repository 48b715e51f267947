"""Runs N robots with their controllers and switchers, and keeps the log."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.control import Controller, Decision, Switcher
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD, Command, HeadingLoop, SpeedLoop
from gaitshift.sim.world import PushConfig, Pusher, World


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
    """N robots on their way along x, a control step at a time."""

    def __init__(
        self,
        world: World,
        driver: Controller,
        config: RolloutConfig,
        *,
        start_xy: Float[np.ndarray, "N 2"],
        rng: np.random.Generator,
        switcher: Switcher | None = None,
    ) -> None:
        """Sets all robots of `world` down at `start_xy` [m], each to walk on its own line."""
        self.world, self.driver, self.switcher = world, driver, switcher
        self.config = config
        """May be replaced between two steps, to ask for another speed."""
        n = world.n
        noise = rng.uniform(-config.joint_noise, config.joint_noise, (n, 12))
        self._stance = driver.robot.stance_angles
        world.place(np.arange(n), xy=start_xy, yaw=np.zeros(n), joint_position=self._stance + noise)
        self._pusher = Pusher(config.push, n, rng)
        self._start_y = start_xy[:, 1]
        self.fallen: Bool[np.ndarray, " N"] = np.zeros(n, dtype=bool)
        """Who has fallen by now."""
        self.steps = 0
        """Control steps so far."""
        self.decision: Decision | None = None
        """What the switcher saw in the last step."""
        self.wanted = self._command()
        """The command in the last step; the speed asked for is trimmed about it."""
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
        """One control step; `see` is called at its end, before the next command is made.

        `force_w` [N] acts on the bases beside the pushes of the config.
        """
        world, driver = self.world, self.driver
        target = driver.act(world.motion, self._asked)
        target[self.fallen] = self._stance
        world.push(self._pusher.step() + force_w)
        motion = world.step(target)
        self.steps += 1
        is_off = (motion.clearance < -OVER_THE_EDGE).all(axis=1)
        self.fallen = self.fallen | motion.body_contact | is_off
        driver.see(motion, self._asked)
        if self.switcher is not None:
            self.decision = self.switcher.step(self.time, motion, driver, self.wanted)
        see()
        self.wanted = self._command()
        forward = motion.base_linear_velocity_b[:, 0]
        self._speed_state, asked = self.config.speed_loop.step(
            self._speed_state, self.wanted.forward_speed, forward
        )
        self._asked = replace(self.wanted, forward_speed=asked)

    def _command(self) -> Command:
        config, motion, n = self.config, self.world.motion, self.driver.n
        own = self.driver.own_command()
        lateral = motion.base_position_w[:, 1] - self._start_y
        speed, frequency = config.speed, config.stride_frequency
        return Command(
            forward_speed=own.forward_speed if speed is None else np.full(n, speed),
            yaw_rate=config.heading_loop.yaw_rate(motion.yaw, np.zeros(n), lateral),
            stride_frequency=own.stride_frequency if frequency is None else np.full(n, frequency),
        )


def rollout(
    world: World,
    driver: Controller,
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
    the steps done and the steps in all.
    """
    walk = Walk(world, driver, config, start_xy=start_xy, rng=rng, switcher=switcher)
    recorder = Recorder(walk)
    for step in range(config.steps):
        walk.step(recorder.add)
        if step % 25 == 24:
            report(step + 1, config.steps)
        if (walk.fallen | (world.motion.base_position_w[:, 0] >= finish_x)).all():
            break
    report(config.steps, config.steps)
    return recorder.log()


_KEPT_AS = {
    "qpos": np.float32,
    "qvel": np.float32,
    "torque": np.float32,
    "foot_position_w": np.float32,
    "clearance": np.float32,
    "foot_height": np.float32,
    "value": np.float32,
    "gait": np.int16,
    "machine_state": np.int16,
}
"""Columns whose full precision nobody needs: a robot's second then takes 35 kB."""


class Recorder:
    """Collects what a `Log` of a walk is made of."""

    def __init__(self, walk: Walk) -> None:
        self._walk = walk
        self._columns: dict[str, list[np.ndarray]] = {}

    @property
    def steps(self) -> int:
        """Steps that it holds."""
        return len(self._columns.get("k", ()))

    def add(self) -> None:
        """Takes in the step that ended."""
        walk, driver, motion = self._walk, self._walk.driver, self._walk.world.motion
        qpos, qvel = walk.world.state()
        command, decision, n = walk.wanted, walk.decision, walk.world.n
        nothing = np.zeros(n)
        row = {
            "qpos": qpos,
            "qvel": qvel,
            "torque": motion.joint_torque,
            "contact": motion.contact,
            "foot_position_w": motion.foot_position_w,
            "clearance": motion.clearance,
            "foot_height": np.zeros((n, 4)) if decision is None else decision.foot_height,
            "k": nothing if decision is None else decision.k,
            "threshold": nothing if decision is None else decision.threshold,
            "gait": driver.gait.copy(),
            "machine_state": driver.machine_state.copy(),
            "stance_shown": driver.stance_shown(motion),
            "fallen": walk.fallen.copy(),
            "command": np.stack(
                [command.forward_speed, command.yaw_rate, command.stride_frequency], axis=1
            ),
        }
        if walk.config.values and (expected := driver.value()) is not None:
            row["value"] = expected
        for name, value in row.items():
            kept = value.astype(_KEPT_AS[name]) if name in _KEPT_AS else value
            self._columns.setdefault(name, []).append(kept)

    def log(self) -> Log:
        """All of it; the recorder is empty then."""
        world, driver = self._walk.world, self._walk.driver
        terrain = world.terrains[0]
        # One column after the other, each list given up at once: half of the memory.
        columns = {name: np.stack(self._columns.pop(name)) for name in list(self._columns)}
        return Log(
            time=np.arange(1, len(columns["k"]) + 1) * CONTROL_PERIOD,
            **columns,
            gaits=driver.gaits,
            robot=driver.robot.name,
            terrain=terrain.name,
            terrain_height=terrain.height,
            terrain_size=np.array(terrain.size),
            terrain_origin=np.array(terrain.origin),
        )
