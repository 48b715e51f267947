"""An upper bound: gradient boosting on windows of the signals of the conditions."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, cast
from zlib import crc32

import numpy as np
from jaxtyping import Bool, Float
from sklearn.ensemble import HistGradientBoostingClassifier
from threadpoolctl import threadpool_limits

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.candidates import Candidate
from gaitshift.lab.identification.labelled_run import LabelledRun
from gaitshift.shift import (
    AnyStatistic,
    AttitudeVariance,
    ContactTiming,
    CostOfTransport,
    HeightDifference,
    PlaneResidual,
    Slip,
    TouchdownSurprise,
)

NAME = "classifier"

_STATISTICS: tuple[AnyStatistic, ...] = (
    HeightDifference(),
    PlaneResidual(touches=2),
    PlaneResidual(touches=4),
    TouchdownSurprise(memory=1),
    TouchdownSurprise(),
    TouchdownSurprise(memory=12),
    AttitudeVariance(window=0.3),
    AttitudeVariance(window=1.0),
    ContactTiming(),
    Slip(),
    CostOfTransport(window=0.5),
)
"""Its input at a step: the largest value of each, now and over windows."""

_WINDOWS = (0.5, 2.0)
"""Lengths of the windows whose means are inputs too [s]."""

_EVERY = 5
"""It is evaluated at every fifth step; its output is constant in between."""

_SEED = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class RoughnessClassifier:
    """Two models, each fitted on half of the robots, so that one has not seen a given robot."""

    statistics: tuple[AnyStatistic, ...]
    """Statistics whose signals the recordings have."""
    models: tuple[Any, Any]
    """One for each half of the robots."""
    halves: Mapping[int, int]
    """Half of the first robot of each recording; the halves alternate from robot to robot."""

    @classmethod
    def fit(cls, recordings: Iterable[LabelledRun]) -> "RoughnessClassifier":
        """Learns rough from smooth ground.

        Raises:
            GaitshiftError: all labels are the same.
        """
        features: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        labels: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
        statistics: tuple[AnyStatistic, ...] = ()
        halves: dict[int, int] = {}
        count = 0
        for recording in recordings:
            statistics = statistics or _fed_by(recording)
            seen = _features(recording, statistics)
            rough, alive = recording.rough[::_EVERY], recording.alive[::_EVERY]
            halves[_key(recording)] = count % 2
            for robot in range(recording.robots):
                half, standing = count % 2, alive[:, robot]
                count += 1
                features[half].append(seen[standing, robot])
                labels[half].append(rough[standing, robot])
        if not (features[0] and features[1]):
            raise GaitshiftError(
                "a classifier needs two robots or more, or several passages of one"
            )
        models = tuple(
            _fitted(np.concatenate(x), np.concatenate(y))
            for x, y in zip(features, labels, strict=True)
        )
        return cls(statistics=statistics, models=cast(Any, models), halves=halves)

    def probability(self, recording: LabelledRun, *, crosswise: bool) -> Float[np.ndarray, "T N 1"]:
        """Probability of rough ground, by both models, or by the one that has not seen the robot.

        `crosswise` selects the latter, for the recordings on which the models were fitted.
        """
        seen = _features(recording, self.statistics)
        steps, robots, width = seen.shape
        flat = seen.reshape(steps * robots, width)
        with threadpool_limits(1):  # batches are too small for threads
            first, second = (_likely(model, flat).reshape(steps, robots) for model in self.models)
        likely = (first + second) / 2
        if crosswise:
            half = cast(Any, (self.halves[_key(recording)] + np.arange(robots)) % 2)
            likely = np.where(half == 0, second, first)
        return np.repeat(likely, _EVERY, axis=0)[: len(recording.time), :, None]

    def candidate(self, *, crosswise: bool) -> Candidate:
        """The classifier as a condition whose α is a probability."""
        return Candidate(
            name=NAME,
            low=0.02,
            high=0.999,
            note="gradient boosting on all statistics: the upper bound",
            values=lambda recording: self.probability(recording, crosswise=crosswise),
        )


def _fed_by(recording: LabelledRun) -> tuple[AnyStatistic, ...]:
    return tuple(
        s
        for s in _STATISTICS
        if all(getattr(recording.sensed, name) is not None for name in s.needs)
    )


def _key(recording: LabelledRun) -> int:
    return crc32(recording.sensed.foot_position_b.tobytes())


def _features(
    recording: LabelledRun, statistics: tuple[AnyStatistic, ...]
) -> Float[np.ndarray, "S N F"]:
    """Inputs of the classifier at every fifth step; NaN where nothing is known yet."""
    columns: list[np.ndarray] = []
    recording.compute(statistics)
    for statistic in statistics:
        values = recording.values(statistic)
        known = ~np.isnan(values)
        now = np.where(known.any(axis=2), np.where(known, values, -np.inf).max(axis=2), np.nan)
        columns.append(now[::_EVERY])
        total = np.nan_to_num(now).cumsum(axis=0)
        for seconds in _WINDOWS:
            back = max(1, round(seconds / recording.period))
            before = np.concatenate([np.zeros((back, recording.robots)), total])[: len(total)]
            columns.append(((total - before) / back)[::_EVERY])
    return np.stack(columns, axis=2).astype(np.float32)


def _fitted(x: Float[np.ndarray, "K F"], y: Bool[np.ndarray, " K"]) -> Any:
    if y.all() or not y.any():
        kind = "rough" if y.all() else "smooth"
        raise GaitshiftError(
            f"a classifier needs labels of rough and smooth ground, got {kind} only"
        )
    model: Any = HistGradientBoostingClassifier(random_state=_SEED, class_weight="balanced")
    with threadpool_limits(1):
        model.fit(x, y)
    return model


def _likely(model: Any, x: Float[np.ndarray, "K F"]) -> Float[np.ndarray, " K"]:
    return np.asarray(model.predict_proba(x))[:, 1]
