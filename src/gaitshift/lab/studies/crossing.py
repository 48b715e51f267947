"""Does the shift help? Robots cross noise in one gait, in the other, or shifted by a condition."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control import Autonomous, Driver
from gaitshift.control.policy import Policy
from gaitshift.lab.evaluation.evaluate import grounds_of, starts
from gaitshift.lab.evaluation.rollout import RolloutConfig, rollout
from gaitshift.lab.identification import is_rough
from gaitshift.lab.log import Log
from gaitshift.lab.studies.batches import in_batches
from gaitshift.robot.state import GRAVITY, Privileged
from gaitshift.shift import GaitGraph, between, load_graph
from gaitshift.sim.world import World

BEFORE, NOISE, AFTER = 4.0, 15.0, 5.0
"""Metres of level ground, of noise, and of level ground again, from the start to the finish."""

PATIENCE = 2.0
"""Time limit of the robots over the time that they need at the commanded speed."""

BATCH = 256
"""Robots at a time, over eight fields of noise."""


@dataclass(frozen=True)
class Strategy:
    """How robots choose their gait."""

    name: str
    """Name in tables."""
    start: str
    """Gait at the start."""
    graph: GaitGraph | None = None
    """Gait graph by which they shift; None: they keep their gait."""

    @property
    def gaits(self) -> tuple[str, ...]:
        """All gaits that may appear."""
        return (self.start,) if self.graph is None else self.graph.gaits


def strategies(flat: str, rough: str, conditions: Sequence[str]) -> tuple[Strategy, ...]:
    """Either gait alone, shifts by each of these conditions, and shifts by an oracle."""
    return (
        Strategy(f"{flat} only", flat),
        Strategy(f"{rough} only", rough),
        *(
            Strategy(name, flat, between(load_graph(name), flat=flat, rough=rough))
            for name in dict.fromkeys((*conditions, "oracle"))
        ),
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Crossings:
    """Results of N crossings."""

    fell: Bool[np.ndarray, " N"]
    """Whether the robot fell before the finish."""
    arrived: Bool[np.ndarray, " N"]
    """Whether it reached the finish in time."""
    distance: Float[np.ndarray, " N"]
    """Distance along x, at most to the finish [m]."""
    speed: Float[np.ndarray, " N"]
    """Distance over the time until the finish, the fall or the end [m/s]."""
    cost_of_transport: Float[np.ndarray, " N"]
    """Energy Σ|τ q̇| dt over weight and distance; NaN for robots that walked less than a metre."""
    shifts: Int[np.ndarray, " N"]
    """Changes of gait until then."""


def cross(
    policies: Mapping[str, Policy],
    way: Strategy,
    *,
    amplitude: float,
    runs: int,
    seed: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Crossings:
    """Runs robots over noise of an amplitude [m]; fields and starts are the same for all."""
    return in_batches(
        lambda n, seed: _batch(policies, way, amplitude, n, seed=seed),
        runs,
        most=BATCH,
        seed=seed,
        report=report,
    )


def _batch(
    policies: Mapping[str, Policy], way: Strategy, amplitude: float, n: int, *, seed: int
) -> Crossings:
    rng = np.random.default_rng(seed)
    way_to_go = BEFORE + NOISE + AFTER
    slowest = min(policies[gait].info.forward_speed for gait in way.gaits)
    seconds = PATIENCE * way_to_go / slowest
    noise = f"perlin:{amplitude:g}@{NOISE:g}" if amplitude else f"flat@{NOISE:g}"
    track = f"flat@{BEFORE + 2:g},{noise},flat@{2 * AFTER + 10:g}"
    grounds = grounds_of(track, seed=seed, speed=0.0, seconds=seconds)
    driver = Driver({gait: policies[gait] for gait in way.gaits}, n, start=way.start)
    world = World(driver.robot, grounds, n, gains=driver.gains)
    name, x0, length = grounds[0].name, grounds[0].origin[0], grounds[0].size[0]

    def rough(truth: Privileged) -> Bool[np.ndarray, " N"]:
        return is_rough(truth.base_position_w[:, 0], name, x0, length)

    start = starts(driver, rng)
    log = rollout(
        world,
        driver,
        RolloutConfig(seconds=seconds),
        start_xy=start,
        rng=rng,
        switcher=None if way.graph is None else Autonomous(way.graph, n, rough=rough),
        finish_x=float(start[:, 0].max()) + way_to_go,
    )
    return measure_crossings(log, way_to_go, driver.robot.mass)


def measure_crossings(log: Log, way_to_go: float, mass: float) -> Crossings:
    """The results in a log of robots of this mass [kg] on a way of this length [m]."""
    x = log.truth.base_position_w[..., 0].astype(float) - log.truth.base_position_w[0, :, 0]
    over = ((x >= way_to_go) | log.fallen).cumsum(axis=0) > 0
    # entries until the finish, the fall or the end, itself included
    count = np.minimum((~over).sum(axis=0) + 1, len(x))
    last, robots = count - 1, cast(Any, np.arange(x.shape[1]))
    fell = log.fallen[last, robots]
    arrived = ~fell & (x[last, robots] >= way_to_go)
    distance = np.clip(x[last, robots], 0.0, way_to_go)
    period = float(log.time[1] - log.time[0])
    going = np.arange(len(x))[:, None] < count
    power = log.sensed.power.astype(float)
    work = (power * going).sum(axis=0) * period
    weight = mass * GRAVITY
    far = distance >= 1.0
    changed = (np.diff(log.gait, axis=0) != 0) & going[1:]
    return Crossings(
        fell=fell,
        arrived=arrived,
        distance=distance,
        speed=distance / (count * period),
        cost_of_transport=np.where(far, work / (weight * np.where(far, distance, 1.0)), np.nan),
        shifts=changed.sum(axis=0),
    )
