"""Reads a machine from a gait file: data, never evaluated as code."""

from pathlib import Path

from gaitshift.data import located, tables_in
from gaitshift.gait.machine import RewardMachine


def read_toml(path: Path) -> RewardMachine:
    """Read the machine in a TOML file, checked in full.

    Raises `GaitshiftError` with one line that begins with the file's path, and names the line
    where TOML itself is broken and the table where the machine is.
    """
    with located(str(path)):
        return RewardMachine.from_dict(tables_in(path))
