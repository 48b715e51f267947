"""A training on the live page: the policy that it has reached, and its curve."""

import time
from pathlib import Path
from typing import Any

import numpy as np

from gaitshift.control import policy
from gaitshift.control.policy import Policy
from gaitshift.data import located
from gaitshift.errors import GaitshiftError
from gaitshift.learn import progress, run_folder
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.robot_file import from_dict
from gaitshift.show.plots.style import INK, PALE, QUIET
from gaitshift.show.viewer.live import LiveConfig, LiveRun
from gaitshift.show.viewer.server import as_markdown

LOOK_EVERY = 1.0
"""Time between two looks at the folder [s]."""

_CURVES = {"speed": "speed [m/s]", "survival": "survival of 10 s", "reward": "reward a step"}
"""Columns of progress.csv that are drawn, and their titles."""


class Training:
    """The folder of a training run that may go on."""

    def __init__(self, folder: Path) -> None:
        """The training that is in this folder.

        Raises:
            GaitshiftError: the folder is not that of a training run, or has no policy yet.
        """
        config = run_folder.read_config(folder)
        self.folder = folder
        with located(f"{folder / run_folder.CONFIG} is damaged"):
            robot = from_dict(config["robot"]) if "robot" in config else ANYMAL_B
        self.robot = robot
        """The robot that is trained."""
        self._stamp = (0, 0)
        self._looked = time.monotonic()
        self.policy = self._read()
        """The policy at the last look."""

    def look(self) -> Policy | None:
        """The policy, if it is another one than at the last look; at most once `LOOK_EVERY`."""
        now = time.monotonic()
        if now < self._looked + LOOK_EVERY:
            return None
        self._looked, before = now, self.policy
        try:
            self.policy = self._read()
        except (GaitshiftError, OSError):  # the run is cleared, or its folder is gone
            return None
        return self.policy if self.policy is not before else None

    def live(self) -> LiveRun:
        """Robots on level ground that walk by the policy."""
        gait = self.policy.gait
        config = LiveConfig(track="flat@300", start=gait, is_autonomous=False)
        return LiveRun(config, {gait: self.policy})

    def curve(self) -> dict[str, np.ndarray]:
        """The drawn columns of progress.csv and `iteration`, one value an iteration.

        Raises:
            GaitshiftError: the file is damaged.
        """
        path = self.folder / run_folder.PROGRESS
        rows, names = progress.read(path), ("iteration", *_CURVES)
        try:
            return {name: np.array([float(row[name]) for row in rows]) for name in names}
        except (KeyError, ValueError) as error:
            raise GaitshiftError(
                f"{path} is damaged: it must have numbers as {', '.join(names)}"
            ) from error

    def _read(self) -> Policy:
        path = self.folder / run_folder.POLICY
        if not path.is_file():
            raise GaitshiftError(f"{self.folder} has no {path.name} yet; wait for its first one")
        state = path.stat()
        stamp = (state.st_mtime_ns, state.st_ino)
        if stamp == self._stamp:
            return self.policy
        self._stamp = stamp
        return policy.load(path, self.robot)


class Curves:
    """The charts of a training, in the panel in which they are created."""

    def __init__(self, gui: Any) -> None:
        axis = {"stroke": QUIET, "grid": {"stroke": PALE, "width": 1}, "font": "11px sans-serif"}
        self._text = gui.add_markdown("")
        self._charts = {
            name: gui.add_uplot(
                data=(np.array([0.0, 1.0]), np.array([0.0, 0.0])),
                series=({"label": "iteration"}, {"label": name, "stroke": INK, "width": 1.5}),
                title=title,
                scales={"x": {"time": False}},
                axes=(
                    {**axis, "label": "iteration", "labelSize": 16, "size": 32},
                    {**axis, "size": 44},
                ),
                legend={"show": False},
                height=150,
            )
            for name, title in _CURVES.items()
        }

    def draw(self, training: Training) -> None:
        """Draws the curve up to now."""
        curve = training.curve()
        done = len(curve["iteration"])
        learned = training.policy.info.training.get("iterations", 0)
        self._text.content = as_markdown(
            f"{training.policy.gait}, iteration {done}, the robot walks as learned after {learned}"
        )
        if done >= 2:
            for name, chart in self._charts.items():
                chart.data = (curve["iteration"], curve[name])
