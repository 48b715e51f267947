"""The folder of a training run: its files, and whether a run may begin in it."""

import shutil
from pathlib import Path
from typing import Any, cast

from gaitshift.data import json_in, located
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import LOCK
from gaitshift.whole_file import PART

CONFIG, CHECKPOINTS, POLICY = "config.json", "checkpoints", "policy.onnx"
PROGRESS, VERDICTS, DIVERGED = "progress.csv", "verdicts.csv", "diverged"

_CONFIG_START = b'{\n  "command": '
"""How each of our config files begins."""


def read_config(folder: Path) -> dict[str, Any]:
    """The settings of a run, by the names of its config file.

    Raises:
        GaitshiftError: the folder has no such file, or the file is damaged.
    """
    path = folder / CONFIG
    if not path.is_file():
        raise GaitshiftError(f"{folder} is not a training run: it has no {CONFIG}")
    with located(f"{path} is damaged"):
        config: Any = json_in(path)
        if not isinstance(config, dict):
            raise GaitshiftError(f"it must be a table, got a {type(config).__name__}")
    return cast("dict[str, Any]", config)


def is_barely_begun(folder: Path) -> bool:
    """Whether a run ended in this folder before its first checkpoint, or nothing is in it."""
    if {path.name for path in folder.iterdir()} - {CONFIG, CONFIG + PART, CHECKPOINTS, LOCK}:
        return False
    if any(path.suffix != PART for path in (folder / CHECKPOINTS).glob("*")):
        return False
    config = folder / CONFIG
    text = config.read_bytes()[: len(_CONFIG_START)] if config.is_file() else b""
    return _CONFIG_START.startswith(text)


def clear(folder: Path) -> None:
    """Deletes the folder of an earlier run; `GaitshiftError` where the folder holds no run."""
    if not (folder / CONFIG).is_file():
        raise GaitshiftError(f"{folder} is not a training run and is not overwritten")
    for path in folder.iterdir():
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        elif path.name != LOCK:
            path.unlink()
