"""The runs of a plan as they lie in their folders: courses by setting and gait."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from statistics import fmean

from gaitshift.lab.reproduction.courses import (
    WALKING_CHANGES,
    WALKING_SPEED,
    Course,
    median_iteration,
)
from gaitshift.lab.reproduction.landmarks import GAITS
from gaitshift.lab.reproduction.plan import ABLATED, Job, Plan
from gaitshift.lab.reproduction.settings import ABLATIONS, PAPER
from gaitshift.lab.reproduction.told import Told
from gaitshift.lab.reproduction.training import FAILED, is_over
from gaitshift.learn.run import PROGRESS


@dataclass(frozen=True, kw_only=True)
class Seeds:
    """The runs of one setting and gait that differ in nothing but their seed."""

    jobs: tuple[Job, ...]
    """Those that are over."""
    courses: tuple[Course, ...]
    """One a job; a run that broke down has a short one, an empty one perhaps."""
    broken: tuple[bool, ...]
    """Which of them broke down in their own numbers."""

    def __len__(self) -> int:
        return len(self.jobs)

    def cut(self, iterations: int, seeds: int) -> "Seeds":
        """The first seeds, and the first of their iterations."""
        courses = tuple(course.cut(iterations) for course in self.courses[:seeds])
        return Seeds(jobs=self.jobs[:seeds], courses=courses, broken=self.broken[:seeds])

    @property
    def walking(self) -> int:
        """How many walk over the last tenth of their course, by speed and machine."""
        return sum(
            course.late("speed") > WALKING_SPEED and course.late("changes_per_s") > WALKING_CHANGES
            for course in self._sound
        )

    @property
    def moving(self) -> int:
        """How many are as fast then, in whatever gait."""
        return sum(course.late("speed") > WALKING_SPEED for course in self._sound)

    @property
    def walk_from(self) -> float | None:
        """Median iteration from which they walk; None if the middle one never does."""
        return median_iteration([course.walks_at for course in self.courses])

    @property
    def move_from(self) -> float | None:
        """Median iteration from which they are as fast."""
        return median_iteration([course.moves_at for course in self.courses])

    @property
    def cross_zero_at(self) -> float | None:
        """Median iteration from which their reward is positive."""
        return median_iteration([course.crosses_zero_at for course in self.courses])

    def late(self, column: str) -> float | None:
        """Mean over the runs that did not break down, over the last tenth of each."""
        values = [course.late(column) for course in self._sound]
        return fmean(values) if values and all(map(isfinite, values)) else None

    @property
    def _sound(self) -> list[Course]:
        return [c for c, broken in zip(self.courses, self.broken, strict=True) if not broken]


@dataclass(frozen=True, kw_only=True)
class Results:
    """All that is over of a plan."""

    plan: Plan
    """What was to be run."""
    seeds: Mapping[tuple[str, str], Seeds]
    """By name of setting and gait; what has no run that is over is missing."""

    @classmethod
    def read(cls, plan: Plan, runs: Path, told: Told | None = None) -> "Results":
        """Reads the progress of every run of the plan that is over, or that a report tells of."""
        told = told or Told()
        found: dict[tuple[str, str], Seeds] = {}
        for job in plan.jobs:
            folder = runs / job.name
            if is_over(job, folder):
                progress = folder / PROGRESS
                course = Course.read(progress) if progress.is_file() else Course.empty()
                broken = (folder / FAILED).is_file()
            elif job.name in told.courses:
                course, broken = told.courses[job.name], job.name in told.broken
            else:
                continue
            key = (job.setting.name, job.gait)
            sofar = found.get(key, Seeds(jobs=(), courses=(), broken=()))
            found[key] = replace(
                sofar,
                jobs=(*sofar.jobs, job),
                courses=(*sofar.courses, course),
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
        """What ablations are held against: as many seeds and iterations as they have."""
        whole = self.seeds.get((PAPER, ABLATED))
        if whole is None:
            return None
        return whole.cut(self.plan.ablation_iterations, self.plan.ablation_seeds)

    def ablations(self) -> Iterator[tuple[str, Seeds]]:
        """The ablations that are there, by the name of their setting."""
        for setting in ABLATIONS:
            if (setting.name, ABLATED) in self.seeds:
                yield setting.name, self.seeds[setting.name, ABLATED]
