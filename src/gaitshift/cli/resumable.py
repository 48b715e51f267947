"""The table of a command that may be broken off, in a folder that it alone writes."""

from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from gaitshift.cli.output import check_table_folder
from gaitshift.folder_lock import only_writer
from gaitshift.lab.resume import ResumableTable
from gaitshift.table import Columns, Row


@contextmanager
def resumable_table(
    path: Path, columns: Columns, what: str, *, key: tuple[str, ...], same: Row, overwrite: bool
) -> Generator[ResumableTable]:
    """A table to which the block adds rows, while no other process writes into its folder.

    Arguments and errors are those of `ResumableTable.open`; a folder with other files is refused.
    """
    with only_writer(path.parent):
        check_table_folder(path, overwrite=overwrite)
        yield ResumableTable.open(path, columns, what, key=key, same=same, overwrite=overwrite)
