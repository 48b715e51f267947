"""`gaitshift view`: robots that walk in the browser, live or from a log."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import tyro

from gaitshift.cli.output import say
from gaitshift.cli.robot_options import RobotOptions, SensorOption
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation import DemoConfig
from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.shift.graph_file import DEFAULT

RECORDINGS = Path("gaitshift-view")
"""Folder for recordings."""

_LOCAL = ("127.0.0.1", "localhost", "::1")


@dataclass(frozen=True, kw_only=True)
class View(RobotOptions, SensorOption):
    """Show robots in the browser: a live simulation with controls, a log, or a training.

    Prints the address of the page; Ctrl-C ends it. Needs no display and no OpenGL.
    """

    log: Annotated[Path | None, tyro.conf.Positional] = None
    """Log of `demo`, `evaluate`, `record` or `view`, or folder of a training, which may go on;
    without it, a live simulation."""
    track: str = DemoConfig.track
    """Terrain: pieces with lengths in metres."""
    robots: int = 1
    """Robots on the track, 1 to 16; charts show the first."""
    condition: str = DEFAULT
    """When to shift from trot to bound and back, by the name of a shipped graph."""
    seed: int = 0
    """Seed of the terrain and the starts."""
    host: str = "127.0.0.1"
    """Address to listen on; a public address lets others use the controls."""
    port: int = 8080
    """Port to listen on."""
    out: Path = RECORDINGS
    """Folder for recordings."""

    def run(self) -> None:
        """Serves the page until Ctrl-C."""
        try:
            from gaitshift.show.geometry import has_meshes
            from gaitshift.show.viewer import (
                LiveConfig,
                LivePage,
                LiveRun,
                ReplayPage,
                Training,
                address_of,
                close,
                serve,
            )
        except ImportError as error:
            raise GaitshiftError(
                f"view needs the package '{error.name}'; install gaitshift[view]"
            ) from error
        training = Training(self._only_shown()) if self.log and self.log.is_dir() else None
        robot = training.robot if training is not None else self.read_robot()
        if robot == ANYMAL_B and not has_meshes(robot):
            say("drawn with simple shapes; install gaitshift[meshes] (130 MB) for meshes")
        config = LiveConfig(
            track=self.track,
            robots=self.robots,
            condition=self.condition,
            sensors=self.sensors,
            seed=self.seed,
        )
        if training is not None:
            shown = training.live()
        elif self.log is None:
            gaits = tuple(dict.fromkeys((*self.known_gaits(), *config.graph.gaits)))
            shown = LiveRun(config, self.load_policies(_in_order(gaits)))
        else:
            shown = Log.load(self._only_shown())
        if self.host not in _LOCAL:
            say(f"everyone who can reach {self.host} can see and use this page")
        server = serve(self.host, self.port)
        try:
            if isinstance(shown, Log):
                page = ReplayPage(server, shown, robot)
            else:
                save = partial(save_recording, folder=self.out, robot=robot)
                page = LivePage(server, shown, save, training)
            print(f"open {address_of(self.host, self.port)} (Ctrl-C ends)", flush=True)
            page.run()
        except KeyboardInterrupt:
            say("gaitshift: the page is closed")
        finally:
            close(server)

    def _only_shown(self) -> Path:
        """The log or the training's folder.

        Raises:
            GaitshiftError: options are given that it has no use for.
        """
        assert self.log is not None
        if self.policy_files:
            raise GaitshiftError(f"{self.log} is shown without policies: no --policy-files")
        return self.log


def save_recording(log: Log, folder: Path, robot: Robot) -> str:
    """Saves a recording as a log and as a page, and returns a line that says where."""
    from gaitshift.show.report import write_report  # matplotlib is slow to import

    folder.mkdir(parents=True, exist_ok=True)
    number = 1
    while (folder / f"log-{number}.npz").exists():
        number += 1
    path, page = folder / f"log-{number}.npz", folder / f"run-{number}.html"
    log.save(path)
    write_report(log, page, description=robot)
    say(f"recorded {path} and {page}")
    return f"saved {page} and {path}; play the log with: gaitshift view {path}"


def _in_order(names: tuple[str, ...]) -> tuple[str, ...]:
    """The paper's gaits first."""
    first = ("trot", "bound", "pace")
    return (*(n for n in first if n in names), *(n for n in names if n not in first))
