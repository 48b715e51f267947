"""Results that grow row by row: what the commands that make them share."""

from pathlib import Path

from gaitshift.cli.output import check_folder
from gaitshift.errors import GaitshiftError
from gaitshift.table import Columns, Row, read_typed

README = "README.md"


def check_numbers(what: str, count: int, seed: int, *, least: int = 1) -> None:
    """`GaitshiftError` unless there are so many, and the seed is one."""
    if not least <= count <= 1_000_000:
        raise GaitshiftError(f"{count} {what}: {least} to 1000000 would be right")
    if seed < 0:
        raise GaitshiftError(f"seed {seed}: a seed is 0 or larger")


def kept_rows(
    path: Path, columns: Columns, what: str, *, overwrite: bool, alike: Row | None = None
) -> list[Row]:
    """The rows that an earlier call left in a folder, which is there from now on.

    Raises:
        GaitshiftError: the folder holds something else, or a row does not agree with the columns
            in `alike`, so that all rows would not make one table.
    """
    if not path.is_file():
        check_folder(path.parent, overwrite=overwrite, ours=(path.name, README))
    rows = [] if overwrite else read_typed(path, columns, what)
    for row in rows:
        for name, wanted in (alike or {}).items():
            if row[name] != wanted:
                raise GaitshiftError(
                    f"{path} has {what} with {name} = {row[name]}, not {wanted}: give that, "
                    "another --out, or --overwrite to begin anew"
                )
    path.parent.mkdir(parents=True, exist_ok=True)
    return rows
