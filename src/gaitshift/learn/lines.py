"""CSV files of a run that grow line by line, each with the iteration it belongs to."""

import csv
from pathlib import Path
from typing import Any

from gaitshift.errors import GaitshiftError

Row = dict[str, Any]
"""A line by the names of its columns; `iteration` is one of them."""

_TEXTS = ("stage", "gait", "misses")
"""Columns that hold words; all others hold numbers, yes or no, or nothing."""

_WORDS = {"True": True, "False": False, "": None}


def append(path: Path, row: Row) -> None:
    """Adds a line, and in a new file the names of the columns above it."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        lines = csv.DictWriter(file, row.keys())
        if new:
            lines.writeheader()
        lines.writerow(row)


def read(path: Path) -> list[dict[str, str]]:
    """The lines of such a file, none if there is no file, without one that a kill cut short.

    Raises:
        GaitshiftError: a damaged line, or no such file.
    """
    if not path.exists():
        return []
    try:
        with path.open(newline="") as file:
            reader = csv.DictReader(file)
            rows = list(reader)
    except (UnicodeDecodeError, csv.Error) as error:
        raise GaitshiftError(f"{path} is damaged: {error}; remove it to continue") from error
    if rows and None in rows[-1].values():
        rows.pop()
    for number, row in enumerate(rows, start=2):
        whole = None not in row and None not in row.values()
        if not whole or not row.get("iteration", "").isdecimal():
            raise GaitshiftError(f"{path}, line {number} is damaged; remove it to continue")
    return rows


def trim(path: Path, iteration: int) -> None:
    """Forgets the lines of later iterations, which a killed run wrote after its last checkpoint.

    Raises:
        GaitshiftError: as `read`.
    """
    if not path.exists():
        return
    rows = [row for row in read(path) if int(row["iteration"]) <= iteration]
    if not rows:
        path.unlink()
        return
    part = path.with_suffix(".part")
    with part.open("w", newline="") as file:
        lines = csv.DictWriter(file, rows[0].keys())
        lines.writeheader()
        lines.writerows(rows)
    part.replace(path)


def last(path: Path, iteration: int) -> Row:
    """The last line up to an iteration, its values as they were when it was written; or nothing.

    Raises:
        GaitshiftError: as `read`.
    """
    rows = [row for row in read(path) if int(row["iteration"]) <= iteration]
    return {name: _value(name, text) for name, text in rows[-1].items()} if rows else {}


def _value(name: str, text: str) -> Any:
    if name in _TEXTS:
        return text
    if text in _WORDS:
        return _WORDS[text]
    try:
        return int(text) if text.isdecimal() else float(text)
    except ValueError:
        return text
