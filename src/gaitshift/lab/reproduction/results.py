"""The finished runs of a plan, in their folders or in the tables of an earlier report."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from itertools import groupby
from math import isfinite
from pathlib import Path
from statistics import fmean

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.lab.reproduction.learning_curve import (
    WALKING_CHANGES,
    WALKING_SPEED,
    LearningCurve,
    median_iteration,
)
from gaitshift.lab.reproduction.plan import ABLATED, ABLATIONS, GAITS, PAPER, Job, Plan
from gaitshift.lab.reproduction.training import FAILED, is_over
from gaitshift.learn.run_folder import PROGRESS

RUNS_FILE, CURVES_FILE, GAITS_FILE = "runs.csv", "curves.csv", "gaits.csv"

KEY = ("setting", "gait", "seed")
"""The key of a run of a plan: the first columns of each table."""


@dataclass(frozen=True, kw_only=True)
class EarlierRuns:
    """Finished runs by the name of their job; their folders may no longer exist."""

    curves: Mapping[str, LearningCurve] = field(default_factory=dict[str, LearningCurve])
    """Their learning curves."""
    broken: frozenset[str] = frozenset()
    """Those that diverged."""
    figures: Mapping[str, Mapping[str, float | None]] = field(
        default_factory=dict[str, Mapping[str, float | None]]
    )
    """Figures of their policies, as far as they were judged."""

    @classmethod
    def read(cls, plan: Plan, out: Path) -> "EarlierRuns":
        """The runs of a plan in the report in `out`; none where there is no report.

        Raises:
            GaitshiftError: a table is damaged, or has runs with other settings than the plan's.
        """
        if not (out / RUNS_FILE).is_file():
            return cls()
        jobs: dict[tuple[str, ...], Job] = {
            (job.setting.name, job.gait, str(job.seed)): job for job in plan.jobs
        }
        names, broken = dict[tuple[str, ...], str](), set[str]()
        for key, row in _rows(out / RUNS_FILE):
            if key not in jobs:
                continue
            job = jobs[key]
            if row.get("recipe") != fingerprint(job):
                raise GaitshiftError(
                    f"{out / RUNS_FILE} has {job.name} with another recipe; give another --out, or "
                    "leave out --add to train it again"
                )
            names[key] = job.name
            if row.get("broke_down") == "True":
                broken.add(job.name)
        curves = {name: LearningCurve.empty() for name in broken}
        for key, rows in groupby(_rows(out / CURVES_FILE), lambda pair: pair[0]):
            if key in names:
                try:
                    curves[names[key]] = LearningCurve.of([row for _, row in rows])
                except (KeyError, ValueError) as error:
                    raise GaitshiftError(f"{out / CURVES_FILE} is damaged: {error}") from error
        for key, name in names.items():
            whole = jobs[key].recipe.iterations
            if name not in broken and len(curves.get(name, ())) != whole:
                raise GaitshiftError(
                    f"{out / CURVES_FILE} must have {whole} lines of {name}, got "
                    f"{len(curves.get(name, ()))}"
                )
        judged = dict(_rows(out / GAITS_FILE)) if (out / GAITS_FILE).is_file() else {}
        return cls(
            curves=curves,
            broken=frozenset(broken),
            figures={
                name: _numbers(judged[key], f"{out / GAITS_FILE}, {name}")
                for key, name in names.items()
                if key in judged
            },
        )


def fingerprint(job: Job) -> str:
    """Fingerprint of all settings of a run except its seed."""
    numbers = {"machine": job.machine.to_dict(), "recipe": asdict(job.recipe)}
    return hashlib.sha256(json.dumps(numbers, sort_keys=True).encode()).hexdigest()[:12]


def _rows(path: Path) -> list[tuple[tuple[str, ...], dict[str, str]]]:
    """The rows of a table by the key of their run."""
    try:
        return [(tuple(row[name] for name in KEY), row) for row in table.read(path)]
    except KeyError as error:
        raise GaitshiftError(f"{path} is damaged: {error}") from error


def _numbers(row: Mapping[str, str], where: str) -> dict[str, float | None]:
    """The numbers of a row; None for an empty cell."""
    names = [name for name in row if name not in (*KEY, "walks_from_iteration")]
    try:
        return {name: float(row[name]) if row[name] else None for name in names}
    except ValueError as error:
        raise GaitshiftError(f"{where} is damaged: {error}") from error


@dataclass(frozen=True, kw_only=True)
class Seeds:
    """The runs of one setting and gait that differ only in their seed."""

    jobs: tuple[Job, ...]
    """The finished jobs."""
    curves: tuple[LearningCurve, ...]
    """One per job; that of a diverged run is short or even empty."""
    broken: tuple[bool, ...]
    """Which of them diverged."""

    def __len__(self) -> int:
        return len(self.jobs)

    def cut(self, iterations: int, seeds: int) -> "Seeds":
        """The first `seeds` seeds with their first `iterations` iterations."""
        curves = tuple(curve.cut(iterations) for curve in self.curves[:seeds])
        return Seeds(jobs=self.jobs[:seeds], curves=curves, broken=self.broken[:seeds])

    @property
    def walking(self) -> int:
        """Number of runs that walk over the last tenth of their curve, by speed and machine."""
        return sum(
            curve.late("speed") > WALKING_SPEED and curve.late("changes_per_s") > WALKING_CHANGES
            for curve in self._sound
        )

    @property
    def moving(self) -> int:
        """Number of runs that are as fast over the last tenth of their curve, in any gait."""
        return sum(curve.late("speed") > WALKING_SPEED for curve in self._sound)

    @property
    def walk_from(self) -> float | None:
        """Median iteration from which they walk; None if the middle one never does."""
        return median_iteration([curve.walks_at for curve in self.curves])

    @property
    def move_from(self) -> float | None:
        """Median iteration from which they are as fast."""
        return median_iteration([curve.moves_at for curve in self.curves])

    @property
    def cross_zero_at(self) -> float | None:
        """Median iteration from which their reward is positive."""
        return median_iteration([curve.crosses_zero_at for curve in self.curves])

    def late(self, column: str) -> float | None:
        """Mean over the last tenth of the curves of the runs that did not diverge."""
        values = [curve.late(column) for curve in self._sound]
        return fmean(values) if values and all(map(isfinite, values)) else None

    @property
    def _sound(self) -> list[LearningCurve]:
        return [c for c, broken in zip(self.curves, self.broken, strict=True) if not broken]


@dataclass(frozen=True, kw_only=True)
class Results:
    """All finished runs of a plan."""

    plan: Plan
    """The plan."""
    seeds: Mapping[tuple[str, str], Seeds]
    """By name of setting and gait; those without a finished run are missing."""

    @classmethod
    def read(cls, plan: Plan, runs: Path, earlier: EarlierRuns | None = None) -> "Results":
        """Reads the progress of every run of the plan that is finished or in the earlier report."""
        earlier = earlier or EarlierRuns()
        found: dict[tuple[str, str], Seeds] = {}
        for job in plan.jobs:
            folder = runs / job.name
            if is_over(job, folder):
                progress = folder / PROGRESS
                curve = (
                    LearningCurve.read(progress) if progress.is_file() else LearningCurve.empty()
                )
                broken = (folder / FAILED).is_file()
            elif job.name in earlier.curves:
                curve, broken = earlier.curves[job.name], job.name in earlier.broken
            else:
                continue
            key = (job.setting.name, job.gait)
            sofar = found.get(key, Seeds(jobs=(), curves=(), broken=()))
            found[key] = replace(
                sofar,
                jobs=(*sofar.jobs, job),
                curves=(*sofar.curves, curve),
                broken=(*sofar.broken, broken),
            )
        return cls(plan=plan, seeds=found)

    def gaits(self) -> Iterator[tuple[str, Seeds]]:
        """The gaits trained in the paper's setting, in the paper's order."""
        for gait in GAITS:
            if (PAPER, gait) in self.seeds:
                yield gait, self.seeds[PAPER, gait]

    @property
    def reference(self) -> Seeds | None:
        """The reference of the ablations, with their number of seeds and iterations."""
        whole = self.seeds.get((PAPER, ABLATED))
        if whole is None:
            return None
        return whole.cut(self.plan.ablation_iterations, self.plan.ablation_seeds)

    def ablations(self) -> Iterator[tuple[str, Seeds]]:
        """The finished ablations, by the name of their setting."""
        for setting in ABLATIONS:
            if (setting.name, ABLATED) in self.seeds:
                yield setting.name, self.seeds[setting.name, ABLATED]
