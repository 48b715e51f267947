"""The curves of a run for TensorBoard."""

import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

from torch.utils.tensorboard import SummaryWriter

from gaitshift.errors import GaitshiftError
from gaitshift.table import Row


class TensorBoardLog:
    """Writes rows of a run as curves into a folder; a context that ends with the run.

    TensorBoard writes in a thread of its own, and an error there appears at a later call.
    """

    def __init__(self, folder: Path, iteration: int) -> None:
        """A log that goes on after this iteration.

        Raises:
            GaitshiftError: here and in the other methods: the folder cannot be written.
        """
        self._folder = folder
        with self._named():
            self._writer = SummaryWriter(str(folder), purge_step=iteration)

    def __enter__(self) -> "TensorBoardLog":
        self._usual, threading.excepthook = threading.excepthook, _without_os_errors
        return self

    def __exit__(self, *_: object) -> None:
        try:
            with self._named():
                self._writer.close()
        finally:
            threading.excepthook = self._usual

    def add(self, row: Row) -> None:
        """Adds the numbers of a row at its iteration."""
        with self._named():
            for name, value in row.items():
                if name not in ("iteration", "stage"):
                    curve = name if "/" in name else f"train/{name}"
                    self._writer.add_scalar(curve, value, row["iteration"])

    @contextmanager
    def _named(self) -> Generator[None]:
        try:
            yield
        except OSError as error:
            raise GaitshiftError(f"{self._folder} cannot be written: {error.strerror}") from error


def _without_os_errors(seen: threading.ExceptHookArgs) -> None:
    """Tells of what ended a thread, but not of the errors that the log's owner meets."""
    if not isinstance(seen.exc_value, OSError):
        threading.__excepthook__(seen)
