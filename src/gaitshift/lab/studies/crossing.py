"""Does the shift help? Robots cross noise in one gait, in the other, or shifted by a condition."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, cast

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control import Autonomous, Driver
from gaitshift.control.policy import Policy
from gaitshift.lab.evaluation.evaluate import grounds_of, starts
from gaitshift.lab.evaluation.rollout import RolloutConfig, in_batches, rollout
from gaitshift.lab.identification import is_rough, wilson
from gaitshift.lab.log import Log
from gaitshift.robot.state import GRAVITY, Privileged
from gaitshift.shift import GaitGraph, between, load_graph
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.world import World
from gaitshift.table import Row, markdown

BEFORE, NOISE, AFTER = 4.0, 15.0, 5.0
"""Lengths of level ground, noise, and level ground again, from start to finish [m]."""

PATIENCE = 2.0
"""Time limit, as a multiple of the time at the commanded speed."""

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
    """Changes of gait until the finish, the fall or the end."""


def cross(
    policies: Mapping[str, Policy],
    way: Strategy,
    *,
    amplitude: float,
    runs: int,
    seed: int,
    sensors: SensorConfig = PERFECT,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Crossings:
    """Runs robots over noise of an amplitude [m]; fields and starts are the same for all."""
    return in_batches(
        lambda n, seed: _batch(policies, way, amplitude, n, sensors=sensors, seed=seed),
        runs,
        most=BATCH,
        seed=seed,
        report=report,
    )


def _batch(
    policies: Mapping[str, Policy],
    way: Strategy,
    amplitude: float,
    n: int,
    *,
    sensors: SensorConfig,
    seed: int,
) -> Crossings:
    rng = np.random.default_rng(seed)
    way_to_go = BEFORE + NOISE + AFTER
    slowest = min(policies[gait].info.forward_speed for gait in way.gaits)
    seconds = PATIENCE * way_to_go / slowest
    noise = f"perlin:{amplitude:g}@{NOISE:g}" if amplitude else f"flat@{NOISE:g}"
    track = f"flat@{BEFORE + 2:g},{noise},flat@{2 * AFTER + 10:g}"
    grounds = grounds_of(track, seed=seed, speed=0.0, seconds=seconds)
    driver = Driver({gait: policies[gait] for gait in way.gaits}, n, start=way.start)
    world = World(driver.robot, grounds, n, gains=driver.gains, sensors=sensors, seed=seed)
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


COLUMNS: dict[str, type] = {
    "amplitude": float,
    "way": str,
    "sensors": str,
    "seed": int,
    "runs": int,
    "survived": int,
    "low": float,
    "high": float,
    "arrived": int,
    "distance_m": float,
    "distance_half": float,
    "speed_m_s": float,
    "speed_half": float,
    "cost_of_transport": float,
    "cost_half": float,
    "shifts": float,
    "chattered": int,
}
"""`low` and `high` are Wilson's interval of the share that survived, `…_half` half the width of the
interval of a mean (95 % both)."""

PICTURE = "crossings.png"

ENOUGH = 2
"""Largest number of shifts per stretch of noise without chatter."""


def row_of(
    way: Strategy,
    amplitude: float,
    seed: int,
    crossings: Crossings,
    sensors: SensorConfig = PERFECT,
) -> Row:
    """The results of the crossings of one way, as a row."""
    n, fell = len(crossings.fell), int(crossings.fell.sum())
    low, high = wilson(np.array([float(n - fell)]), np.array([float(n)]))
    cost = crossings.cost_of_transport
    means = {
        "distance_m": (crossings.distance, "distance_half"),
        "speed_m_s": (crossings.speed, "speed_half"),
        "cost_of_transport": (cost[~np.isnan(cost)], "cost_half"),
    }
    row: Row = {
        "amplitude": amplitude,
        "way": way.name,
        "sensors": sensors.name,
        "seed": seed,
        "runs": n,
        "survived": n - fell,
        "low": round(float(low[0]), 5),
        "high": round(float(high[0]), 5),
        "arrived": int(crossings.arrived.sum()),
        "shifts": round(float(crossings.shifts.mean()), 2),
        "chattered": int((crossings.shifts > ENOUGH).sum()),
    }
    for name, (values, half) in means.items():
        row[name], row[half] = mean_of(values)
    return {name: row[name] for name in COLUMNS}


def mean_of(values: Float[np.ndarray, " K"]) -> tuple[float | str, float | str]:
    """Mean, and half the width of its interval (95 %, normal); empty texts where too few."""
    if len(values) < 2:
        return "", ""
    half = 1.96 * float(values.std(ddof=1)) / sqrt(len(values))
    return round(float(values.mean()), 4), round(half, 4)


def page(rows: Sequence[Row], command: str) -> str:
    """The whole page; `command` made the last of the rows."""
    head = (
        "way",
        "survived",
        "interval",
        "arrived",
        "distance [m]",
        "speed [m/s]",
        "CoT",
        "shifts",
        "chattered",
    )
    parts = [
        "# Do more robots survive on rough ground when they shift?",
        _answer(rows),
        f"Robots cross {BEFORE:g} m of level ground, {NOISE:g} m of Perlin noise of one amplitude "
        f"and {AFTER:g} m of level ground: in one gait, in the other, with shifts by a condition, "
        "or with shifts by an oracle that knows where the noise is. Fields and starts are the same "
        "for all. Survived: no fall before the finish. Arrived: at the finish within "
        f"{PATIENCE:g} times the time at the commanded speed. Distance and speed are means over "
        "all robots, up to the fall of those that fell; CoT is over robots that walked at least "
        f"1 m. Chattered: more than {ENOUGH} shifts (one there and one back). Intervals are 95 %, "
        "Wilson intervals for shares.",
        f"Made by `{command}`.",
        f"![Survival, distance, speed and cost of transport over the amplitude]({PICTURE})",
    ]
    for amplitude in dict.fromkeys(row["amplitude"] for row in rows):
        of = [row for row in rows if row["amplitude"] == amplitude]
        parts += [
            f"## {amplitude:g} m",
            markdown(head, [_cells(row) for row in of]),
        ]
    return "\n\n".join(parts) + "\n"


def _answer(rows: Sequence[Row]) -> str:
    """How many robots survive on the roughest ground, in one sentence."""
    largest = max(row["amplitude"] for row in rows)
    of = [row for row in rows if row["amplitude"] == largest]
    counts = ", ".join(f"{row['way']} {row['survived']} of {row['runs']}" for row in of)
    return f"On noise of {largest:g} m these robots survive: {counts}."


def _cells(row: Row) -> tuple[str, ...]:
    def mean(name: str, half: str) -> str:
        return f"{row[name]:.2f} ± {row[half]:.2f}" if row[name] != "" else "–"

    return (
        row["way"],
        f"{row['survived']} of {row['runs']}",
        f"{row['low']:.3f} to {row['high']:.3f}",
        str(row["arrived"]),
        mean("distance_m", "distance_half"),
        mean("speed_m_s", "speed_half"),
        mean("cost_of_transport", "cost_half"),
        f"{row['shifts']:.1f}",
        str(row["chattered"]),
    )
