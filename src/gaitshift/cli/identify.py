"""`gaitshift identify`: finds the best condition and its numbers from logs."""

import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from gaitshift.cli.output import check_folder, emit_json, emit_table, say
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer

if TYPE_CHECKING:
    from gaitshift.lab.identification.judging import Judged

ROC, PAGE = "roc.png", "page.html"
UNFINISHED = "unfinished"
"""Folder of the cache inside the report's folder, until the report is written."""


@dataclass(frozen=True, kw_only=True)
class Identify:
    """Find α and β of a shift condition from logs, and judge them on others.

    Logs are npz files of `gaitshift record`, `demo` and `evaluate`, or tables (CSV, Parquet) of any
    robot with the columns time, rough, contact_FL, foot_FL_x and so on. Every condition is replayed
    over a grid of α, β and leak; the setting with the shortest delay and no false shift is chosen.
    Writes README.md, conditions.csv, courses.csv, a map for each condition, ROC curves and the
    interactive page page.html. If a run is killed, the same command resumes it.
    """

    logs: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Logs for choosing the settings."""
    held_out: tuple[Path, ...] = ()
    """Logs for judging the settings, of other seeds; by default the logs for choosing them."""
    condition: tuple[str, ...] = ("touchdown_surprise",)
    """Conditions to compare; `all` for every condition whose signals are in the logs."""
    alpha: float | None = None
    """Judge this α, in the unit of the condition, instead of choosing one; needs --beta."""
    beta: float | None = None
    """Judge this β [counts]; needs --alpha."""
    leak: float | None = None
    """Judge this leak [counts per step]; needs --alpha and --beta, 0 by default."""
    way: Literal["rough", "flat"] = "rough"
    """What to detect: the start of rough ground, or, for the way back, its end."""
    out: Path
    """Folder of the report."""
    overwrite: bool = False
    """Replace an earlier report in the folder."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Tunes, judges, and writes the report."""
        try:
            from gaitshift.lab.identification import report as reports
            from gaitshift.lab.identification.task import Numbers, Task
        except ImportError as error:
            raise GaitshiftError(
                f"identify needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        if not self.logs:
            raise GaitshiftError(
                "logs must be one file or more, got none; make some with: gaitshift record trot "
                "--out logs"
            )
        if self.alpha is not None and self.beta is not None:
            numbers = Numbers(self.alpha, self.beta, self.leak or 0.0)
        elif (self.alpha, self.beta, self.leak) == (None, None, None):
            numbers = None
        else:
            raise GaitshiftError(
                "--alpha and --beta must be given together, and --leak only with them"
            )
        task = Task(
            logs=self.logs,
            held_out=self.held_out,
            conditions=self.condition,
            way=self.way,
            numbers=numbers,
        )
        with only_writer(self.out):
            ours = (*reports.FILES, ROC, PAGE, *map(_picture, task.names))
            check_folder(self.out, overwrite=self.overwrite, ours=ours, begun=UNFINISHED)
            judged = task.run(self.out / UNFINISHED, say)
            command = shlex.join(["gaitshift", *sys.argv[1:]])
            rows = reports.write_report(
                judged,
                self.out,
                command=command,
                held_out=bool(self.held_out),
                pictures=_draw(judged, self.out),
            )
            from gaitshift.show.report.study_pages import write_identification_page

            title, words = reports.introduction(judged, bool(self.held_out))
            page = self.out / PAGE
            write_identification_page(judged, page, title=title, words=words, command=command)
            shutil.rmtree(self.out / UNFINISHED)
        if self.json:
            emit_json({"out": str(self.out), "conditions": rows})
        else:
            cells = [reports.CONDITIONS_HEAD, *map(reports.condition_cells, rows)]
            emit_table(f"conditions on {len(task.judges)} logs; report in {self.out}", cells)


def _draw(judged: "Sequence[Judged]", out: Path) -> dict[str, str]:
    """Draws the figures into `out`; returns a caption for each file."""
    from gaitshift.lab.identification.report import hardest_first
    from gaitshift.show.plots.identification import condition_map, roc_figure

    pictures: dict[str, str] = {}
    for one in judged:
        if one.tuned.choice.is_free is None:
            continue  # no map for given numbers
        name = one.tuned.candidate.name
        condition_map(one, out / _picture(name))
        pictures[_picture(name)] = f"Mean delay of {name} over α and β"
    met = hardest_first(judged)
    if met:
        roc_figure(judged, met[0], out / ROC)
        pictures[ROC] = f"ROC curves on {met[0]}"
    return pictures


def _picture(condition: str) -> str:
    """File of the map of a condition."""
    return f"{condition}.png"
