"""The demonstration: a robot that crosses a track and shifts its gait itself, or on a schedule."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from gaitshift.control import Autonomous, Controller, Driver, Scheduled, Switcher
from gaitshift.control.cpg import GAITS, CpgController
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.rollout import RolloutConfig, rollout
from gaitshift.lab.log import Log
from gaitshift.shift import GaitGraph, load_condition
from gaitshift.sim.terrain import Terrain, from_spec
from gaitshift.sim.world import World

RUN_OUT = 8.0
"""Level metres behind the finish, for robots that wait there for the slower ones."""

WIDTH = 8.0
"""Width of a track [m]."""

START = 1.5
"""Where robots start along the track [m]."""


_NUMBERS = ("alpha", "beta", "leak", "alpha_back", "beta_back", "hold")
"""Numbers of a condition that a demonstration may change."""


@dataclass(frozen=True, kw_only=True)
class DemoConfig:
    """What the demonstration shows."""

    track: str = "flat@8,perlin:0.10@12,flat@10"
    """Terrain: pieces with lengths in metres; see `evaluate --terrain` for pieces."""
    flat_gait: str = "trot"
    """Gait on flat ground and at the start."""
    rough_gait: str = "bound"
    """Gait on rough ground."""
    condition: str = "touchdown_surprise"
    """Shift condition: `touchdown_surprise`, which does not fire on slopes and steps;
    `height_difference`, the paper's statistic with our settings; `paper`, with the paper's."""
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
    """Least time in a gait between two shifts [s]."""
    controller: Literal["policy", "cpg"] = "policy"
    """Controller: trained policies, or coupled oscillators without learning (trot, pace, bound,
    walk), which are slow and only cross low noise."""
    graph: str = ""
    """Gait graph, in place of the two gaits and the condition: a shipped graph or a .toml file."""
    gaits: tuple[str, ...] = ()
    """Gaits to show in sequence on a schedule, in place of the condition."""
    every: float = 3.0
    """Time between two shifts of `gaits` [s]."""
    at: tuple[float, ...] = ()
    """Times of the shifts between `gaits` [s], in place of `every`."""
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
        given = [name for name in _NUMBERS if getattr(self, name) is not None]
        if self.graph and given:
            raise GaitshiftError(
                f"{given[0]} must not be given with a graph; change it in the graph's file"
            )
        if len(self.gaits) == 1:
            raise GaitshiftError(f"gaits must name two gaits or more, got {self.gaits[0]} alone")

        if self.at and len(self.at) != len(self.gaits) - 1:
            raise GaitshiftError(
                f"at must give {max(0, len(self.gaits) - 1)} times for {len(self.gaits)} gaits, "
                f"one for each shift, got {len(self.at)}"
            )
        if any(late <= early for early, late in pairwise((0.0, *self.at))):
            raise GaitshiftError(f"at must give rising times above 0 s, got {list(self.at)}")

    @property
    def shift_times(self) -> tuple[float, ...]:
        """When the shifts of a schedule are due [s]."""
        return self.at or tuple(self.every * i for i in range(1, len(self.gaits)))

    @property
    def used(self) -> tuple[str, ...]:
        """The gaits that appear, each once, the first first."""
        return tuple(dict.fromkeys(self.gaits)) or self.ways.gaits

    @property
    def ways(self) -> GaitGraph:
        """The gait graph that the robots shift by; `GaitshiftError` where it cannot be had."""
        if self.graph:
            return GaitGraph.load(self.graph)
        condition = load_condition(self.condition, **{k: getattr(self, k) for k in _NUMBERS})
        return GaitGraph.of(condition, flat=self.flat_gait, rough=self.rough_gait)


def run_demo(
    config: DemoConfig,
    policies: Mapping[str, Policy],
    report: Callable[[int, int], None] = lambda done, total: None,
) -> tuple[Log, list[dict[str, Any]]]:
    """Runs the demonstration: the log of all robots, and a summary for each."""
    n = config.episodes
    rng = np.random.default_rng(config.seed)
    driver = _controller(config, policies)
    switcher = _switcher(config)
    grounds = [_ground(config, config.seed + i) for i in range(n)]
    finish = _finish(config, grounds[0])
    slowest = _slowest(config, policies)
    run = RolloutConfig(seconds=_seconds(config, finish, slowest))
    world = World(driver.robot, grounds, n, gains=driver.gains)
    start = np.tile([START, 0.0], (n, 1))
    log = rollout(
        world,
        driver,
        run,
        start_xy=start,
        rng=rng,
        switcher=switcher,
        finish_x=finish,
        report=report,
    )
    return log, [summarise(log, robot, finish) for robot in range(n)]


def summarise(log: Log, robot: int, finish: float = np.inf) -> dict[str, Any]:
    """What one robot did until it crossed `finish` [m] or the run ended.

    Survival, distance, mean speed, and every shift of gait.
    """
    x = log.qpos[:, robot, 0]
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


def _controller(config: DemoConfig, policies: Mapping[str, Policy]) -> Controller:
    used, n = config.used, config.episodes
    if config.controller == "cpg":
        return CpgController(used, n, start=used[0])
    return Driver({gait: policies[gait] for gait in used}, n, start=used[0])


def _slowest(config: DemoConfig, policies: Mapping[str, Policy]) -> float:
    """Speed of the slowest gait that appears [m/s]."""
    if config.controller == "cpg":
        return min(GAITS[gait].speed for gait in config.used)
    return min(policies[gait].info.forward_speed for gait in config.used)


def _switcher(config: DemoConfig) -> Switcher:
    if config.gaits:
        return Scheduled(tuple(zip(config.shift_times, config.gaits[1:], strict=True)))
    return Autonomous(config.ways, config.episodes)


def _ground(config: DemoConfig, seed: int) -> Terrain:
    if config.gaits:
        return from_spec("flat", seed=seed, length=10.0, width=WIDTH)
    return from_spec(f"{config.track},flat@{RUN_OUT}", seed=seed, length=1.0, width=WIDTH)


def _finish(config: DemoConfig, ground: Terrain) -> float:
    return np.inf if config.gaits else ground.extent[1] - RUN_OUT


def _seconds(config: DemoConfig, finish: float, speed: float) -> float:
    """Long enough for a robot at two thirds of the commanded speed [m/s]."""
    if config.gaits:
        return config.shift_times[-1] + config.every
    return 1.5 * (finish - START) / speed
