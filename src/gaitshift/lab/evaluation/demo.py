"""The demonstration: a robot that crosses a track and shifts its gait itself, or on a schedule."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from gaitshift.control import Autonomous, Scheduled, Switcher
from gaitshift.control.controller import ControllerMaker, controller_maker
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.rollout import RolloutConfig, rollout
from gaitshift.lab.log import Log
from gaitshift.robot.command import MOST_SPEED
from gaitshift.shift import GaitGraph, between, load_graph, tuned
from gaitshift.shift.graph_file import DEFAULT
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.simulator import SimulatorChoice, simulator_maker
from gaitshift.sim.terrain import Terrain, from_spec

RUN_OUT = 8.0
"""Metres of level ground behind the finish, where faster robots wait for slower ones."""

WIDTH = 8.0
"""Width of a track [m]."""

LATEST = 3600.0
"""Latest scheduled shift [s]; the longest run of `evaluate`, too."""

START = 1.5
"""Where robots start along the track [m]."""


_NUMBERS = ("alpha", "beta", "leak", "alpha_back", "beta_back", "hold")
"""Numbers of a condition that a demonstration may change."""


@dataclass(frozen=True, kw_only=True)
class DemoConfig(SimulatorChoice):
    """Settings of the demonstration."""

    track: str = "flat@8,perlin:0.10@12,flat@10"
    """The ground, piece by piece with lengths in metres; pieces as in `evaluate --terrain`."""
    flat_gait: str = ""
    """The gait on flat ground, and at the start; that of the graph by default."""
    rough_gait: str = ""
    """The gait on rough ground; that of the graph by default."""
    graph: str = DEFAULT
    """When to shift: a shipped gait graph by name, or a TOML file. `terrain`, which
    does not fire on slopes and steps; `height_difference`, the paper's statistic with our numbers;
    `paper`, with the paper's; all three between the two gaits above."""
    alpha: float | None = None
    """α: values above it count as rough [m]; as for the settings below, the default is that of
    the condition."""
    beta: float | None = None
    """β: shift to the rough gait when k exceeds it [counts]."""
    leak: float | None = None
    """Leak: decrease of k per step [counts]."""
    alpha_back: float | None = None
    """α': values below it count as flat [m]."""
    beta_back: float | None = None
    """β': shift back when k exceeds it [counts]."""
    hold: float | None = None
    """Least time in either gait [s]."""
    controller: str = "policy"
    """What walks, by name: `policy`, trained policies; `cpg`, coupled oscillators without learning
    (trot, pace, bound, walk), for slow walks on low noise."""
    gaits: tuple[str, ...] = ()
    """Gaits to show in sequence on a schedule, in place of the condition."""
    every: float = 3.0
    """Time between two shifts of `gaits` [s]."""
    at: tuple[float, ...] = ()
    """Times of the shifts between `gaits` [s], in place of `every`."""
    speeds: tuple[tuple[float, float], ...] = ()
    """Forward speeds [m/s] that are commanded in turn on flat ground, each with its time [s], in
    place of the track."""
    sensors: SensorConfig = PERFECT
    """Sensors of the robots and their link to the joints."""
    episodes: int = 1
    """Number of robots, each with its own track and start; pictures show robot 0."""
    seed: int = 0
    """Seed of the track and start of robot 0; robot i uses seed + i."""

    def __post_init__(self) -> None:
        if not 1 <= self.episodes <= 1000:
            raise GaitshiftError(f"episodes must be 1 to 1000, got {self.episodes}")
        if self.seed < 0:
            raise GaitshiftError(f"seed must be 0 or larger, got {self.seed}")
        if not 0.2 <= self.every <= 60:
            raise GaitshiftError(f"every must be 0.2 to 60 s, got {self.every}")
        if len(self.gaits) == 1:
            raise GaitshiftError(f"gaits must name two gaits or more, got {self.gaits[0]} alone")

        if self.at and len(self.at) != len(self.gaits) - 1:
            raise GaitshiftError(
                f"at must give {max(0, len(self.gaits) - 1)} times for {len(self.gaits)} gaits, "
                f"one for each shift, got {len(self.at)}"
            )
        if self.speeds and self.gaits:
            raise GaitshiftError("speeds and gaits must not both be given")
        for speed, seconds in self.speeds:
            if not (0 <= speed <= MOST_SPEED and 0.2 <= seconds <= LATEST):
                raise GaitshiftError(
                    f"speeds must be 0 to {MOST_SPEED:g} m/s for 0.2 to {LATEST:g} s each, got "
                    f"{speed:g}@{seconds:g}"
                )
        rise = all(early < late <= LATEST for early, late in pairwise((0.0, *self.at)))
        if not rise:  # NaN is neither above nor below a time
            raise GaitshiftError(
                f"at must give rising times above 0 and up to {LATEST:g} s, got {list(self.at)}"
            )

    @property
    def shift_times(self) -> tuple[float, ...]:
        """Times of the scheduled shifts [s]."""
        return self.at or tuple(self.every * i for i in range(1, len(self.gaits)))

    @property
    def used(self) -> tuple[str, ...]:
        """The gaits that appear, each once, in order of appearance."""
        return tuple(dict.fromkeys(self.gaits)) or self.ways.gaits

    @property
    def ways(self) -> GaitGraph:
        """The gait graph by which the robots shift; `GaitshiftError` where it cannot be built."""
        graph = load_graph(self.graph)
        gaits = {
            "flat": self.flat_gait or graph.gaits[0],
            "rough": self.rough_gait or graph.gaits[1],
        }
        if self.flat_gait or self.rough_gait:
            graph = between(graph, **gaits)
        return tuned(graph, **{name: getattr(self, name) for name in _NUMBERS})


