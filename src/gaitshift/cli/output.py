"""Output of commands: results on stdout, everything else on stderr."""

import json
import sys
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import LOCK
from gaitshift.whole_file import PART

Report = Callable[[int, int], None]
"""Takes the work done and the total."""

README = "README.md"
"""Page in the folder of results."""

_WHOLE = 1000
"""Width for tables that are not folded [characters]."""


def say(line: str) -> None:
    """One line for people, on stderr."""
    print(line, file=sys.stderr)


def emit_json(data: Any) -> None:
    """One JSON object on stdout."""
    print(json.dumps(data, allow_nan=False))


def emit_table(title: str, rows: Sequence[tuple[str, ...]]) -> None:
    """A short table on stdout, folded to the width of a terminal, unfolded elsewhere."""
    from rich.console import Console  # slow to import, and not every command prints a table
    from rich.markup import escape
    from rich.table import Table

    table = Table(title=title, show_header=False, title_justify="left")
    table.add_column(no_wrap=True)  # names; only the other columns are folded
    for _ in range(max(map(len, rows), default=1) - 1):
        table.add_column(overflow="fold")
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))  # units are in brackets, like markup
    Console(width=None if sys.stdout.isatty() else _WHOLE).print(table)


@contextmanager
def progress(label: str) -> Generator[Report]:
    """A progress bar on stderr, with the time left; nothing where stderr is not a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeRemainingColumn(),
    )
    console = Console(stderr=True)
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task(label, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def check_folder(
    folder: Path, *, overwrite: bool, ours: tuple[str, ...], begun: str | None = None
) -> None:
    """`GaitshiftError` for an output folder with content, unless `overwrite`; creates nothing.

    It deletes nothing either: the files in `ours` will be replaced, others stay. What a killed run
    leaves is no content: its lock, files that it was writing, and, where there is an entry `begun`,
    that entry and the files in `ours`.
    """
    if folder.exists() and not folder.is_dir():
        raise GaitshiftError(f"--out must be a folder, got the file {folder}")
    if overwrite or not folder.is_dir():
        return
    there = {path.name for path in folder.iterdir() if not path.name.endswith(PART)} - {LOCK}
    if begun in there:
        there -= {begun, *ours}
    if there:
        raise GaitshiftError(
            f"{folder} exists and is not empty; give another --out, or --overwrite to replace "
            f"{', '.join(ours)} there"
        )


def check_table_folder(path: Path, *, overwrite: bool) -> None:
    """`check_folder` for the folder of a table; other files stay."""
    if not path.is_file():
        check_folder(path.parent, overwrite=overwrite, ours=(path.name, README))


def check_numbers(what: str, count: int, seed: int, *, least: int = 1) -> None:
    """`GaitshiftError` unless the count is at least `least` and the seed is valid."""
    if not least <= count <= 1_000_000:
        raise GaitshiftError(f"{what} must be {least} to 1000000, got {count}")
    if seed < 0:
        raise GaitshiftError(f"seed must be 0 or larger, got {seed}")
