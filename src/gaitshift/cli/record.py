"""`gaitshift record`: logs of the standard courses, for `gaitshift identify`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from gaitshift import policy as policies
from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.errors import GaitshiftError
from gaitshift.evaluation.courses import run_course, select
from gaitshift.log import Log


@dataclass(frozen=True, kw_only=True)
class Record:
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
        loaded = [policies.load(name) for name in self.policies]
        chosen = select(self.courses)
        if self.out.exists() and not self.out.is_dir():
            raise GaitshiftError(f"{self.out} is a file; give a folder with --out")
        self.out.mkdir(parents=True, exist_ok=True)
        rows: list[dict[str, Any]] = []
        for policy in loaded:
            for course in chosen:
                path = self.out / f"{policy.gait}-{course.name}-{self.seed}.npz"
                if path.exists() and not self.overwrite:
                    say(f"{path} is there already, and kept")
                    log = Log.load(path)
                else:
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
