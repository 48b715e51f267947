"""A folder has one writer at a time: others are refused until that process ends."""

import os
import warnings
from collections.abc import Generator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from gaitshift.errors import GaitshiftError

LOCK = ".gaitshift.lock"
"""File in a folder that is being written: its process and when that began. The operating system
holds the lock, so the file that a killed process leaves does not lock the folder."""

_OWNER = "process "
"""How the text in the file begins, where it is ours."""


@contextmanager
def only_writer(folder: Path) -> Generator[None]:
    """Makes the folder and holds its lock during the block; afterwards an empty new folder goes.

    Raises:
        GaitshiftError: another process holds the lock.
    """
    from filelock import FileLock, Timeout  # slow to import, and only writers need it

    if folder.exists() and not folder.is_dir():
        raise GaitshiftError(f"{folder} must be a folder, got a file")
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LOCK
    lock = FileLock(path, timeout=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a file system without flock, where it works as well
        try:
            lock.acquire()
        except Timeout:
            owner = _owner(path) or "another process"
            raise GaitshiftError(
                f"{folder} is being written by {owner}; wait for its end, or give another folder"
            ) from None
    try:
        if _owner(path) is not None:
            owner = f"{_OWNER}{os.getpid()} since {datetime.now():%Y-%m-%d %H:%M:%S}"
            path.write_text(owner, encoding="utf-8")
        yield
    finally:
        if _owner(path) is not None:
            path.unlink(missing_ok=True)
        lock.release()
        with suppress(OSError):
            for path in made:
                path.rmdir()


def _owner(path: Path) -> str | None:
    """The process in a lock file, empty before it is written; None: the file is not ours.

    Without flock the file is a marker of the library's.
    """
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    return text if not text or text.startswith(_OWNER) else None
