"""Tables as files: CSV read and written whole, row by row or as a stream, and Markdown."""

import csv
import io
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from gaitshift.errors import GaitshiftError
from gaitshift.whole_file import replacing

Row = dict[str, Any]
"""A row of a table by the names of its columns."""
Columns = Mapping[str, Callable[[str], Any]]
"""Names of columns, and functions that convert a cell's text to a value: `float`, `int`, …"""

STREAMED = (".csv", ".parquet")
"""Endings of the files that `stream` reads."""

BATCH, BLOCK = 65_536, 1 << 21
"""Batch sizes of `stream`: rows of a Parquet file, bytes of a CSV file, of which pyarrow reads 32
batches ahead."""

MOST_BYTES = 256 << 20
"""Size of the largest table that is read whole [bytes]; ours: a million iterations."""


# Whole tables ------------------------------------------------------------------------------------


def read(path: Path, *, may_be_cut: bool = False) -> list[dict[str, str]]:
    """The rows of a CSV file, each cell as its text.

    Args:
        path: the file.
        may_be_cut: whether a last row without a line end, as a kill leaves it, is left out.

    Raises:
        GaitshiftError: the file cannot be read, a row has more or fewer cells than the header, or
            the last row is cut.
    """
    _, rows, is_cut = _read(path)
    if is_cut and rows and not may_be_cut:
        raise GaitshiftError(f"{path}, line {len(rows) + 1} is damaged: it must end in a line end")
    if is_cut and rows:
        rows.pop()
    for number, row in enumerate(rows, start=2):
        if not _is_whole(row):
            raise GaitshiftError(f"{path}, line {number} is damaged: its cells do not fit line 1")
    return rows


def read_typed(path: Path, columns: Columns, what: str) -> list[Row]:
    """The rows of an earlier, perhaps unfinished, table of `what`; no rows without a file.

    An empty cell stays an empty string. A last row without a line end is cut and left out.

    Raises:
        GaitshiftError: the file is another table.
    """
    if not path.is_file():
        return []
    names, rows, is_cut = _read(path)
    if is_cut and rows:
        rows.pop()
    if names != tuple(columns) or not all(map(_is_whole, rows)):
        raise GaitshiftError(f"{path} is not a table of {what}; give another --out, or --overwrite")
    try:
        return [{n: kind(row[n]) if row[n] else "" for n, kind in columns.items()} for row in rows]
    except ValueError as error:
        raise GaitshiftError(
            f"{path} is damaged: {error}; give another --out, or --overwrite"
        ) from error


def write(path: Path, rows: Iterable[Row], columns: Collection[str] | None = None) -> None:
    """Writes a CSV file atomically; without `columns`, those of the first row."""
    if columns is None:
        rows = list(rows)
        columns = tuple(rows[0])
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        lines = csv.DictWriter(file, tuple(columns), lineterminator="\n")
        lines.writeheader()
        lines.writerows(rows)


# Tables that grow --------------------------------------------------------------------------------


def append(path: Path, row: Row) -> None:
    """Adds a row to a CSV file; a new file gets a header first.

    A kill can cut the row, so that it has no line end.
    """
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        lines = csv.DictWriter(file, row.keys(), lineterminator="\n")
        if new:
            lines.writeheader()
        lines.writerow(row)


# Tables larger than memory -----------------------------------------------------------------------


def stream(
    path: Path, *, numbers: Collection[str], flags: Collection[str]
) -> Iterator[dict[str, np.ndarray]]:
    """Batches of the rows of a CSV or Parquet file, as float64 arrays by the names of columns.

    Args:
        path: the file; one that does not end in .parquet is read as CSV.
        numbers: columns that are read as numbers, where the file has them.
        flags: columns that may also hold true and false.

    Raises:
        GaitshiftError: the file cannot be read, or a column does not hold numbers.
    """
    import pyarrow as pa  # only where a large table is read
    from pyarrow import csv as arrow_csv
    from pyarrow import parquet

    if not path.is_file():
        raise GaitshiftError(f"no log file {path}")
    from_parquet, from_csv = cast(Any, parquet), cast(Any, arrow_csv)
    arrow = cast(Any, pa)
    # The first rows may hold whole numbers only, so their type is not that of the column.
    types = {name: arrow.float64() for name in numbers}
    known = {*numbers, *flags}
    try:
        if path.suffix == ".parquet":
            with from_parquet.ParquetFile(path) as file:
                for batch in file.iter_batches(BATCH):
                    yield _arrays(path, batch, known)
        else:
            options = from_csv.ReadOptions(block_size=BLOCK)
            convert = from_csv.ConvertOptions(column_types=types)
            with from_csv.open_csv(path, read_options=options, convert_options=convert) as file:
                for batch in file:
                    yield _arrays(path, batch, known)
    except UnicodeError as error:
        raise GaitshiftError(f"{path} must be in UTF-8: {error}") from error
    except (arrow.ArrowException, OSError) as error:
        line = (str(error).splitlines() or [type(error).__name__])[0]
        raise GaitshiftError(f"{path} cannot be read as {path.suffix[1:]}: {line}") from error


# Markdown ----------------------------------------------------------------------------------------


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A Markdown table, without a line end after it."""
    lines = [head, ("---",) * len(head), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def _read(path: Path) -> tuple[tuple[str, ...], list[dict[str, str]], bool]:
    """Names of the columns, rows, and whether the last line lacks its end.

    Missing cells of a row are None, surplus cells have the key None.
    """
    if path.is_file() and path.stat().st_size > MOST_BYTES:
        raise GaitshiftError(
            f"{path} must have {MOST_BYTES >> 20} MB or less, got {path.stat().st_size >> 20} MB"
        )
    try:
        with path.open(newline="", encoding="utf-8") as file:
            text = file.read()
        reader = csv.DictReader(io.StringIO(text, newline=""))
        columns, rows = tuple(reader.fieldnames or ()), list(reader)
    except OSError as error:
        raise GaitshiftError(f"{path} cannot be read: {error.strerror}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise GaitshiftError(f"{path} is damaged: {error}") from error
    return columns, rows, not text.endswith(("\n", "\r"))


def _is_whole(row: Mapping[str, str]) -> bool:
    return None not in row and None not in row.values()


def _arrays(path: Path, batch: Any, known: Collection[str]) -> dict[str, np.ndarray]:
    arrays: dict[str, np.ndarray] = {}
    for name, column in zip(batch.schema.names, batch.columns, strict=True):
        if name not in known:
            continue
        try:
            arrays[name] = column.cast("float64", safe=False).to_numpy(zero_copy_only=False)
        except Exception as error:  # arrow has an error for each type
            raise GaitshiftError(f"{path}: column '{name}' must hold numbers") from error
    return arrays
