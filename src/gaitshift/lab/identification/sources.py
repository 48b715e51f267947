"""Recordings out of files: our npz logs, and tables of anybody's robot."""

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.labelled_run import LabelledRun, Way
from gaitshift.lab.identification.labels import rough_ground
from gaitshift.lab.identification.table import passages
from gaitshift.lab.log import Log

TABLES = (".csv", ".parquet")
"""Endings of tables."""

_SEED = re.compile(r"-\d+$")


def check_sources(paths: Sequence[Path]) -> None:
    """`GaitshiftError` unless all are files of a kind that can be read: asked before any work."""
    for path in paths:
        if not path.is_file():
            raise GaitshiftError(f"no log file {path}")
        if path.suffix not in (".npz", *TABLES):
            raise GaitshiftError(
                f"{path}: the name of a log must end in .npz, {' or '.join(TABLES)}"
            )


def recordings(paths: Sequence[Path], way: Way = "rough") -> Iterator[LabelledRun]:
    """What the files hold, one after the other, tables passage by passage for this way.

    A recording has the name of its file, less a seed at its end.

    Raises:
        GaitshiftError: a file cannot be read, with what is wrong in it.
    """
    for path in paths:
        if path.suffix in TABLES:
            yield from passages(path, way)
            continue
        log = Log.load(path)
        if not log.sensed.contact.any():
            raise GaitshiftError(
                f"{path}: 'contact' must be true where a foot is down, got no contact at all"
            )
        yield LabelledRun.from_log(log, _SEED.sub("", path.stem), rough_ground(log))
