"""Evaluates a policy or another controller: many robots at once on a ground given by its spec."""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.control import Controller, Driver
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.rollout import RolloutConfig, rollout
from gaitshift.lab.gait_analysis import measure
from gaitshift.lab.log import Log
from gaitshift.robot.command import (
    CONTROL_PERIOD,
    MOST_HEIGHT,
    MOST_SPEED,
    MOST_YAW_RATE,
    SpeedLoop,
)
from gaitshift.sim.push import PushConfig
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.simulator import SimulatorChoice, simulator_maker
from gaitshift.sim.terrain import Terrain, from_spec

FIELDS = 8
"""Number of different grounds among which robots are divided where the ground is random."""

FIELD_WIDTH = 12.0
"""[m]"""

RUN_UP = 2.0
"""Metres of ground behind the start."""

MARGIN, LEAST_MARGIN = 0.25, 1.0
"""Ground beyond the commanded distance: a share of that distance, and the least length [m]; ours:
down a slope of 10° shipped policies walk 11 % further than commanded."""


@dataclass(frozen=True, kw_only=True)
class EvaluationConfig(SimulatorChoice):
    """Settings of an evaluation."""

    terrain: str = "flat"
    """Spec of the ground: one piece, or a track of them (`sim.terrain.spec_help`)."""
    episodes: int = 256
    """Number of robots; each runs one episode."""
    seconds: float = 10.0
    """Length of an episode [s]."""
    speed: float | None = None
    """Commanded forward speed [m/s]; by default the gait's nominal speed."""
    stride_frequency: float | None = None
    """Commanded stride frequency [Hz]; by default the gait's nominal frequency."""
    lateral_speed: float = 0.0
    """Commanded lateral speed, to the left [m/s]."""
    yaw_rate: float | None = None
    """Commanded yaw rate, to the left [rad/s]; by default robots keep to their lines."""
    body_height: float | None = None
    """Commanded body height, from that of the stance [m]; by default the gait's nominal height."""
    open_loop: bool = False
    """Give the policy the commanded speed directly; by default a slow speed loop adjusts it so that
    the mean speed equals the commanded speed."""
    push: float = 0.0
    """Largest push on the base [N]; a push lasts 0.2 s and comes every 2 s."""
    sensors: SensorConfig = PERFECT
    """Sensors of the robots and their link to the joints."""
    seed: int = 0
    """Seed of terrains, starts, pushes and sensors."""

    def __post_init__(self) -> None:
        if not 1 <= self.episodes <= 100_000:
            raise GaitshiftError(f"episodes must be 1 to 100000, got {self.episodes}")
        if not 0 < self.seconds <= 3600:
            raise GaitshiftError(f"seconds must be above 0 and at most 3600, got {self.seconds}")
        if self.seed < 0:
            raise GaitshiftError(f"seed must be 0 or larger, got {self.seed}")
        if self.speed is not None and not 0 <= self.speed <= MOST_SPEED:
            raise GaitshiftError(f"speed must be 0 to {MOST_SPEED:g} m/s, got {self.speed}")
        for name, most in (
            ("lateral_speed", MOST_SPEED),
            ("yaw_rate", MOST_YAW_RATE),
            ("body_height", MOST_HEIGHT),
        ):
            value = getattr(self, name)
            if value is not None and not -most <= value <= most:
                raise GaitshiftError(f"{name} must be -{most:g} to {most:g}, got {value}")
        frequency, most = self.stride_frequency, 1 / CONTROL_PERIOD
        if frequency is not None and not 0 < frequency <= most:
            raise GaitshiftError(
                f"stride_frequency must be above 0 and at most {most:g} Hz, got {frequency}"
            )


