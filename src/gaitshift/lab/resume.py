"""Work in parts that resumes after a kill: parts whose result is on disk are not repeated."""

from collections.abc import Callable, Iterable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.table import Columns, Row

Report = Callable[[int, int], None]
"""Takes the work done and the total."""

Progress = Callable[[str], AbstractContextManager[Report]]
"""Shows the progress of the part of this name."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of the work of a command, with one row as its result."""

    name: str
    """For people."""
    find: Callable[[], Row | None]
    """Gives the row of a result that is on disk; None: there is no result."""
    work: Callable[[Report], Row]
    """Does the work, writes the result to disk and gives its row."""


def run_missing(
    parts: Iterable[Part], *, progress: Progress, say: Callable[[str], None]
) -> list[Row]:
    """Does the parts without a result on disk; gives the rows of all parts, in their order.

    Args:
        parts: the whole work.
        progress: shows how far a part is.
        say: takes a line for people on each part that is skipped.
    """
    rows: list[Row] = []
    for part in parts:
        row = part.find()
        if row is None:
            with progress(part.name) as report:
                row = part.work(report)
        else:
            say(f"{part.name} exists, not repeated")
        rows.append(row)
    return rows


class ResumableTable:
    """A CSV file that is rewritten atomically for each row that is added."""

    def __init__(
        self, path: Path, columns: Columns, *, key: Sequence[str], rows: Sequence[Row] = ()
    ) -> None:
        """A table at `path`, whose rows differ in the columns of the `key`."""
        self.rows = list(rows)
        self._path, self._columns, self._key = path, columns, tuple(key)

    @classmethod
    def open(
        cls,
        path: Path,
        columns: Columns,
        what: str,
        *,
        key: Sequence[str],
        same: Row,
        overwrite: bool = False,
    ) -> "ResumableTable":
        """The table of `what` that an earlier call wrote, if any; makes its folder.

        Args:
            path: the CSV file.
            columns: its columns.
            what: what its rows are about, for errors.
            key: columns in which all rows differ.
            same: columns that hold the same value in all rows, and the value.
            overwrite: whether to begin with no rows.

        Raises:
            GaitshiftError: the file is no such table, or a row has another value in a column of
                `same`.
        """
        rows = [] if overwrite else table.read_typed(path, columns, what)
        for row in rows:
            for name, wanted in same.items():
                if row[name] != wanted:
                    raise GaitshiftError(
                        f"{name} must be {row[name]} to add to {path}, got {wanted}; give that, "
                        "another --out, or --overwrite to discard it"
                    )
        path.parent.mkdir(parents=True, exist_ok=True)
        return cls(path, columns, key=key, rows=rows)

    def part(self, key: tuple[Any, ...], name: str, work: Callable[[Report], Row]) -> Part:
        """The part of the work that makes the row of this key."""
        return Part(
            name=name, find=lambda: self.find(key), work=lambda report: self.add(work(report))
        )

    def find(self, key: tuple[Any, ...]) -> Row | None:
        """The row of this key."""
        return next((row for row in self.rows if tuple(row[n] for n in self._key) == key), None)

    def add(self, row: Row) -> Row:
        """Adds a row, writes the table, and gives the row."""
        self.rows.append(row)
        table.write(self._path, self.rows, self._columns)
        return row
