"""What was found out is kept, so that a run that was killed goes on where it stopped."""

import hashlib
from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any, TypeVar, cast

from joblib import Memory

PACKAGE = Path(__file__).parents[2]
"""What is kept depends on all code in here."""

Found = TypeVar("Found")
Stamp = tuple[str, int, int]


class StepCache:
    """Steps of a task, each done once, even if the process ends in between.

    A step is done anew where what it depends on, or the code of this package, has changed.
    """

    def __init__(self, folder: Path, report: Callable[[str], None]) -> None:
        """Keeps it in `folder`; `report` is told the name of each step."""
        self._folder = folder
        self._code = _code()
        self._report = report

    @cached_property
    def _step(self) -> Any:
        """Made late: whoever is refused before the first step finds no new folder."""
        memory = cast(Any, Memory)(self._folder, verbose=0, compress=1)
        return memory.cache(_do, ignore=["work"])

    def get(self, name: str, depends_on: Sequence[Any], work: Callable[[], Found]) -> Found:
        """What the work of a step gives, or gave before.

        Args:
            name: told to `report`.
            depends_on: names, numbers and stamps of files; all that decides what the work gives.
            work: does it.
        """
        key = (self._code, name, *depends_on)
        known = self._step.check_call_in_cache(work, key)
        self._report(f"{name} (cached)" if known else name)
        return self._step(work, key)


def stamp(path: Path) -> Stamp:
    """What tells a file from another one, and from an earlier one of its name."""
    status = path.stat()
    return str(path.resolve()), status.st_size, status.st_mtime_ns


def _do(work: Callable[[], Any], key: tuple[Any, ...]) -> Any:
    del key
    return work()


def _code() -> str:
    """Fingerprint of this package: what other code found out is not known to this one."""
    told = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        told.update(path.read_bytes())
    return told.hexdigest()
