"""The tables of a run that grow by a row an iteration: read, cut back, and asked for the last."""

from pathlib import Path
from typing import Any

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.table import Row

_TEXTS = ("stage", "gait", "misses")
"""Columns that hold words; all others hold numbers, yes or no, or nothing."""

_WORDS = {"True": True, "False": False, "": None}


def read(path: Path) -> list[dict[str, str]]:
    """The rows of such a table, none if there is no file, without one that a kill cut short.

    Raises:
        GaitshiftError: a damaged row, or no such table.
    """
    if not path.exists():
        return []
    try:
        rows = table.read(path, may_be_cut=True)
    except GaitshiftError as error:
        raise GaitshiftError(f"{error}; remove it to continue") from error
    for number, row in enumerate(rows, start=2):
        if not row.get("iteration", "").isdecimal():
            raise GaitshiftError(f"{path}, line {number} is damaged; remove it to continue")
    return rows


def trim(path: Path, iteration: int) -> None:
    """Deletes the rows of later iterations, which a killed run wrote after its last checkpoint.

    Raises:
        GaitshiftError: as `read`.
    """
    if not path.exists():
        return
    rows = [row for row in read(path) if int(row["iteration"]) <= iteration]
    if rows:
        table.rewrite(path, rows)
    else:
        path.unlink()


def last(path: Path, iteration: int) -> Row:
    """The last row up to an iteration, its values as they were when it was written; or nothing.

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
