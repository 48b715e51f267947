"""`gaitshift report`: a log, or a training, as one page that opens from disk."""

import tempfile
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from gaitshift.cli.output import progress, say
from gaitshift.cli.robot_options import RobotOption
from gaitshift.control import policy as policies
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.lab.evaluation import EvaluationConfig, evaluate
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot

_TRACK, _SECONDS = "flat@5,perlin:0.1@12", 9.0
"""Track and time on which policies of a training are shown."""

_CHECKPOINTS = 4
"""Largest number of checkpoints that are shown beside the final policy."""


@dataclass(frozen=True, kw_only=True)
class Report(RobotOption):
    """Make one self-contained page of a log or of a training run.

    The page of a log shows the robot in 3D, its signals and its gaits. The page of a training shows
    its policies at several checkpoints, its learning curves and its verdicts. The page opens from
    disk without a network.
    """

    source: Annotated[Path, tyro.conf.Positional]
    """Log of `demo`, `evaluate`, `record` or `view`, or the folder of a training."""
    out: Path | None = None
    """HTML file; by default LOG.html beside the log, or report.html in the training's folder."""
    robot: int = 0
    """Index of the robot in the log, from 0."""
    video: Path | None = None
    """mp4 file to include."""
    overwrite: bool = False
    """Replace an existing page."""

    def run(self) -> None:
        """Writes the page."""
        description = self.read_robot()
        is_run = self.source.is_dir()
        default = self.source / "report.html" if is_run else self.source.with_suffix(".html")
        log = None if is_run else Log.load(self.source)
        path = self.out or default
        if path.exists() and not self.overwrite:
            raise GaitshiftError(f"{path} exists; give another --out, or --overwrite")
        if self.video is not None and not self.video.is_file():
            raise GaitshiftError(f"no video file {self.video}")
        if not path.parent.is_dir():
            raise GaitshiftError(f"no folder {path.parent} for the page")
        if log is None:
            is_inside = path.parent.resolve() == self.source.resolve()
            with only_writer(self.source) if is_inside else nullcontext():
                self._tell_training(path, description)
        else:
            from gaitshift.show.report import write_report  # matplotlib is slow to import

            write_report(log, path, robot=self.robot, description=description, video=self.video)
        print(path)

    def _tell_training(self, path: Path, robot: Robot) -> None:
        from gaitshift.show.report import TrainingFigures, write_training_report

        final = self.source / "policy.onnx"
        if not final.is_file():
            raise GaitshiftError(
                f"{self.source} must be a log or the folder of a training that finished or was "
                "stopped by Ctrl-C, got a folder without policy.onnx"
            )
        figures = TrainingFigures.read(self.source)
        policy = policies.load(final, robot)
        walks = [*_checkpoints(self.source), ("at the end", _walk(policy))]
        iterations = policy.info.training["iterations"]
        write_training_report(
            figures,
            path,
            walks[::-1],
            robot,
            title=f"Training of {policy.machine.title}",
            summary=f"{iterations} iterations, {policy.info.training['steps']:,} control steps",
        )


def _walk(policy: policies.Policy) -> Log:
    return evaluate(policy, EvaluationConfig(terrain=_TRACK, episodes=1, seconds=_SECONDS))[1]


def _checkpoints(folder: Path) -> list[tuple[str, Log]]:
    """Walks of policies from the run's checkpoints, about evenly spread; none without torch."""
    try:
        from gaitshift.learn.run import Run
    except ImportError as error:
        say(f"no checkpoints: they need the package '{error.name}'; install gaitshift[train]")
        return []
    found = sorted(int(path.stem) for path in (folder / "checkpoints").glob("*.pt"))[:-1]
    found = [iteration for iteration in found if iteration > 0]
    if not found:
        return []
    count = min(_CHECKPOINTS, len(found))
    chosen = [found[round(i * (len(found) - 1) / max(count - 1, 1))] for i in range(count)]
    run, walks = Run.resume(folder), list[tuple[str, Log]]()
    with tempfile.TemporaryDirectory() as scratch, progress("checkpoints") as report:
        for done, iteration in enumerate(chosen):
            path = Path(scratch) / "policy.onnx"
            run.write_policy_at(iteration, path)
            walks.append((f"iteration {iteration}", _walk(policies.load(path, run.robot))))
            report(done + 1, count)
    return walks
