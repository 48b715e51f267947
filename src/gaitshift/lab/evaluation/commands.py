"""How well a policy follows its commands, over the whole range of its training."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitshift.control.policy import Policy
from gaitshift.lab.evaluation.evaluate import EvaluationConfig, evaluate
from gaitshift.sim.sensor_config import PERFECT, SensorConfig

POINTS = 5
"""Number of commands tried in a range, its ends included."""

ROBOTS, SECONDS = 16, 6.0
"""Robots of each run and its length [s]."""


@dataclass(frozen=True, kw_only=True)
class Followed:
    """Result of one pair of commands on flat ground, without the first 2 s."""

    forward_speed: float
    """Commanded [m/s]."""
    stride_frequency: float
    """Commanded [Hz]."""
    speed_mean: float | None
    """Measured [m/s]."""
    cycles_per_s: float | None
    """Measured [Hz]."""
    pattern_fraction: float | None
    """Share of the steps that show a stance of the gait."""
    survival: float
    """Share of the robots that never fall."""


def follow_commands(
    policy: Policy,
    seed: int = 0,
    report: Callable[[int, int], None] = lambda done, total: None,
    *,
    sensors: SensorConfig = PERFECT,
) -> list[Followed]:
    """Speeds over their range at the nominal frequency, then frequencies at the nominal speed.

    `report` is called with the number of runs done and the total.
    """
    info = policy.info
    own = (info.forward_speed, info.stride_frequency)
    asked = [(speed, own[1]) for speed in _spread(info.speed_range)]
    asked += [(own[0], frequency) for frequency in _spread(info.stride_frequency_range)]
    rows: list[Followed] = []
    for speed, frequency in asked:
        rows.append(_follow(policy, speed, frequency, sensors, seed))
        report(len(rows), len(asked))
    return rows


def _spread(ends: list[float]) -> list[float]:
    return np.linspace(ends[0], ends[1], POINTS).tolist()


def _follow(
    policy: Policy, speed: float, frequency: float, sensors: SensorConfig, seed: int
) -> Followed:
    figures, _ = evaluate(
        policy,
        EvaluationConfig(
            episodes=ROBOTS,
            seconds=SECONDS,
            speed=speed,
            stride_frequency=frequency,
            sensors=sensors,
            seed=seed,
        ),
    )
    names = ("speed_mean", "cycles_per_s", "pattern_fraction", "survival")
    measured: dict[str, Any] = {name: figures[name] for name in names}
    return Followed(forward_speed=speed, stride_frequency=frequency, **measured)
