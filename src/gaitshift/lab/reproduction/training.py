"""Trains one job to its end, from the state in its folder."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gaitshift import table
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.reproduction.plan import Job
from gaitshift.learn.learner import DivergedError
from gaitshift.learn.run import CHECKPOINTS, CONFIG, POLICY, PROGRESS, Run

FAILED = "failed.txt"
"""File in the folder of a diverged run, with the error."""


def is_over(job: Job, folder: Path) -> bool:
    """Whether the job is finished: trained to the end, or diverged.

    Raises:
        GaitshiftError: the folder holds a run with other settings.
    """
    if not _started(folder):
        return False
    _check_same(job, folder)
    return (folder / FAILED).is_file() or _trained_to_the_end(job, folder)


def train(job: Job, folder: Path) -> None:
    """Trains the job in its folder, from its last checkpoint if there is one.

    A diverged run leaves `failed.txt` and its results so far; it counts as a result and does not
    stop the other runs. Any other error (such as a full disk) is raised; the same call resumes.
    """
    run = Run.resume(folder) if _started(folder) else _create(job, folder)
    try:
        run.train()
    except DivergedError as error:
        (folder / FAILED).write_text(f"{error}\n")


def iterations_done(folder: Path) -> int:
    """Iterations that a run has done, by the rows of its progress."""
    path = folder / PROGRESS
    return len(table.read(path, may_be_cut=True)) if path.is_file() else 0


def _started(folder: Path) -> bool:
    return any((folder / CHECKPOINTS).glob("*.pt"))


def _create(job: Job, folder: Path) -> Run:
    return Run.create(
        folder,
        job.machine,
        job.recipe,
        seed=job.seed,
        command=f"gaitshift reproduce --only {job.setting.name}",
        overwrite=(folder / CONFIG).is_file(),
    )


def _trained_to_the_end(job: Job, folder: Path) -> bool:
    """Whether the policy is that of the last iteration, and not that of an interruption."""
    path = folder / POLICY
    if not path.is_file():
        return False
    return policy.load(path).info.training["iterations"] == job.recipe.iterations


def _check_same(job: Job, folder: Path) -> None:
    wanted: dict[str, Any] = {
        "seed": job.seed,
        "machine": job.machine.to_dict(),
        "recipe": asdict(job.recipe),
    }
    try:
        saved = json.loads((folder / CONFIG).read_text())
    except (OSError, ValueError) as error:
        raise GaitshiftError(f"{folder / CONFIG} cannot be read: {error}") from error
    for name, value in wanted.items():
        if saved.get(name) != json.loads(json.dumps(value)):
            raise GaitshiftError(
                f"{folder} is a run with another {name}; give another --runs, or remove it"
            )
