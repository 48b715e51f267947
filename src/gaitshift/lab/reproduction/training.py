"""Trains jobs to their end in several processes, and resumes those that were interrupted."""

import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, cast

from gaitshift import table
from gaitshift.control import policy
from gaitshift.data import json_in
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.lab.reproduction.plan import Job
from gaitshift.learn.learner import DivergedError
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig
from gaitshift.learn.run_folder import CHECKPOINTS, CONFIG, POLICY, PROGRESS
from gaitshift.whole_file import write_text

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
    with only_writer(folder):
        run = Run.resume(folder) if _started(folder) else _create(job, folder)
        try:
            run.train()
        except DivergedError as error:
            write_text(folder / FAILED, f"{error}\n")


def iterations_done(folder: Path) -> int:
    """Iterations that a run has done, by the rows of its progress."""
    path = folder / PROGRESS
    return len(table.read(path, may_be_cut=True)) if path.is_file() else 0


def _started(folder: Path) -> bool:
    return any((folder / CHECKPOINTS).glob("*.pt"))


def _create(job: Job, folder: Path) -> Run:
    config = RunConfig(
        machine=job.machine,
        recipe=job.recipe,
        seed=job.seed,
        command=f"gaitshift reproduce --only {job.setting.name}",
    )
    return Run.create(folder, config, overwrite=(folder / CONFIG).is_file())


def _trained_to_the_end(job: Job, folder: Path) -> bool:
    """Whether the policy is that of the last iteration, and not that of an interruption."""
    path = folder / POLICY
    if not path.is_file():
        return False
    return policy.load(path).info.training.get("iterations") == job.recipe.iterations


def _check_same(job: Job, folder: Path) -> None:
    wanted: dict[str, Any] = {
        "seed": job.seed,
        "machine": job.machine.to_dict(),
        "recipe": asdict(job.recipe),
    }
    try:
        saved = json_in(folder / CONFIG)
        if not isinstance(saved, dict):
            raise GaitshiftError(f"must be a table, got {shortened(saved)}")
    except GaitshiftError as error:
        raise GaitshiftError(f"{folder / CONFIG} cannot be read: {error}") from error
    for name, value in wanted.items():
        if cast(dict[str, Any], saved).get(name) != json.loads(json.dumps(value)):
            raise GaitshiftError(
                f"{folder} is a run with another {name}; give another --runs, or remove it"
            )


LOOK_EVERY = 1.0
"""Seconds between two updates of the progress."""


def train_all(
    jobs: Sequence[Job],
    runs: Path,
    processes: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Trains all unfinished jobs, each in the folder of its name below `runs`.

    `report` is called with the iterations done and those that were left at the start. When this
    function ends, its processes end; the same call resumes from the last checkpoints.

    Raises:
        GaitshiftError: a folder holds another run, or a process was killed.
    """
    left = [job for job in jobs if not is_over(job, runs / job.name)]
    if not left:
        return
    before = {job.name: iterations_done(runs / job.name) for job in left}
    total = sum(job.recipe.iterations - before[job.name] for job in left)
    executor = ProcessPoolExecutor(
        max_workers=min(processes, len(left)),
        mp_context=multiprocessing.get_context("spawn"),
        initializer=_end_with_parent,
    )
    try:
        with _interrupts_ignored():  # the processes inherit it: Ctrl-C is for this one to answer
            waiting = {executor.submit(train, job, runs / job.name) for job in left}
        while waiting:
            ended, waiting = wait(waiting, timeout=LOOK_EVERY, return_when=FIRST_COMPLETED)
            _raise_first(ended)
            report(sum(_new_iterations(job, runs, before) for job in left), total)
    except BrokenProcessPool:
        raise GaitshiftError(
            "a training process was killed, perhaps out of memory; run the same command to resume"
        ) from None
    finally:
        for process in multiprocessing.active_children():
            process.terminate()
        executor.shutdown(cancel_futures=True)


def _new_iterations(job: Job, runs: Path, before: dict[str, int]) -> int:
    """Iterations since the start of this command; a diverged run counts as complete."""
    folder = runs / job.name
    if (folder / FAILED).is_file():
        return job.recipe.iterations - before[job.name]
    return max(0, iterations_done(folder) - before[job.name])


def _raise_first(ended: set[Future[None]]) -> None:
    for future in ended:
        future.result()


@contextmanager
def _interrupts_ignored() -> Generator[None]:
    kept = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, kept)


def _end_with_parent() -> None:
    """Ends this process when the command ends, even if the command is killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
