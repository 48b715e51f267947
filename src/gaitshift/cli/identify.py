"""`gaitshift identify`: which condition, and with which numbers, from logs."""

import shlex
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro

from gaitshift.cli.output import check_folder, emit_json, emit_table, say
from gaitshift.errors import GaitshiftError

if TYPE_CHECKING:
    from gaitshift.identification.finding import Judged, Recordings
    from gaitshift.identification.recording import Way

ROC, PAGE = "roc.png", "page.html"


@dataclass(frozen=True, kw_only=True)
class Identify:
    """Find α and β of a shift condition from logs, and judge them on others.

    Logs are npz files of `gaitshift record`, `demo` and `evaluate`, or tables (CSV, Parquet) of any
    robot with the columns time, rough, contact_FL, foot_FL_x and so on. Every condition is replayed
    over a grid of α, β and leaks; the soonest detection that never shifts on smooth ground is
    chosen. Writes README.md, conditions.csv, courses.csv, a map a condition, ROC curves, and all of
    it as one page to hover over and zoom into, page.html.
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
            from gaitshift.identification import report as reports
            from gaitshift.identification.candidates import CANDIDATES, candidates
            from gaitshift.identification.classifier import NAME, RoughnessClassifier
            from gaitshift.identification.finding import as_given, judge, tune
            from gaitshift.identification.sources import check_sources
        except ImportError as error:
            raise GaitshiftError(
                f"identify needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        if not self.logs:
            raise GaitshiftError("which logs? make some with: gaitshift record trot --out logs")
        if (self.alpha is None) != (self.beta is None) or (
            self.leak is not None and self.alpha is None
        ):
            raise GaitshiftError("numbers to judge: give --alpha and --beta, and --leak if any")
        everything = "all" in self.condition
        if everything and self.alpha is not None:
            raise GaitshiftError("α has another unit in each condition: name those for --alpha")
        named = candidates([name for name in self.condition if name not in (NAME, "all")])
        wanted = list(CANDIDATES if everything else named)
        check_sources((*self.logs, *self.held_out))
        _check_apart(self.logs, self.held_out)
        check_folder(self.out, overwrite=self.overwrite, ours=(*reports.FILES, ROC, PAGE))
        read = _reader(self.logs, self.way)
        classifier: RoughnessClassifier | None = None
        if everything or NAME in self.condition:
            say("fitting the classifier")
            try:
                classifier = RoughnessClassifier.fit(read())
                wanted.append(classifier.candidate(crosswise=True))
            except GaitshiftError as error:
                if not everything:
                    raise
                say(f"{error}; it is left out")
        if self.alpha is None or self.beta is None:
            tuned = tune(wanted, read, way=self.way, report=_tell("choosing"))
        else:
            leak = self.leak or 0.0
            tuned = as_given(wanted, way=self.way, alpha=self.alpha, beta=self.beta, leak=leak)
        found = {one.candidate.name for one in tuned}
        left_out = [candidate for candidate in wanted if candidate.name not in found]
        if left_out and not everything:
            lacks = left_out[0].missing(next(iter(read())))
            raise GaitshiftError(
                f"the logs lack the signals of '{left_out[0].name}': it needs {', '.join(lacks)}"
            )
        if classifier is not None:
            known = classifier.candidate(crosswise=False)
            tuned = [replace(t, candidate=known) if t.candidate.name == NAME else t for t in tuned]
        judges = self.held_out or self.logs
        judged = judge(tuned, _reader(judges, self.way), report=_tell("judging"))
        self.out.mkdir(parents=True, exist_ok=True)
        command = shlex.join(["gaitshift", *sys.argv[1:]])
        rows = reports.write_report(
            judged,
            self.out,
            command=command,
            held_out=bool(self.held_out),
            pictures=_draw(judged, self.out),
        )
        from gaitshift.report.study_pages import write_identification_page

        title, words = reports.introduction(judged, bool(self.held_out))
        page = self.out / PAGE
        write_identification_page(judged, page, title=title, words=words, command=command)
        if self.json:
            emit_json({"out": str(self.out), "conditions": rows})
        else:
            cells = [reports.CONDITIONS_HEAD, *map(reports.condition_cells, rows)]
            emit_table(f"conditions, by {len(judges)} logs; report in {self.out}", cells)


def _reader(paths: Sequence[Path], way: "Way") -> "Recordings":
    from gaitshift.identification.sources import recordings

    return lambda: recordings(paths, way)


def _check_apart(logs: Sequence[Path], held_out: Sequence[Path]) -> None:
    """Refuses a log that both chooses and judges, by whatever name."""
    choosing = {path.resolve() for path in logs}
    both = [path for path in held_out if path.resolve() in choosing]
    if both:
        raise GaitshiftError(
            f"{both[0]} is given twice, to choose the numbers and with --held-out; logs of other "
            "seeds would be right"
        )


def _tell(what: str) -> Callable[[str], None]:
    def tell(name: str) -> None:
        say(f"{what}: {name}")

    return tell


def _draw(judged: "Sequence[Judged]", out: Path) -> dict[str, str]:
    """Draws the pictures into `out`: a line on each, by its file."""
    from gaitshift.identification.report import hardest_first
    from gaitshift.plots.identification import condition_map, roc_figure

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
