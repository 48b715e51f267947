"""Which gait is best where? Survival, progress and cost of each gait at each speed and ground."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from math import sqrt

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.control import Driver
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.evaluate import grounds_of, starts
from gaitshift.lab.evaluation.rollout import RolloutConfig, in_batches, rollout
from gaitshift.lab.gait_analysis.sample import WARM_UP
from gaitshift.lab.identification import wilson
from gaitshift.lab.log import Log
from gaitshift.lab.studies.best import (
    LEAST_SPEED_ERROR,
    SPEED_ERROR,
    Objective,
    rankings,
    stretches,
)
from gaitshift.robot.command import MOST_SPEED
from gaitshift.robot.description import Robot
from gaitshift.robot.state import GRAVITY
from gaitshift.sim.push import PushConfig
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.world import Randomisation, World
from gaitshift.table import Row, markdown

BATCH = 256
"""Robots at a time, over eight fields where the ground is random."""

OWN_BODY = "own"
"""The body of the robot's model."""


@dataclass(frozen=True, kw_only=True)
class Place:
    """What a gait is asked for, and where."""

    ground: str
    """Spec of the ground, as in `evaluate --terrain`."""
    body: str = OWN_BODY
    """What differs from the robot's model (`body_of`)."""
    speed: float
    """Commanded forward speed [m/s]."""
    stride_frequency: float
    """Commanded cycles a second [Hz]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Walks:
    """How N robots walked. Energy, time and distance are those after the warm-up."""

    fell: Bool[np.ndarray, " N"]
    """Whether the robot fell."""
    progress: Float[np.ndarray, " N"]
    """Distance along x until the end or the fall, over the commanded distance."""
    time: Float[np.ndarray, " N"]
    """Until the end or the fall [s]; 0 for a robot that fell within the warm-up."""
    distance: Float[np.ndarray, " N"]
    """Along x in that time [m]."""
    work: Float[np.ndarray, " N"]
    """Mechanical energy Σ|τ q̇| dt [J]."""
    electrical_work: Float[np.ndarray, " N"]
    """Electrical energy (`Motor.electrical_power`) [J]."""
    saturated: Float[np.ndarray, " N"]
    """Time that joints spend at the limit of their motors, the mean over the joints [s]."""


def body_of(spec: str) -> Randomisation:
    """A body that differs from the robot's model in what the spec says, such as `payload:5`.

    Several are joined by `+`; names and units are those of `Randomisation`.

    Raises:
        GaitshiftError: there is no such name, or the value is not allowed.
    """
    if spec == OWN_BODY:
        return Randomisation()
    names = tuple(Randomisation().ranges())
    values: dict[str, tuple[float, float]] = {}
    for part in spec.split("+"):
        name, _, text = part.partition(":")
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        if name not in names or name in values or value != value:
            raise GaitshiftError(
                f"bodies must be {OWN_BODY}, or NAME:VALUE joined by +, with names of "
                f"{', '.join(names)}, each once, got '{spec}'"
            )
        values[name] = (value, value)
    return Randomisation(**values)


def walk(
    policy: Policy,
    place: Place,
    *,
    robots: int,
    seconds: float,
    push: float = 0.0,
    seed: int,
    sensors: SensorConfig = PERFECT,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Walks:
    """Lets robots walk at a place; fields and starts are the same for all gaits."""

    def batch(n: int, seed: int) -> Walks:
        rng = np.random.default_rng(seed)
        driver = Driver({policy.gait: policy}, n, start=policy.gait)
        world = World(
            driver.robot,
            grounds_of(place.ground, seed=seed, speed=place.speed, seconds=seconds),
            n,
            gains=driver.gains,
            randomisation=body_of(place.body),
            sensors=sensors,
            seed=seed,
        )
        world.redraw(np.arange(n), np.random.default_rng(seed))
        run = RolloutConfig(
            seconds=seconds,
            speed=place.speed,
            stride_frequency=place.stride_frequency,
            push=PushConfig(force=push),
        )
        log = rollout(world, driver, run, start_xy=starts(driver, rng), rng=rng)
        return measure_walks(log, driver.robot, asked=place.speed * seconds)

    return in_batches(batch, robots, most=BATCH, seed=seed, report=report)


def measure_walks(log: Log, robot: Robot, *, asked: float) -> Walks:
    """How the robots of a log walked that were asked for this distance [m]."""
    period = float(log.time[1] - log.time[0])
    walks = ~log.fallen
    warm = min(int(np.searchsorted(log.time, WARM_UP, side="right")), len(log.time) - 1)
    later = walks & (np.arange(len(walks)) >= warm)[:, None]
    x = log.truth.base_position_w[..., 0].astype(float)
    last = np.maximum(walks.sum(axis=0) - 1, 0)
    robots = np.arange(log.n)
    torque = log.sensed.need("joint_torque", "a map")
    speed = log.sensed.need("joint_velocity", "a map")
    electrical = robot.motor.electrical_power(torque, speed).astype(float)
    saturated = robot.motor.is_saturated(torque, speed).mean(axis=-1)
    power = log.sensed.power.astype(float)
    return Walks(
        fell=log.fallen[-1],
        progress=(x[last, robots] - x[0]) / asked,
        time=later.sum(axis=0) * period,
        distance=np.where(later.any(axis=0), x[last, robots] - x[warm], 0.0),
        work=(power * later).sum(axis=0) * period,
        electrical_work=(electrical * later).sum(axis=0) * period,
        saturated=(saturated * later).sum(axis=0) * period,
    )


COLUMNS: dict[str, type] = {
    "policy": str,
    "gait": str,
    "ground": str,
    "body": str,
    "speed": float,
    "stride_frequency": float,
    "sensors": str,
    "push": float,
    "seed": int,
    "robots": int,
    "seconds": float,
    "survived": int,
    "low": float,
    "high": float,
    "speed_m_s": float,
    "speed_half": float,
    "progress": float,
    "progress_half": float,
    "cost_of_transport": float,
    "cost_half": float,
    "electrical_cost_of_transport": float,
    "electrical_half": float,
    "saturation": float,
    "leg_m": float,
}
"""`policy` is its name or file as given. `low` and `high` are Wilson's interval of the share that
survived, `…_half` half the width of an interval (95 % both). `leg_m` is the height of the stance,
for Froude numbers."""

KEY = ("policy", "ground", "body", "speed", "stride_frequency")
"""Columns in which all rows differ."""


def row_of(name: str, policy: Policy, place: Place, walks: Walks, **same: float | str) -> Row:
    """The row of the policy called `name`; `same` has the columns that are equal in all rows."""
    n, upright = len(walks.fell), int((~walks.fell).sum())
    low, high = wilson(np.array([float(upright)]), np.array([float(n)]))
    weight = (policy.robot.mass + body_of(place.body).payload[0]) * GRAVITY
    row: Row = {
        "policy": name,
        "gait": policy.gait,
        "ground": place.ground,
        "body": place.body,
        "speed": place.speed,
        "stride_frequency": place.stride_frequency,
        "robots": n,
        "survived": upright,
        "low": round(float(low[0]), 5),
        "high": round(float(high[0]), 5),
        "leg_m": round(policy.robot.stance_height, 4),
        **same,
    }
    asked = np.ones(n)
    for figure, half, over, under in (
        ("speed_m_s", "speed_half", walks.distance, walks.time),
        ("progress", "progress_half", walks.progress, asked),
        ("cost_of_transport", "cost_half", walks.work, weight * walks.distance),
        (
            "electrical_cost_of_transport",
            "electrical_half",
            walks.electrical_work,
            weight * walks.distance,
        ),
    ):
        row[figure], row[half] = ratio(over, under)
    row["saturation"], _ = ratio(walks.saturated, walks.time)
    return {column: row[column] for column in COLUMNS}


def ratio(
    over: Float[np.ndarray, " N"], under: Float[np.ndarray, " N"]
) -> tuple[float | str, float | str]:
    """Σ over / Σ under, and half the width of its interval (95 %, by the delta method).

    Empty texts where there are too few values, or the sum below is not above 0.
    """
    n, total = len(over), float(under.sum())
    if n < 2 or total <= 0.0:
        return "", ""
    value = float(over.sum()) / total
    spread = float((over - value * under).std(ddof=1))
    return round(value, 5), round(1.96 * spread / sqrt(n) / (total / n), 5)


PICTURE = "map.png"

_INTRODUCTION = (
    "Robots walk straight ahead at each speed that a gait's range has; of several stride "
    "frequencies the best counts. A gait can be the best where at least {survival:g} of its robots "
    "survive{speed}; else the reason is in brackets. Fields and starts are the same for all gaits. "
    "Figures leave out the first {warm_up:g} s, and robots after their fall. Cost of transport is "
    "energy over weight and distance, of all robots together; ± is half the width of an interval "
    "(95 %)."
)


def places(
    policies: Mapping[str, Policy],
    *,
    grounds: Sequence[str],
    bodies: Sequence[str],
    speeds: Sequence[float],
    frequencies: int,
) -> list[tuple[str, Place]]:
    """All that a map has: names of policies, and places within their ranges.

    With one frequency it is the gait's own, with more they are spread over its range.
    """
    found: list[tuple[str, Place]] = []
    for ground, body, speed in product(grounds, bodies, speeds):
        for name, policy in policies.items():
            low, high = policy.machine.speed_range
            if not low - 1e-9 <= speed <= high + 1e-9:
                continue
            slowest, fastest = policy.info.stride_frequency_range
            own = [policy.info.stride_frequency]
            if frequencies > 1:
                step = (fastest - slowest) / (frequencies - 1)
                own = [slowest + step * number for number in range(frequencies)]
            found += [
                (name, Place(ground=ground, body=body, speed=speed, stride_frequency=round(f, 4)))
                for f in own
            ]
    return found


def page(rows: Sequence[Row], objective: Objective, command: str) -> str:
    """The whole page; `command` made the last of the rows."""
    speed = (
        ""
        if objective.name == "progress"
        else f" and keep the speed within {100 * SPEED_ERROR:g} % or {LEAST_SPEED_ERROR:g} m/s"
    )
    words = _INTRODUCTION.format(survival=objective.survival, speed=speed, warm_up=WARM_UP)
    parts = [
        "# Which gait is best where?",
        " ".join(answers(rows, objective)),
        words,
        f"Made by `{command}`.",
        f"![{objective.name} over the speed, by gait and ground]({PICTURE})",
    ]
    for ground, of in by_ground(rows):
        parts += [f"## {ground}", _table(of, objective)]
    return "\n\n".join(parts) + "\n"


def by_ground(rows: Sequence[Row]) -> list[tuple[str, list[Row]]]:
    """The rows of each ground and body, with a title."""
    found: dict[str, list[Row]] = {}
    for row in rows:
        title = row["ground"] if row["body"] == OWN_BODY else f"{row['ground']}, {row['body']}"
        found.setdefault(title, []).append(row)
    return list(found.items())


def answers(rows: Sequence[Row], objective: Objective) -> list[str]:
    """The best policies on each ground, in a sentence each."""
    return [_answer(ground, of, objective) for ground, of in by_ground(rows)]


def _answer(ground: str, rows: Sequence[Row], objective: Objective) -> str:
    """The best policies on one ground, in one sentence."""
    parts: list[str] = []
    for one in stretches(rankings(rows, objective)):
        span = f"{one.first:g}" if one.first == one.last else f"{one.first:g} to {one.last:g}"
        parts.append(f"{one.policy or 'no policy'} at {span} m/s")
    return f"On `{ground}` the best by {objective.name} is {', '.join(parts)}."


def _table(rows: Sequence[Row], objective: Objective) -> str:
    """Speeds down, policies across; the best is bold, one that cannot be the best says why."""
    ranked = rankings(rows, objective)
    names = list(dict.fromkeys(row["policy"] for row in rows))
    lines: list[tuple[str, ...]] = []
    for one in ranked:
        of = {row["policy"]: row for row in (*one.rows, *one.others)}
        margin = one.margin(objective)
        by = "" if margin is None else f"{margin[0]:.3f} ± {margin[1]:.3f}"
        cells = (_cell(of.get(name), objective, one.best) for name in names)
        lines.append((f"{one.speed:g}", *cells, by))
    return markdown(("speed [m/s]", *names, "better than the next by"), lines)


def _cell(row: Row | None, objective: Objective, best: str | None) -> str:
    if row is None:
        return "–"
    value = f"{objective.value(row):.3f}" if objective.knows(row) else "–"
    if why := objective.misses(row):
        return f"{value} ({why})"
    return f"**{value}**" if row["policy"] == best else value


def check_speeds(speeds: Sequence[float]) -> None:
    """`GaitshiftError` unless the speeds are above 0 and rising [m/s]."""
    rise = list(speeds) == sorted(set(speeds))
    if not speeds or not rise or not all(0.0 < v <= MOST_SPEED for v in speeds):
        raise GaitshiftError(
            f"speeds must be rising, above 0 and up to {MOST_SPEED:g} m/s, got "
            f"{', '.join(f'{v:g}' for v in speeds) or 'none'}"
        )
