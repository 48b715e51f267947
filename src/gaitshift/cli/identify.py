"""`gaitshift identify`: which condition, and with which numbers, from logs."""

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

if TYPE_CHECKING:
    from gaitshift.lab.identification.judging import Judged

ROC, PAGE = "roc.png", "page.html"
UNFINISHED = "unfinished"
"""Folder, in that of the report, of what is kept until it is written."""


@dataclass(frozen=True, kw_only=True)
class Identify:
    """Find α and β of a shift condition from logs, and judge them on others.

    Logs are npz files of `gaitshift record`, `demo` and `evaluate`, or tables (CSV, Parquet) of any
    robot with the columns time, rough, contact_FL, foot_FL_x and so on. Every condition is replayed
    over a grid of α, β and leaks; the soonest detection that never shifts on smooth ground is
    chosen. Writes README.md, conditions.csv, courses.csv, a map a condition, ROC curves, and all of
    it as one page to hover over and zoom into, page.html. A run that was killed goes on where it
    stopped when the same is asked for again.
    """

    logs: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Logs that choose the numbers."""
    held_out: tuple[Path, ...] = ()
    """Logs that judge them, of other seeds; without them the same ones do, and the report says
    so."""
    condition: tuple[str, ...] = ("touchdown_surprise",)
    """Conditions to compare, by name; `all` for every one that the logs feed."""
    alpha: float | None = None
    """Judge this α, in each condition's unit, instead of choosing one; with --beta."""
    beta: float | None = None
    """… and this β [counts]."""
    leak: float | None = None
    """… and this leak [counts a step]; 0 if left out."""
    way: Literal["rough", "flat"] = "rough"
    """What is to be noticed: rough ground ahead, or, for the way back, that it has ended."""
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
            raise GaitshiftError("which logs? make some with: gaitshift record trot --out logs")
        if self.alpha is not None and self.beta is not None:
            numbers = Numbers(self.alpha, self.beta, self.leak or 0.0)
        elif (self.alpha, self.beta, self.leak) == (None, None, None):
            numbers = None
        else:
            raise GaitshiftError("numbers to judge: give --alpha and --beta, and --leak if any")
        task = Task(
            logs=self.logs,
            held_out=self.held_out,
            conditions=self.condition,
            way=self.way,
            numbers=numbers,
        )
        ours = (*reports.FILES, ROC, PAGE)
        check_folder(self.out, overwrite=self.overwrite, ours=ours, left=UNFINISHED)
        judged = task.run(self.out / UNFINISHED, say)
        self.out.mkdir(parents=True, exist_ok=True)
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
            emit_table(f"conditions, by {len(task.judges)} logs; report in {self.out}", cells)


def _draw(judged: "Sequence[Judged]", out: Path) -> dict[str, str]:
    """Draws the pictures into `out`: a line on each, by its file."""
    from gaitshift.lab.identification.report import hardest_first
    from gaitshift.show.plots.identification import condition_map, roc_figure

    pictures: dict[str, str] = {}
    for one in judged:
        if one.tuned.choice.is_free is None:
            continue  # nothing was tried but the numbers that were given
        name = one.tuned.candidate.name
        condition_map(one, out / f"{name}.png")
        pictures[f"{name}.png"] = f"How soon {name} notices, over α and β"
    met = hardest_first(judged)
    if met:
        roc_figure(judged, met[0], out / ROC)
        pictures[ROC] = f"ROC curves on {met[0]}"
    return pictures
