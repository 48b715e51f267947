"""The page of a training: walks of its policies, learning curves, verdicts."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot
from gaitshift.show.plots.training import COURSES, numbers, read_progress
from gaitshift.show.report.data import lines, packed, run_data, series
from gaitshift.show.report.log_page import STRETCH_HEAD, stretches
from gaitshift.show.report.page import Row, facts_table, table, write_page
from gaitshift.table import read


@dataclass(frozen=True, kw_only=True)
class TrainingFigures:
    """What the files of a run say, ready for its page."""

    course: dict[str, Any]
    """Data of the learning curves."""
    verdicts: str
    """Table of the verdicts; empty without any."""
    settings: dict[str, str]
    """Command, seed and recipe."""

    @classmethod
    def read(cls, folder: Path) -> "TrainingFigures":
        """Reads `progress.csv`, `config.json` and, where it is, `verdicts.csv` of a run.

        Raises:
            GaitshiftError: one of the files cannot be read.
        """
        return cls(
            course=_course(folder / "progress.csv"),
            verdicts=_verdicts(folder / "verdicts.csv"),
            settings=_facts(folder / "config.json"),
        )


def write_training_report(
    figures: TrainingFigures,
    path: Path,
    walks: Sequence[tuple[str, Log]],
    robot: Robot,
    *,
    title: str,
    summary: str,
) -> None:
    """Writes the page of a training: its walks to choose from, its course, its verdicts.

    Args:
        figures: of the run.
        path: the HTML file.
        walks: what policies of the run do, by name; the first robot of each log is shown.
        robot: what walks in them.
        title: what was trained.
        summary: a sentence on it.
    """
    for _, log in walks:
        robot.check_is(log.robot, "the log")
    write_page(
        path,
        title=title,
        summary=summary,
        walks=[(name, run_data(log, 0, robot)) for name, log in walks],
        course=figures.course,
        sections=[
            ("Walks at checkpoints", table(("policy", *STRETCH_HEAD), _walks(walks, robot))),
            ("Verdicts at checkpoints, on flat ground", figures.verdicts),
            ("Settings", facts_table(figures.settings)),
        ],
    )


def _walks(walks: Sequence[tuple[str, Log]], robot: Robot) -> list[Row]:
    return [((name, *cells), None) for name, log in walks for cells, _ in stretches(log, 0, robot)]


def _course(progress: Path) -> dict[str, Any]:
    """Data of the learning curves for the player, with the ends of the stages."""
    rows = read_progress(progress)
    stages = [row["stage"] for row in rows]
    iteration = numbers(rows, "iteration", progress)
    ends = [float(iteration[i]) for i in range(len(rows) - 1) if stages[i] != stages[i + 1]]
    return {
        "axis": "iteration",
        "time": packed(iteration, "f4"),
        "period": 1,
        "shifts": ends,
        "rows": [
            lines(title, [series(name, factor * numbers(rows, name, progress), "ink")], digits=2)
            for name, factor, title in COURSES
        ],
    }


def _verdicts(path: Path) -> str:
    """The verdicts of the training, if any."""
    if not path.is_file():
        return ""
    found = read(path, may_be_cut=True)
    if not found:
        return ""
    head = tuple(name.replace("_", " ") for name in found[0])
    return table(head, [(tuple(str(value) for value in row.values()), None) for row in found])


def _facts(path: Path) -> dict[str, str]:
    """Command, seed and recipe of a run."""
    try:
        config = json.loads(path.read_text(encoding="utf-8"))
        recipe = config["recipe"]
        stages = [f"{stage['name']} {stage['iterations']}" for stage in recipe["stages"]]
        return {
            "command": config["command"],
            "seed": str(config["seed"]),
            "iterations": ", ".join(stages),
            "robots × steps per iteration": f"{recipe['robots']} × {recipe['steps']}",
            **{f"{name} version": str(one) for name, one in config["versions"].items()},
        }
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise GaitshiftError(f"{path} cannot be read: {error}") from error
