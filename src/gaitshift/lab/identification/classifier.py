"""An upper bound: gradient boosting on windows of the signals of the conditions."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast
from zlib import crc32

import numpy as np
from jaxtyping import Bool, Float, Int
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

_PER_STATISTIC = 1 + len(_WINDOWS)
"""Inputs of each statistic."""

_EVERY = 5
"""It is evaluated at every fifth step; its output is constant in between."""

_SEED = 0


@dataclass(frozen=True, kw_only=True, eq=False)
class Examples:
    """Inputs and labels at K steps of the robots of some recordings."""

    statistics: list[int]
    """Numbers in `_STATISTICS` of those whose signals the recordings have."""
    inputs: Float[np.ndarray, "K F"]
    """Inputs, three a statistic."""
    is_rough: Bool[np.ndarray, " K"]
    """Labels."""
    robot: Int[np.ndarray, " K"]
    """Numbers of the robots, from 0."""
    robots: int
    """Robots of all recordings."""
    first: list[list[int]]
    """Key of each recording, and number of its first robot."""

    @classmethod
    def of(cls, recordings: Iterable[LabelledRun]) -> "Examples":
        """The examples in recordings with the same signals; robots that have fallen give none."""
        statistics: list[int] = []
        inputs, is_rough = [np.empty((0, 0), np.float32)], [np.empty(0, bool)]
        robot, first, count = [np.empty(0, int)], list[list[int]](), 0
        for recording in recordings:
            if not first:
                statistics = _fed_by(recording)
                inputs = [np.empty((0, len(statistics) * _PER_STATISTIC), np.float32)]
            seen = _features(recording, [_STATISTICS[i] for i in statistics])
            rough, alive = recording.rough[::_EVERY], recording.alive[::_EVERY]
            first.append([_key(recording), count])
            for one in range(recording.robots):
                standing = alive[:, one]
                inputs.append(seen[standing, one])
                is_rough.append(rough[standing, one])
                robot.append(np.full(np.count_nonzero(standing), count))
                count += 1
        return cls(
            statistics=statistics,
            inputs=np.concatenate(inputs),
            is_rough=np.concatenate(is_rough),
            robot=np.concatenate(robot),
            robots=count,
            first=first,
        )

    def inputs_of(self, statistics: Sequence[int]) -> Float[np.ndarray, "K G"]:
        """The inputs of some of the statistics."""
        by_statistic = self.inputs.reshape(len(self.inputs), -1, _PER_STATISTIC)
        chosen = by_statistic[:, [self.statistics.index(i) for i in statistics]]
        return chosen.reshape(len(self.inputs), -1)


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
        """Learns rough from smooth ground; errors as in `learn`."""
        return cls.learn([Examples.of(recordings)])

    @classmethod
    def learn(cls, examples: Sequence[Examples]) -> "RoughnessClassifier":
        """Learns from the examples of several logs; the same examples give the same classifier.

        Raises:
            GaitshiftError: there are fewer than two robots, or all labels are the same.
        """
        some = [one for one in examples if one.robots]
        before = np.cumsum([0, *(one.robots for one in some)])
        if before[-1] < 2:
            raise GaitshiftError(
                "a classifier needs two robots or more, or several passages of one"
            )
        everywhere = [
            number
            for number in range(len(_STATISTICS))
            if all(number in one.statistics for one in some)
        ]
        inputs = np.concatenate([one.inputs_of(everywhere) for one in some])
        is_rough = np.concatenate([one.is_rough for one in some])
        half = np.concatenate([one.robot + n for one, n in zip(some, before, strict=False)]) % 2
        first, second = (_fitted(inputs[half == i], is_rough[half == i]) for i in (0, 1))
        return cls(
            statistics=tuple(_STATISTICS[i] for i in everywhere),
            models=(first, second),
            halves={
                key: int(number + n) % 2
                for one, n in zip(some, before, strict=False)
                for key, number in one.first
            },
        )

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


def _fed_by(recording: LabelledRun) -> list[int]:
    """Numbers of the statistics whose signals a recording has."""
    return [
        number
        for number, statistic in enumerate(_STATISTICS)
        if all(getattr(recording.sensed, name) is not None for name in statistic.needs)
    ]


def _key(recording: LabelledRun) -> int:
    return crc32(recording.sensed.foot_position_b.tobytes())


def _features(
    recording: LabelledRun, statistics: Sequence[AnyStatistic]
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
