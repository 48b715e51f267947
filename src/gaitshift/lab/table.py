"""Tables that grow row by row, and are kept as they grow."""

import csv
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from gaitshift.errors import GaitshiftError

Row = dict[str, Any]
Columns = Mapping[str, Callable[[str], Any]]
"""Names of columns, and what makes a value of a cell's text: `float`, `int`, `str`, …"""


def read_rows(path: Path, columns: Columns, what: str) -> list[Row]:
    """The rows of an earlier, perhaps unfinished, table of `what`; none where there is no file.

    An empty cell stays an empty text.

    Raises:
        GaitshiftError: it is no such table.
    """
    if not path.is_file():
        return []
    with path.open(newline="") as file:
        reader = csv.DictReader(file)
        rows = list(reader)
    if tuple(reader.fieldnames or ()) != tuple(columns) or any(
        None in row or None in row.values() for row in rows
    ):
        raise GaitshiftError(f"{path} is not a table of {what}; give another --out, or --overwrite")
    try:
        return [{n: kind(row[n]) if row[n] else "" for n, kind in columns.items()} for row in rows]
    except ValueError as error:
        raise GaitshiftError(
            f"{path} is damaged: {error}; give another --out, or --overwrite"
        ) from error


def write_rows(path: Path, columns: Columns, rows: Sequence[Row]) -> None:
    """Writes the table, whole or not at all."""
    part = path.with_suffix(".part")
    with part.open("w", newline="") as file:
        lines = csv.DictWriter(file, tuple(columns), lineterminator="\n")
        lines.writeheader()
        lines.writerows(rows)
    part.replace(path)
