"""A cache of the results of steps, so that a killed run resumes where it stopped."""

import hashlib
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

from joblib import Memory

PACKAGE = Path(__file__).parents[2]
"""Folder of the code on which cached results depend."""

Found = TypeVar("Found")
Stamp = tuple[str, int, int]


class StepCache:
    """Steps of a task, each done once, even if the process ends in between.

    A step is repeated if its inputs or the code of this package have changed.
    """

    def __init__(self, folder: Path, report: Callable[[str], None]) -> None:
        """Caches results in `folder`; `report` is called with the name of each step."""
        self._folder = folder
        self._code = _code()
        self._report = report

    @cached_property
    def _step(self) -> Any:
        """Created at the first step, so that an error before it leaves no new folder."""
        memory = cast(Any, Memory)(self._folder, verbose=0, compress=1)
        return memory.cache(_do, ignore=["work"])

    def get(self, name: str, depends_on: Sequence[Any], work: Callable[[], Found]) -> Found:
        """The result of a step, from the cache if it is there.

        Args:
            name: passed to `report`.
            depends_on: names, numbers and stamps of files: all inputs of the step.
            work: computes the result.
        """
        key = (self._code, name, *depends_on)
        known = self._step.check_call_in_cache(work, key)
        self._report(f"{name} (cached)" if known else name)
        return self._step(work, key)


def stamp(path: Path) -> Stamp:
    """A stamp that differs between files, and between versions of a file."""
    status = path.stat()
    return str(path.resolve()), status.st_size, status.st_mtime_ns


def _do(work: Callable[[], Any], key: tuple[Any, ...]) -> Any:
    del key
    return work()


def _code() -> str:
    """Fingerprint of this package's code: results of other code are not reused."""
    fingerprint = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        fingerprint.update(path.read_bytes())
    return fingerprint.hexdigest()
