"""The tables of a run, one row per iteration: reads them, cuts them, finds a row."""

from pathlib import Path
from typing import Any

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.table import Row

_TEXTS = ("stage", "gait", "misses")
"""Columns that hold text; all others hold numbers or booleans, or are empty."""

_WORDS = {"True": True, "False": False, "": None}


def read(path: Path) -> list[dict[str, str]]:
    """The rows of such a table without a cut last row; no rows if there is no file.

    Raises:
        GaitshiftError: a row is damaged, or the file is another table.
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
        table.write(path, rows)
    else:
        path.unlink()


def last(path: Path, iteration: int) -> Row:
    """The last row up to an iteration, its values of their original types; an empty row if none.

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
