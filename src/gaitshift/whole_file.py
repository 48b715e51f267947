"""Files are written whole or not at all, whatever ends the process or fills the disk."""

import os
from collections.abc import Generator
from contextlib import contextmanager, suppress
from pathlib import Path

PART = ".part"
"""Ending of a file that is being written; a killed process may leave one."""


@contextmanager
def replacing(path: Path) -> Generator[Path]:
    """A part file beside `path` for the block to write; it then replaces `path`, also on the disk.

    Where the block raises an error, `path` stays as it was and the part file is removed.
    """
    part = path.with_name(path.name + PART)
    try:
        yield part
        flush_to_disk(part)
        part.replace(path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    with suppress(OSError):  # some file systems cannot flush a folder
        flush_to_disk(path.parent)


def write_text(path: Path, text: str) -> None:
    """Writes a text file in UTF-8."""
    with replacing(path) as part:
        part.write_bytes(text.encode())


def flush_to_disk(path: Path) -> None:
    """Returns when the content of a file, or the names in a folder, are on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