def run_demo(
    config: DemoConfig,
    report: Callable[[int, int], None] = lambda done, total: None,
    *,
    make: ControllerMaker | None = None,
) -> tuple[Log, list[dict[str, Any]]]:
    """Runs the demonstration: the log of all robots, and a summary for each.

    `make` makes the controller, in place of the one that the config names.
    """
    n = config.episodes
    rng = np.random.default_rng(config.seed)
    used, make = config.used, make or controller_maker(config.controller)
    controller = make(used, n)
    switcher = _switcher(config)
    grounds = [_ground(config, config.seed + i) for i in range(n)]
    finish = _finish(config, grounds[0])
    slowest = float(controller.repertoire.forward_speed.min())
    run = RolloutConfig(seconds=_seconds(config, finish, slowest), speeds=config.speeds)
    make_world = simulator_maker(config.simulator)
    world = make_world(
        controller.robot,
        grounds,
        n,
        gains=controller.gains,
        sensors=config.sensors,
        seed=config.seed,
    )
    start = np.tile([START, 0.0], (n, 1))
    log = rollout(
        world,
        controller,
        run,
        start_xy=start,
        rng=rng,
        switcher=switcher,
        finish_x=finish,
        report=report,
    )
    return log, [summarise(log, robot, finish) for robot in range(n)]


def summarise(log: Log, robot: int, finish: float = np.inf) -> dict[str, Any]:
    """Summary of one robot until it crossed `finish` [m] or the run ended.

    It has survival, distance, mean speed, and every gait shift.
    """
    x = log.truth.base_position_w[:, robot, 0]
    crossed = np.flatnonzero(x >= finish)
    end = int(crossed[0]) + 1 if crossed.size else len(x)
    gait = log.gait[:end, robot]
    shifts = np.flatnonzero(gait[1:] != gait[:-1]) + 1
    fallen = bool(log.fallen[end - 1, robot])
    return {
        "survived": not fallen,
        "finished": bool(crossed.size) and not fallen,
        "time_s": round(float(log.time[end - 1]), 2),
        "distance_m": round(float(x[end - 1] - x[0]), 3),
        "mean_speed_m_s": round(float((x[end - 1] - x[0]) / log.time[end - 1]), 3),
        "switches": [
            {
                "time_s": round(float(log.time[t]), 2),
                "x_m": round(float(x[t]), 3),
                "from": log.gaits[gait[t - 1]],
                "to": log.gaits[gait[t]],
                "k": float(log.k[t, robot]),
            }
            for t in shifts
        ],
    }


def _switcher(config: DemoConfig) -> Switcher:
    if config.gaits:
        return Scheduled(tuple(zip(config.shift_times, config.gaits[1:], strict=True)))
    return Autonomous(config.ways, config.episodes)


def _ground(config: DemoConfig, seed: int) -> Terrain:
    if config.gaits or config.speeds:
        return from_spec("flat", seed=seed, length=10.0, width=WIDTH)
    return from_spec(f"{config.track},flat@{RUN_OUT}", seed=seed, length=1.0, width=WIDTH)


def _finish(config: DemoConfig, ground: Terrain) -> float:
    return np.inf if config.gaits or config.speeds else ground.extent[1] - RUN_OUT


def _seconds(config: DemoConfig, finish: float, speed: float) -> float:
    """Length of the run; on a track the time at two thirds of the commanded speed [m/s]."""
    if config.speeds:
        return sum(seconds for _, seconds in config.speeds)
    if config.gaits:
        return config.shift_times[-1] + config.every
    return 1.5 * (finish - START) / speed