def evaluate(
    policy: Policy,
    config: EvaluationConfig,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[dict[str, Any], Log]:
    """Runs the deterministic policy and measures it (`gait_analysis.measure`)."""
    return evaluate_controller(_driver(policy, config), config, report)


def evaluate_controller(
    controller: Controller,
    config: EvaluationConfig,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[dict[str, Any], Log]:
    """Runs robots that are all in one gait, and measures them with that gait's machine."""
    log = run_controller(controller, config, report=report)
    known = controller.repertoire
    machines = dict(zip(known.gaits, known.machines, strict=True))
    return measure(log, machines, controller.robot), log


def run_policy(
    policy: Policy,
    config: EvaluationConfig,
    *,
    finish_x: float = np.inf,
    values: bool = False,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Log:
    """Runs the deterministic policy; ends early when no robot still walks towards `finish_x` [m].

    With `values` the log keeps the values of the policy's critic.
    """
    driver = _driver(policy, config)
    return run_controller(driver, config, finish_x=finish_x, values=values, report=report)


def _driver(policy: Policy, config: EvaluationConfig) -> Driver:
    return Driver({policy.gait: policy}, config.episodes, start=policy.gait)


def run_controller(
    controller: Controller,
    config: EvaluationConfig,
    *,
    finish_x: float = np.inf,
    values: bool = False,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Log:
    """Runs the controller's robots, as many as `config.episodes`, like `run_policy`."""
    rng = np.random.default_rng(config.seed)
    run = RolloutConfig(
        seconds=config.seconds,
        speed=config.speed,
        stride_frequency=config.stride_frequency,
        lateral_speed=config.lateral_speed,
        yaw_rate=config.yaw_rate,
        body_height=config.body_height,
        push=PushConfig(force=config.push),
        speed_loop=SpeedLoop(gain=0.0) if config.open_loop else SpeedLoop(),
        values=values,
    )
    own = float(controller.repertoire.own_command(controller.gait).forward_speed.max())
    speed = own if config.speed is None else config.speed
    grounds = grounds_of(config.terrain, seed=config.seed, speed=speed, seconds=config.seconds)
    make = simulator_maker(config.simulator)
    world = make(
        controller.robot,
        grounds,
        controller.n,
        gains=controller.gains,
        sensors=config.sensors,
        seed=config.seed,
    )
    start = starts(controller, rng)
    return rollout(
        world, controller, run, start_xy=start, rng=rng, finish_x=finish_x, report=report
    )


def field_length(speed: float, seconds: float) -> float:
    """Length of ground [m] for robots at a speed [m/s]: a quarter more than commanded."""
    return 2 * RUN_UP + (1 + MARGIN) * speed * seconds


def starts(controller: Controller, rng: np.random.Generator) -> Float[np.ndarray, "N 2"]:
    """Starting points of its robots [m].

    They are spread over the width, so that robots on one field do not walk over the same ground,
    and over a stride along x, so that robots reach an edge at all phases of the stride.
    """
    n = controller.n
    command = controller.repertoire.own_command(controller.gait)
    stride = command.forward_speed / command.stride_frequency
    start = np.zeros((n, 2))
    start[:, 1] = rng.uniform(-FIELD_WIDTH / 4, FIELD_WIDTH / 4, n)
    start[:, 0] = rng.uniform(-stride / 2, stride / 2, n)
    return start


def grounds_of(terrain: str, *, seed: int, speed: float, seconds: float) -> list[Terrain]:
    """The grounds for all robots: one where the ground is not random, else `FIELDS`.

    They begin `RUN_UP` behind the start, and are long enough for a speed [m/s] and time [s].

    Raises:
        GaitshiftError: the spec has its own length, which is too short, and the ground is not flat.
            There is no ground beyond its end, while flat ground has no end.
    """
    length = field_length(speed, seconds)
    grounds: list[Terrain] = []
    for each in range(FIELDS * seed, FIELDS * (seed + 1)):
        ground = from_spec(terrain, seed=each, length=length, width=FIELD_WIDTH)
        if grounds and np.array_equal(ground.height, grounds[0].height):
            break
        grounds.append(ground)
    _check_length(grounds[0], terrain, speed=speed, seconds=seconds)
    return [ground.moved(-RUN_UP, 0.0) for ground in grounds]


def _check_length(ground: Terrain, spec: str, *, speed: float, seconds: float) -> None:
    asked = speed * seconds
    needed = RUN_UP + asked + max(MARGIN * asked, LEAST_MARGIN)
    if not ground.is_flat and ground.size[0] < needed - 1e-6:
        raise GaitshiftError(
            f"terrain {spec!r}: length must be {ceil(needed)} m or more for {seconds:g} s at "
            f"{speed:g} m/s, {RUN_UP:g} m of it behind the start, got {ground.size[0]:g} m; give a "
            "longer terrain or fewer seconds"
        )


VERDICT_ROBOTS, VERDICT_SECONDS = 16, 5.0
"""Robots and length [s]; ours: seven to twelve strides of each after the 2 s left out."""

VERDICT_FIGURES = (
    "survival",
    "speed_mean",
    "pattern_fraction",
    "cycles_per_s",
    "cost_of_transport",
)


def flat_verdict(policy: Policy, sensors: SensorConfig = PERFECT) -> dict[str, Any]:
    """The verdict on a policy on flat ground, at its nominal speed and stride frequency.

    The robots have these `sensors`.

    `gait` is the name by the contacts alone. `clean` is true if that name is the policy's gait and
    all limits are met. `misses` lists the figures that miss their limits, with the worst foot,
    separated by "; ". The other figures are defined in `gait_analysis.measure`.
    """
    config = EvaluationConfig(episodes=VERDICT_ROBOTS, seconds=VERDICT_SECONDS, sensors=sensors)
    figures, _ = evaluate(policy, config)
    verdict = figures["verdict"]
    return {
        "gait": verdict["gait"],
        "clean": verdict["clean"],
        **{name: _rounded(figures[name]) for name in VERDICT_FIGURES},
        "misses": "; ".join(_spell(miss) for miss in verdict["misses"]),
    }


def _spell(miss: dict[str, Any]) -> str:
    parts = (miss["figure"], miss.get("foot"), _rounded(miss["value"]))
    return " ".join(str(part) for part in parts if part is not None)


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.4g}")
