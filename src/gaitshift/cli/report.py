"""`gaitshift report`: a log as one page that opens from disk."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from gaitshift.errors import GaitshiftError
from gaitshift.log import Log


@dataclass(frozen=True, kw_only=True)
class Report:
    """Make one self-contained page of a log: the robot to turn around, its signals, its gaits.

    The page opens from disk, without a network, on any machine.
    """

    log: Annotated[Path, tyro.conf.Positional]
    """A log of `demo`, `evaluate`, `record` or `view`."""
    out: Path | None = None
    """The HTML file; beside the log, with its name, by default."""
    robot: int = 0
    """Which robot of the log, counted from 0."""
    video: Path | None = None
    """An mp4 to show beside it."""
    overwrite: bool = False
    """Replace a page that is there."""

    def run(self) -> None:
        """Writes the page."""
        from gaitshift.report import write_report  # matplotlib is slow to import

        log = Log.load(self.log)
        path = self.out or self.log.with_suffix(".html")
        if path.exists() and not self.overwrite:
            raise GaitshiftError(f"{path} is there already; --overwrite replaces it")
        if self.video is not None and not self.video.is_file():
            raise GaitshiftError(f"no video {self.video}")
        if not path.parent.is_dir():
            raise GaitshiftError(f"no folder {path.parent} for the page")
        write_report(log, path, robot=self.robot, video=self.video)
        print(path)
