"""`gaitshift record`: logs of the standard courses, for `gaitshift identify`."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.cli.robot_options import RobotOption
from gaitshift.control import policy as policies
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation import EvaluationConfig, RolloutConfig
from gaitshift.lab.evaluation.courses import Course, run_course, select
from gaitshift.lab.log import Log


@dataclass(frozen=True, kw_only=True)
class Record(RobotOption):
    """Record gaits on the standard courses: flat, slopes, steps, stairs, pebbles, noise.

    Writes OUT/GAIT-COURSE-SEED.npz, a log a gait and course, some 30 MB each. A log that is there
    already is kept, so that a command that was broken off goes on.
    """

    policies: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Shipped policies by the names of their gaits, or policy files ending in .onnx."""
    out: Path
    """Folder of the logs."""
    courses: tuple[str, ...] = ()
    """Courses by name; all by default."""
    robots: int = 64
    """Robots on each course, on eight grounds where the ground is random."""
    seconds: float = 20.0
    """Length of a log [s]."""
    seed: int = 0
    """Seed of grounds and starts: tune a condition on one, judge it on another."""
    overwrite: bool = False
    """Record anew what is there already."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Records, and tells what there is."""
        if not self.policies:
            raise GaitshiftError(f"which gaits? give some of {', '.join(policies.shipped())}")
        _ = EvaluationConfig(episodes=self.robots, seconds=self.seconds, seed=self.seed)
        robot = self.read_robot()
        loaded = [policies.load(name, robot) for name in self.policies]
        chosen = select(self.courses)
        if self.out.exists() and not self.out.is_dir():
            raise GaitshiftError(f"{self.out} is a file; give a folder with --out")
        gaits = [policy.gait for policy in loaded]
        twice = [gait for gait in gaits if gaits.count(gait) > 1]
        if twice:
            raise GaitshiftError(
                f"two of the policies are of the gait '{twice[0]}', and would write the same logs; "
                "record them one by one, each with an --out of its own"
            )
        kept = self._kept([(policy, course) for policy in loaded for course in chosen])
        self.out.mkdir(parents=True, exist_ok=True)
        rows: list[dict[str, Any]] = []
        for policy in loaded:
            for course in chosen:
                path = self._path(policy, course)
                if path in kept:
                    say(f"{path} is there already, and kept")
                    rows.append(kept[path])
                    continue
                with progress(f"{policy.gait}, {course.name}") as report:
                    log = run_course(
                        policy,
                        course,
                        robots=self.robots,
                        seconds=self.seconds,
                        seed=self.seed,
                        report=report,
                    )
                log.save(path)
                rows.append(_row(path, log))
        if self.json:
            emit_json({"logs": rows})
        else:
            table = [
                (r["log"], f"{r['fallen']} of {r['robots']} fell", f"{r['km']:.2f} km")
                for r in rows
            ]
            emit_table(f"logs in {self.out}", table)

    def _path(self, policy: Policy, course: Course) -> Path:
        return self.out / f"{policy.gait}-{course.name}-{self.seed}.npz"

    def _kept(self, asked: Sequence[tuple[Policy, Course]]) -> dict[Path, dict[str, Any]]:
        """What is told of the logs that are there already, each as long and of as many as asked.

        Raises:
            GaitshiftError: one holds something else.
        """
        kept: dict[Path, dict[str, Any]] = {}
        steps = RolloutConfig(seconds=self.seconds).steps
        for policy, course in asked:
            path = self._path(policy, course)
            if self.overwrite or not path.exists():
                continue
            log = Log.load(path)
            length, robots = log.fallen.shape
            whole = length == steps or (length < steps and bool(log.fallen[-1].all()))
            if not whole or robots != self.robots:
                raise GaitshiftError(
                    f"{path} is there already and holds {robots} robots × {log.time[-1]:g} s, not "
                    f"{self.robots} × {self.seconds:g} s; ask for the same, or --overwrite"
                )
            kept[path] = _row(path, log)
        return kept


def _row(path: Path, log: Log) -> dict[str, Any]:
    last = np.maximum((~log.fallen).sum(axis=0) - 1, 0)
    x = np.take_along_axis(log.qpos[..., 0].astype(float), last[None], axis=0)[0]
    return {
        "log": str(path),
        "terrain": log.terrain,
        "robots": log.fallen.shape[1],
        "fallen": int(log.fallen[-1].sum()),
        "km": float((x - log.qpos[0, :, 0]).sum() / 1000.0),
    }
