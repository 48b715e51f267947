"""One job trained to its end, whatever became of it before."""

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
"""In the folder of a run that broke down in its own numbers: what it died of."""


def is_over(job: Job, folder: Path) -> bool:
    """Whether there is nothing left to do: trained to the end, or broken down on the way.

    Raises:
        GaitshiftError: the folder holds a run of other numbers.
    """
    if not _started(folder):
        return False
    _check_same(job, folder)
    return (folder / FAILED).is_file() or _trained_to_the_end(job, folder)


def train(job: Job, folder: Path) -> None:
    """Trains the job in its folder, from its last checkpoint if there is one.

    A run whose numbers are no longer finite leaves `failed.txt` and what it learned so far: that is
    a finding, and breaks no other run. Whatever else ends it (a full disk, say) is raised, and the
    same call goes on.
    """
    run = Run.resume(folder) if _started(folder) else _create(job, folder)
    try:
        run.train()
    except DivergedError as error:
        (folder / FAILED).write_text(f"{error}\n")


def iterations_done(folder: Path) -> int:
    """Iterations that a run has behind it, by the lines of its progress."""
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
    """Whether the policy is that of the last iteration, and not of an interruption."""
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
        kept = json.loads((folder / CONFIG).read_text())
    except (OSError, ValueError) as error:
        raise GaitshiftError(f"{folder / CONFIG} cannot be read: {error}") from error
    for name, value in wanted.items():
        if kept.get(name) != json.loads(json.dumps(value)):
            raise GaitshiftError(
                f"{folder} is a run with another {name}; give another --runs, or remove it"
            )
