"""`gaitshift record`: logs of the standard courses, for `gaitshift identify`."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.cli.robot_options import RobotOption, SensorOption
from gaitshift.control import Controller
from gaitshift.control import policy as policies
from gaitshift.control.controller import controller_maker
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.lab.evaluation import EvaluationConfig, RolloutConfig
from gaitshift.lab.evaluation.courses import Course, run_course, select
from gaitshift.lab.log import Log
from gaitshift.lab.resume import Part, Report, run_missing
from gaitshift.sim.sensor_config import PERFECT
from gaitshift.table import Row


@dataclass(frozen=True, kw_only=True)
class Record(RobotOption, SensorOption):
    """Record gaits on the standard courses: flat, slopes, steps, stairs, pebbles, noise.

    Writes OUT/GAIT-COURSE-SEED.npz, or with other than perfect sensors
    OUT/GAIT-COURSE-SEED-SENSORS.npz, one log of about 30 MB for each gait and course. Logs that
    exist are not recorded again, so an interrupted command resumes.
    """

    policies: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Shipped policies by the names of their gaits, or policy files ending in .onnx; with another
    controller, names of its gaits."""
    controller: str = "policy"
    """What walks, by name: `policy`; `cpg`, coupled oscillators without learning."""
    out: Path
    """Folder of the logs."""
    courses: tuple[str, ...] = ()
    """Courses; all by default."""
    robots: int = 64
    """Robots on each course; random terrains have eight variants."""
    seconds: float = 20.0
    """Length of a log [s]."""
    seed: int = 0
    """Seed of terrains and starts; choose settings on one seed and judge them on another."""
    overwrite: bool = False
    """Record existing logs again."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Records, and prints all logs."""
        if not self.policies:
            raise GaitshiftError(
                f"policies must be some of {', '.join(policies.shipped())}, or .onnx files, "
                "got none"
            )
        _ = EvaluationConfig(episodes=self.robots, seconds=self.seconds, seed=self.seed)
        gaits = [self._controller(name, 1).repertoire.gaits[0] for name in self.policies]
        chosen = select(self.courses)
        if self.out.exists() and not self.out.is_dir():
            raise GaitshiftError(f"--out must be a folder, got the file {self.out}")
        twice = [gait for gait in gaits if gaits.count(gait) > 1]
        if twice:
            raise GaitshiftError(
                f"policies must be of different gaits, got two of '{twice[0]}'; record them one by "
                "one with different --out"
            )
        asked = [
            (name, gait, course)
            for name, gait in zip(self.policies, gaits, strict=True)
            for course in chosen
        ]
        with only_writer(self.out):
            found = self._found([(gait, course) for _, gait, course in asked])
            parts = [
                Part(
                    name=str(path := self._path(gait, course)),
                    find=partial(found.get, path),
                    work=partial(self._record, name, gait, course),
                )
                for name, gait, course in asked
            ]
            rows = run_missing(parts, progress=progress, say=say)
        if self.json:
            emit_json({"logs": rows})
        else:
            table = [
                (r["log"], f"{r['fallen']} of {r['robots']} fell", f"{r['km']:.2f} km")
                for r in rows
            ]
            emit_table(f"logs in {self.out}", table)

    def _path(self, gait: str, course: Course) -> Path:
        sensors = "" if self.sensors == PERFECT else f"-{self.sensors.name}"
        return self.out / f"{gait}-{course.name}-{self.seed}{sensors}.npz"

    def _controller(self, name: str, n: int) -> Controller:
        return controller_maker(self.controller)([name], n, robot=self.read_robot())

    def _record(self, name: str, gait: str, course: Course, report: Report) -> Row:
        """Records a log and writes it."""
        controller = self._controller(name, self.robots)
        log = run_course(
            controller,
            course,
            seconds=self.seconds,
            seed=self.seed,
            sensors=self.sensors,
            report=report,
        )
        path = self._path(gait, course)
        log.save(path)
        return _row(path, log)

    def _found(self, asked: Sequence[tuple[str, Course]]) -> dict[Path, Row]:
        """Rows of the logs that exist already, of the same length and number of robots.

        Raises:
            GaitshiftError: a log has other content.
        """
        found: dict[Path, Row] = {}
        steps = RolloutConfig(seconds=self.seconds).steps
        for gait, course in asked:
            path = self._path(gait, course)
            if self.overwrite or not path.exists():
                continue
            log = Log.load(path)
            length, robots = log.fallen.shape
            whole = length == steps or (length < steps and bool(log.fallen[-1].all()))
            if not whole or robots != self.robots:
                raise GaitshiftError(
                    f"{path} has {robots} robots × {log.time[-1]:g} s, got {self.robots} × "
                    f"{self.seconds:g} s; give the same robots and seconds, or --overwrite"
                )
            found[path] = _row(path, log)
        return found


def _row(path: Path, log: Log) -> Row:
    last = np.maximum((~log.fallen).sum(axis=0) - 1, 0)
    x = np.take_along_axis(log.truth.base_position_w[..., 0].astype(float), last[None], axis=0)[0]
    return {
        "log": str(path),
        "terrain": log.terrain,
        "robots": log.fallen.shape[1],
        "fallen": int(log.fallen[-1].sum()),
        "km": float((x - log.truth.base_position_w[0, :, 0]).sum() / 1000.0),
    }
