"""CSV files of a run that grow line by line, each with the iteration it belongs to."""

import csv
from pathlib import Path
from typing import Any

Row = dict[str, Any]
"""A line by the names of its columns; `iteration` is one of them."""


def append(path: Path, row: Row) -> None:
    """Adds a line, and in a new file the names of the columns above it."""
    new = not path.exists()
    with path.open("a", newline="") as file:
        lines = csv.DictWriter(file, row.keys())
        if new:
            lines.writeheader()
        lines.writerow(row)


def trim(path: Path, iteration: int) -> None:
    """Forgets the lines of later iterations, which a killed run wrote after its last checkpoint."""
    if not path.exists():
        return
    with path.open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if int(row["iteration"]) <= iteration]
    if not rows:
        path.unlink()
        return
    part = path.with_suffix(".part")
    with part.open("w", newline="") as file:
        lines = csv.DictWriter(file, rows[0].keys())
        lines.writeheader()
        lines.writerows(rows)
    part.replace(path)
