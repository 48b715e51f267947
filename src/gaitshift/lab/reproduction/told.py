"""What an earlier report tells of its runs, so that others can be added to it."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from itertools import groupby
from pathlib import Path

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.lab.reproduction.courses import Course
from gaitshift.lab.reproduction.plan import Job, Plan

RUNS, CURVES, GAITS = "runs.csv", "curves.csv", "gaits.csv"

KEY = ("setting", "gait", "seed")
"""What tells the runs of a plan apart, the first columns of each of the tables."""


@dataclass(frozen=True, kw_only=True)
class Told:
    """Runs that are over, by the name of their job; their folders may be gone."""

    courses: Mapping[str, Course] = field(default_factory=dict[str, Course])
    """What each iteration was like."""
    broken: frozenset[str] = frozenset()
    """Those that broke down in their own numbers."""
    figures: Mapping[str, Mapping[str, float | None]] = field(
        default_factory=dict[str, Mapping[str, float | None]]
    )
    """How their policies walked, as far as they were judged."""

    @classmethod
    def read(cls, plan: Plan, out: Path) -> "Told":
        """The runs of a plan in the report in `out`; none where there is no report.

        Raises:
            GaitshiftError: a damaged table, or runs of other numbers than the plan's.
        """
        if not (out / RUNS).is_file():
            return cls()
        jobs: dict[tuple[str, ...], Job] = {
            (job.setting.name, job.gait, str(job.seed)): job for job in plan.jobs
        }
        names, broken = dict[tuple[str, ...], str](), set[str]()
        for key, row in _rows(out / RUNS):
            if key not in jobs:
                continue
            job = jobs[key]
            if row.get("recipe") != fingerprint(job):
                raise GaitshiftError(
                    f"{out / RUNS} has {job.name} with another recipe; give another --out, or "
                    "leave out --add to train it again"
                )
            names[key] = job.name
            if row.get("broke_down") == "True":
                broken.add(job.name)
        courses = {name: Course.empty() for name in broken}
        for key, rows in groupby(_rows(out / CURVES), lambda pair: pair[0]):
            if key in names:
                try:
                    courses[names[key]] = Course.of([row for _, row in rows])
                except (KeyError, ValueError) as error:
                    raise GaitshiftError(f"{out / CURVES} is damaged: {error}") from error
        for key, name in names.items():
            whole = jobs[key].recipe.iterations
            if name not in broken and len(courses.get(name, ())) != whole:
                raise GaitshiftError(
                    f"{out / CURVES} must have {whole} lines of {name}, got "
                    f"{len(courses.get(name, ()))}"
                )
        judged = dict(_rows(out / GAITS)) if (out / GAITS).is_file() else {}
        return cls(
            courses=courses,
            broken=frozenset(broken),
            figures={
                name: _numbers(judged[key], f"{out / GAITS}, {name}")
                for key, name in names.items()
                if key in judged
            },
        )


def fingerprint(job: Job) -> str:
    """Of all that decides what a run does but its seed."""
    numbers = {"machine": job.machine.to_dict(), "recipe": asdict(job.recipe)}
    return hashlib.sha256(json.dumps(numbers, sort_keys=True).encode()).hexdigest()[:12]


def _rows(path: Path) -> list[tuple[tuple[str, ...], dict[str, str]]]:
    """The lines of a table after the runs that they are of."""
    try:
        return [(tuple(row[name] for name in KEY), row) for row in table.read(path)]
    except KeyError as error:
        raise GaitshiftError(f"{path} is damaged: {error}") from error


def _numbers(row: Mapping[str, str], where: str) -> dict[str, float | None]:
    """What of a line is a number; None where nothing was to be told."""
    names = [name for name in row if name not in (*KEY, "walks_from_iteration")]
    try:
        return {name: float(row[name]) if row[name] else None for name in names}
    except ValueError as error:
        raise GaitshiftError(f"{where} is damaged: {error}") from error
