"""Reads a machine from a gait file: data, never evaluated as code."""

import tomllib
from pathlib import Path

from gaitshift.errors import GaitshiftError
from gaitshift.reward_machine.machine import RewardMachine
from gaitshift.reward_machine.reading import located


def read_toml(path: Path) -> RewardMachine:
    """Read the machine in a TOML file, checked in full.

    Raises `GaitshiftError` with one line that begins with the file's path, and names the line
    where TOML itself is broken and the table where the machine is.
    """
    with located(str(path)):
        return RewardMachine.from_dict(tables_in(path))


def tables_in(path: Path) -> dict[str, object]:
    """The tables of a TOML file; `GaitshiftError`, without its path, where there are none."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise GaitshiftError("no such file") from None
    except OSError as error:
        raise GaitshiftError(f"the file cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise GaitshiftError(
            "the file must be TOML in UTF-8, got bytes that are not UTF-8"
        ) from None
    try:
        tables = tomllib.loads(text)
    except ValueError as error:  # TOMLDecodeError, or a number of thousands of digits
        raise GaitshiftError(f"the file is not valid TOML: {error}") from None
    if not tables:
        raise GaitshiftError("the file is empty")
    return tables
