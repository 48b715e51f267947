"""The standard trials of a shipped policy, and the limits of their figures."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import ceil
from typing import Any, Literal

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.control.policy import Policy
from gaitshift.lab.evaluation.evaluate import (
    FIELDS,
    RUN_UP,
    EvaluationConfig,
    evaluate,
    field_length,
    run_policy,
)
from gaitshift.lab.gait_analysis import Check, checks
from gaitshift.lab.gait_analysis.verdict import FIRST, limits_of
from gaitshift.lab.log import Log
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.simulator import SimulatorName

BATCH = 1_000_000
"""Largest number of control steps of all robots in a batch: its log takes about 330 MB."""

Report = Callable[[int, int], None]


@dataclass(frozen=True, kw_only=True)
class Size:
    """Size of the trials."""

    pushed: int
    """Episodes on flat ground with pushes."""
    episodes: int
    """Episodes of every other trial."""
    seconds: float
    """Length of an episode [s]."""
    distance: float
    """Distance after which the lateral error is measured [m]."""


SIZES = {
    "all": Size(pushed=1000, episodes=256, seconds=20.0, distance=50.0),
    "short": Size(pushed=256, episodes=64, seconds=20.0, distance=50.0),
    "quick": Size(pushed=24, episodes=24, seconds=10.0, distance=5.0),
}
"""Sizes by their names on the command line. The quick trials are for a first check, but long enough
for robots to reach two steps or stairs."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """A ground, and the figure that is measured on it."""

    figure: Literal["survival", "lateral_error_p95"]
    """`survival`: share of robots that never fall in an episode, reported with the share of the
    commanded distance that they walked. `lateral_error_p95`: 95th percentile over all robots of the
    distance from their line [m] after `Size.distance`; robots that never arrive count as inf."""
    terrain: str
    """Spec of the ground."""
    piece: float | None = None
    """Length of a piece that is repeated [m]; None: one piece."""
    push: float = 0.0
    """Largest push on the base [N]."""
    first: float | None = None
    """Limit for trot, pace and bound; None: the figure is reported."""
    others: float | None = None
    """Limit for every other gait."""

    def title(self, size: Size) -> str:
        """One line that describes the trial, for the table."""
        if self.figure == "lateral_error_p95":
            return f"after {size.distance:g} m [m], {self.terrain}"
        pushes = f", pushes up to {self.push:g} N" if self.push else ""
        return f"of {size.seconds:g} s, {self.terrain}{pushes}"

    def limit(self, gait: str) -> float | None:
        """The limit of its figure for a gait."""
        return self.first if limits_of(gait) is FIRST else self.others

    def spec(self, length: float) -> str:
        """The spec of the ground at this length [m]; repeated pieces begin after level ground."""
        if self.piece is None:
            return self.terrain
        pieces = [f"{self.terrain}@{self.piece:g}"] * ceil(length / self.piece)
        return ",".join([f"flat@{RUN_UP + 1:g}", *pieces])


TRIALS = (
    Trial(figure="survival", terrain="flat", push=120.0, first=0.999, others=0.99),
    Trial(figure="survival", terrain="perlin:0.10", first=0.995, others=0.97),
    Trial(figure="survival", terrain="perlin:0.15", first=0.97),
    Trial(figure="survival", terrain="perlin:0.20"),
    Trial(figure="survival", terrain="perlin:0.25"),
    Trial(figure="survival", terrain="slope:10", first=0.99),
    Trial(figure="survival", terrain="slope:-10", first=0.99),
    Trial(figure="survival", terrain="bank:10", first=0.99),
    Trial(figure="survival", terrain="stairs:0.05", piece=9.0, first=0.97),
    Trial(figure="survival", terrain="step:0.10", piece=6.0, first=0.97),
    Trial(figure="lateral_error_p95", terrain="flat", first=0.5, others=1.0),
    Trial(figure="lateral_error_p95", terrain="perlin:0.07", first=0.5, others=1.0),
)
"""Limits and grounds are ours. A piece of stairs has ten steps up and ten down."""


@dataclass(frozen=True, kw_only=True)
class Row:
    """One line of the table of trials."""

    trial: str
    """Name of the figure and the trial."""
    value: float | None
    """None: too few robots for the figure."""
    bound: Literal["at_least", "at_most"]
    """Whether the limit is a lower or an upper bound."""
    limit: float | None
    """None: the value is reported without a limit."""

    @property
    def passed(self) -> bool | None:
        """Whether the limit is met; None without a limit."""
        if self.limit is None:
            return None
        if self.value is None:
            return False
        return self.value >= self.limit if self.bound == "at_least" else self.value <= self.limit

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "trial": self.trial,
            "value": self.value,
            self.bound: self.limit,
            "passed": self.passed,
        }


def run_trials(
    policy: Policy,
    size: Size,
    seed: int = 0,
    report: Report = lambda done, total: None,
    *,
    sensors: SensorConfig = PERFECT,
    simulator: SimulatorName = "mujoco",
) -> tuple[list[Row], dict[str, Any], Log]:
    """All trials of a policy: the table, the figures of its gait on flat ground, and that log.

    `report` is called with the number of control steps done, of all robots, and the total.
    """
    gait = EvaluationConfig(
        episodes=size.episodes,
        seconds=size.seconds,
        sensors=sensors,
        seed=seed,
        simulator=simulator,
    )
    plan = [list(_batches(trial, policy, gait, size)) for trial in TRIALS]
    total = sum(_cost(config) for config in (gait, *(c for configs in plan for c in configs)))
    done = 0

    def report_of(config: EvaluationConfig) -> Report:
        nonlocal done
        before, cost = done, _cost(config)
        done += cost
        return lambda now, all_: report(before + cost * now // all_, total)

    rows: list[Row] = []
    for trial, configs in zip(TRIALS, plan, strict=True):
        outcomes = [
            _outcomes(trial, policy, config, size.distance, report_of(config)) for config in configs
        ]
        for figure in outcomes[0]:
            values = np.concatenate([outcome[figure] for outcome in outcomes])
            rows.append(_row(trial, figure, size, policy.gait, values))
    figures, log = evaluate(policy, gait, report_of(gait))
    rows.extend(
        Row(trial=_title_of(check), value=check.value, bound=check.bound, limit=check.limit)
        for check in checks(figures, policy.machine)
        if check.figure != "survival"  # the trials measure it with more robots
    )
    return rows, figures, log


def _batches(
    trial: Trial, policy: Policy, run: EvaluationConfig, size: Size
) -> Iterator[EvaluationConfig]:
    """The runs of a trial, like `run`, each with its own seed and so its own grounds."""
    speed, seconds, seed = policy.info.forward_speed, size.seconds, run.seed
    if trial.figure == "lateral_error_p95":
        seconds = 2.0 + 1.5 * size.distance / speed  # for robots at two thirds of their speed
    left = size.pushed if trial.push else size.episodes
    most = max(1, int(BATCH / (100 * seconds) / FIELDS)) * FIELDS
    while left > 0:
        yield replace(
            run,
            terrain=trial.spec(field_length(speed, seconds)),
            episodes=min(left, most),
            seconds=seconds,
            push=trial.push,
            seed=seed,
        )
        left, seed = left - most, seed + 1


def _cost(config: EvaluationConfig) -> int:
    return round(config.episodes * config.seconds * 100)


def _outcomes(
    trial: Trial, policy: Policy, config: EvaluationConfig, distance: float, report: Report
) -> dict[str, Float[np.ndarray, " N"]]:
    """Each figure, for each robot."""
    if trial.figure == "lateral_error_p95":
        log = run_policy(policy, config, finish_x=distance, report=report)
        return {"lateral_error_p95": lateral_errors(log, distance)}
    log = run_policy(policy, config, report=report)
    asked = policy.info.forward_speed * config.seconds
    return {"survival": 1.0 - log.fallen[-1], "distance_share": distances(log) / asked}


def distances(log: Log) -> Float[np.ndarray, " N"]:
    """Distance along x of each robot until it fell or the run ended [m]."""
    last = np.maximum((~log.fallen).sum(axis=0) - 1, 0)
    x = log.truth.base_position_w[..., 0].astype(float)
    return np.take_along_axis(x, last[None], axis=0)[0] - x[0]


def lateral_errors(log: Log, distance: float) -> Float[np.ndarray, " N"]:
    """Distance of each robot from its line after `distance` [m]; inf if it never got there."""
    there: Bool[np.ndarray, "T N"] = (log.truth.base_position_w[..., 0] >= distance) & ~log.fallen
    y = log.truth.base_position_w[..., 1].astype(float)
    first = there.argmax(axis=0)[None]
    error = np.abs(np.take_along_axis(y, first, axis=0)[0] - y[0])
    return np.where(there.any(axis=0), error, np.inf)


def _title_of(check: Check) -> str:
    unit = f" [{check.unit}]" if check.unit else ""
    foot = f", worst foot {check.foot}" if check.foot else ""
    return f"{check.figure}{unit}, flat{foot}"


def _row(
    trial: Trial, figure: str, size: Size, gait: str, outcomes: Float[np.ndarray, " N"]
) -> Row:
    title = f"{figure} {trial.title(size)}"
    limit = trial.limit(gait) if figure == trial.figure else None
    if figure != "lateral_error_p95":
        return Row(trial=title, value=float(outcomes.mean()), bound="at_least", limit=limit)
    # "higher" takes the error of one robot; interpolation with inf gives NaN.
    value = float(np.quantile(outcomes, 0.95, method="higher"))
    finite = value if np.isfinite(value) else None
    return Row(trial=title, value=finite, bound="at_most", limit=limit)
