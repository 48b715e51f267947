"""Runs jobs in a number of parallel processes, and leaves no process behind."""

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Generator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path

from gaitshift.errors import GaitshiftError
from gaitshift.lab.reproduction.plan import Job
from gaitshift.lab.reproduction.training import FAILED, is_over, iterations_done, train

LOOK_EVERY = 1.0
"""Seconds between two checks of the progress."""


def train_all(
    jobs: Sequence[Job],
    runs: Path,
    processes: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Trains all unfinished jobs, each in the folder of its name below `runs`.

    `report` is called with the iterations done and those that remained at the start. The processes
    end with this call, however it ends; the same call resumes from the last checkpoints.

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
        with _interrupts_ignored():  # inherited by the processes: only this one handles Ctrl-C
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
    """Iterations since the start of this command; for a diverged run all that remained."""
    folder = runs / job.name
    if (folder / FAILED).is_file():
        return job.recipe.iterations - before[job.name]
    return max(0, iterations_done(folder) - before[job.name])


def _raise_first(ended: set[Future[None]]) -> None:
    for future in ended:
        future.result()


@contextmanager
def _interrupts_ignored() -> Generator[None]:
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)


def _end_with_parent() -> None:
    """Ends this process with its parent, even if the parent is killed."""
    parent = multiprocessing.parent_process()
    assert parent is not None

    def watch() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()
