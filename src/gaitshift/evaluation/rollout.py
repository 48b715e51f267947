"""Runs N robots with their controllers and switchers, and keeps the log."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from gaitshift.command import CONTROL_PERIOD, Command, HeadingLoop, SpeedLoop
from gaitshift.log import Log
from gaitshift.motion import Motion
from gaitshift.switching import Controller, Decision, Switcher
from gaitshift.world import PushConfig, Pusher, World


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
    n = world.n
    noise = rng.uniform(-config.joint_noise, config.joint_noise, (n, 12))
    stance = driver.robot.stance_angles
    world.place(np.arange(n), xy=start_xy, yaw=np.zeros(n), joint_position=stance + noise)
    pusher = Pusher(config.push, n, rng)
    recorder = _Recorder(world, driver, values=config.values)
    fallen = np.zeros(n, dtype=bool)
    wanted = command = _command(config, world.motion, driver, start_xy)
    speed_state = config.speed_loop.start(n)
    for step in range(config.steps):
        target = driver.act(world.motion, command)
        target[fallen] = stance
        world.push(pusher.step())
        motion = world.step(target)
        fallen = fallen | motion.body_contact
        driver.see(motion, command)
        decision = None
        if switcher is not None:
            decision = switcher.step((step + 1) * CONTROL_PERIOD, motion, driver)
        recorder.add(motion, wanted, decision, fallen)
        wanted = _command(config, motion, driver, start_xy)
        forward = motion.base_linear_velocity_b[:, 0]
        speed_state, asked = config.speed_loop.step(speed_state, wanted.forward_speed, forward)
        command = replace(wanted, forward_speed=asked)
        if step % 25 == 24:
            report(step + 1, config.steps)
            if (fallen | (motion.base_position_w[:, 0] > finish_x)).all():
                break
    report(config.steps, config.steps)
    return recorder.log()


def _command(
    config: RolloutConfig, motion: Motion, driver: Controller, start_xy: Float[np.ndarray, "N 2"]
) -> Command:
    own, n = driver.own_command(), driver.n
    lateral = motion.base_position_w[:, 1] - start_xy[:, 1]
    speed, frequency = config.speed, config.stride_frequency
    return Command(
        forward_speed=own.forward_speed if speed is None else np.full(n, speed),
        yaw_rate=config.heading_loop.yaw_rate(motion.yaw, np.zeros(n), lateral),
        stride_frequency=own.stride_frequency if frequency is None else np.full(n, frequency),
    )


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


class _Recorder:
    """Collects what a `Log` is made of."""

    def __init__(self, world: World, driver: Controller, *, values: bool) -> None:
        self._world = world
        self._driver = driver
        self._values = values
        self._columns: dict[str, list[np.ndarray]] = {}

    def add(
        self,
        motion: Motion,
        command: Command,
        decision: Decision | None,
        fallen: np.ndarray,
    ) -> None:
        driver, n = self._driver, self._world.n
        qpos, qvel = self._world.state()
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
            "fallen": fallen.copy(),
            "command": np.stack(
                [command.forward_speed, command.yaw_rate, command.stride_frequency], axis=1
            ),
        }
        if self._values and (expected := driver.value()) is not None:
            row["value"] = expected
        for name, value in row.items():
            kept = value.astype(_KEPT_AS[name]) if name in _KEPT_AS else value
            self._columns.setdefault(name, []).append(kept)

    def log(self) -> Log:
        terrain = self._world.terrains[0]
        # One column after the other, each list given up at once: half of the memory.
        columns = {name: np.stack(self._columns.pop(name)) for name in list(self._columns)}
        return Log(
            time=np.arange(1, len(columns["k"]) + 1) * CONTROL_PERIOD,
            **columns,
            gaits=self._driver.gaits,
            robot=self._driver.robot.name,
            terrain=terrain.name,
            terrain_height=terrain.height,
            terrain_size=np.array(terrain.size),
            terrain_origin=np.array(terrain.origin),
        )
