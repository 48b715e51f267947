"""`gaitshift reproduce`: trains with the paper's recipe, and compares the results."""

import os
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from gaitshift.cli.demo import names_option
from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer

RESULTS, RUNS = Path("docs/results/paper"), Path("runs/reproduce")
QUICK_RESULTS, QUICK_RUNS = Path("runs/reproduce-quick/results"), Path("runs/reproduce-quick")


@dataclass(frozen=True, kw_only=True)
class Reproduce:
    """Reproduce the paper: train trot, bound and pace with its recipe on five seeds, and ablations.

    Takes about three hours on 2 cores. If it is interrupted, the same command resumes.
    """

    only: Annotated[tuple[str, ...], names_option] = ()
    """Train only these gaits, ablations or groups of ablations, such as trot,bonus. The report
    covers all finished runs."""
    out: Path | None = None
    """Folder for README.md, figures and CSV files; docs/results/paper by default."""
    runs: Path | None = None
    """Folder for the runs; runs/reproduce by default."""
    add: bool = False
    """Add to the report in --out: do not repeat runs that it contains, even if their folders no
    longer exist."""
    jobs: int = os.cpu_count() or 1
    """Number of runs in parallel, each on one core; by default the number of cores."""
    quick: bool = False
    """Test run in runs/reproduce-quick: tiny trainings that learn nothing."""
    seed: int = 0
    """First seed; the other seeds follow it."""
    json: bool = False
    """One JSON object on stdout: the findings and the tables."""

    def run(self) -> None:
        """Trains all unfinished runs, and writes the report."""
        try:
            from gaitshift.lab.reproduction.plan import Plan
            from gaitshift.lab.reproduction.results import EarlierRuns, Results
            from gaitshift.lab.reproduction.training import train_all
            from gaitshift.show.report.reproduction import write_report
        except ImportError as error:
            raise GaitshiftError(
                f"training needs the package '{error.name}'; install gaitshift[train]"
            ) from error
        if not 1 <= self.jobs <= 1024:
            raise GaitshiftError(f"jobs must be 1 to 1024, got {self.jobs}")
        runs = self.runs or (QUICK_RUNS if self.quick else RUNS)
        out = self.out or (QUICK_RESULTS if self.quick else RESULTS)
        for folder in (runs, out):
            there = next(path for path in (folder, *folder.parents) if path.exists())
            if not there.is_dir():
                raise GaitshiftError(f"--out and --runs must be a folder, got the file {there}")
        plan = Plan.tiny(self.seed) if self.quick else Plan(seed=self.seed)
        with ExitStack() as held:
            for folder in dict.fromkeys((runs.resolve(), out.resolve())):
                held.enter_context(only_writer(folder))
            earlier = EarlierRuns.read(plan, out) if self.add else EarlierRuns()
            wanted = [job for job in plan.select(self.only) if job.name not in earlier.curves]
            with progress(f"{len(wanted)} runs") as report:
                train_all(wanted, runs, self.jobs, report)
            with progress("judging") as report:
                written = write_report(
                    Results.read(plan, runs, earlier), runs, out, earlier, report
                )
        _say_broken(written)
        if self.json:
            emit_json(written)
            return
        emit_table(
            "verdicts on the paper", [(f["name"], f["verdict"]) for f in written["findings"]]
        )
        print(f"results in {out}: {', '.join(written['files'])}")


def _say_broken(written: dict[str, Any]) -> None:
    for row in written["ablations"]:
        if row["broke_down"]:
            say(f"{row['broke_down']} of {row['seeds']} runs of '{row['setting']}' diverged")
