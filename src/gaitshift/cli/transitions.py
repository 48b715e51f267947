"""`gaitshift transitions`: every gait swapped for every other, at any instant."""

import shlex
import sys
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path
from typing import Annotated, Any

import tyro

from gaitshift.cli.growing import README, check_numbers, kept_rows
from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.cli.robot_options import RobotOptions
from gaitshift.errors import GaitshiftError
from gaitshift.lab.table import write_rows
from gaitshift.sim.terrain import from_spec

TABLE, PAGE = "transitions.csv", "page.html"


@dataclass(frozen=True, kw_only=True)
class Transitions(RobotOptions):
    """Swap gaits in an instant: every ordered pair, at every phase of the stride.

    A shift succeeds when the robot does not fall within 5 s and shows the new gait. Writes
    transitions.csv, README.md, a heat map a ground, and all of it as one page to hover over,
    page.html. Pairs that the table has already are kept, so that a command that was broken off
    goes on.
    """

    gaits: Annotated[tuple[str, ...], tyro.conf.Positional] = ("trot", "pace", "bound")
    """Gaits by name; `all` for every one with a policy."""
    grounds: tuple[str, ...] = ("flat", "perlin:0.10")
    """Grounds, as in `evaluate --terrain`."""
    switches: int = 512
    """Shifts of each pair on each ground."""
    seed: int = 0
    """Seed of grounds, starts and instants."""
    out: Path
    """Folder of the results."""
    overwrite: bool = False
    """Begin anew where there are results already."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Shifts, and tells what came of it."""
        try:
            from gaitshift.lab.studies import Pair, run_pair
            from gaitshift.lab.studies.transition_page import page
            from gaitshift.lab.studies.transition_table import COLUMNS, is_of, row_of
        except ImportError as error:
            raise GaitshiftError(
                f"transitions needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        names = self.known_gaits() if self.gaits == ("all",) else tuple(dict.fromkeys(self.gaits))
        if len(names) < 2:
            raise GaitshiftError("a shift needs two gaits or more")
        check_numbers("switches", self.switches, self.seed)
        loaded = self.load_policies(names)
        for ground in self.grounds:
            from_spec(ground, seed=self.seed, length=9.0, width=9.0)  # a fault is told at once
        path = self.out / TABLE
        rows = kept_rows(
            path,
            COLUMNS,
            "shifts",
            overwrite=self.overwrite,
            alike={"seed": self.seed, "switches": self.switches},
        )
        for ground in self.grounds:
            for old, new in permutations(names, 2):
                pair = Pair(old, new)
                if any(is_of(row, pair, ground) for row in rows):
                    say(f"{old} to {new} on {ground} is there already, and kept")
                    continue
                with progress(f"{old} to {new}, {ground}") as report:
                    outcomes = run_pair(
                        loaded,
                        pair,
                        ground=ground,
                        switches=self.switches,
                        seed=self.seed,
                        report=report,
                    )
                rows.append(row_of(pair, ground, self.seed, outcomes))
                write_rows(path, COLUMNS, rows)
        self._draw(rows)
        command = shlex.join(["gaitshift", *sys.argv[1:]])
        (self.out / README).write_text(page(rows, command))
        from gaitshift.show.report.study_pages import write_transition_page

        write_transition_page(rows, self.out / PAGE, command=command)
        if self.json:
            emit_json({"out": str(self.out), "transitions": rows})
        else:
            emit_table(f"shifts, {self.switches} each; more in {self.out}", _table(rows))

    def _draw(self, rows: list[dict[str, Any]]) -> None:
        """A map a ground, of all that the table has."""
        from gaitshift.lab.studies.transition_page import picture_of
        from gaitshift.show.plots.transitions import transition_map  # matplotlib is slow to import

        for ground in dict.fromkeys(row["ground"] for row in rows):
            of = [row for row in rows if row["ground"] == ground]
            transition_map(of, self.out / picture_of(ground))


def _table(rows: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    head = ("from", "to", "ground", "succeeded", "fell", "settled within")
    return [head] + [
        (
            row["old"],
            row["new"],
            row["ground"],
            f"{row['successes']} of {row['switches']}",
            str(row["fell"]),
            f"{row['settle_s_p95']} s",
        )
        for row in rows
    ]
