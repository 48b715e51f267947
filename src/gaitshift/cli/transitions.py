"""`gaitshift transitions`: shifts from every gait to every other, at random phases."""

import shlex
import sys
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from pathlib import Path
from typing import Annotated, Any

import tyro

from gaitshift.cli.output import (
    README,
    check_numbers,
    emit_json,
    emit_table,
    progress,
    say,
)
from gaitshift.cli.resumable import resumable_table
from gaitshift.cli.robot_options import RobotOptions, SensorOption
from gaitshift.errors import GaitshiftError
from gaitshift.lab.resume import Report, run_missing
from gaitshift.sim.terrain import from_spec
from gaitshift.table import Row
from gaitshift.whole_file import write_text

TABLE, PAGE = "transitions.csv", "page.html"


@dataclass(frozen=True, kw_only=True)
class Transitions(RobotOptions, SensorOption):
    """Test gait shifts of every ordered pair of gaits at random phases of the stride.

    A shift succeeds if the robot does not fall within 5 s and shows the new gait. Writes
    transitions.csv, README.md, a heat map for each terrain and the interactive page page.html.
    Pairs that the table already has are not repeated, so an interrupted command resumes.
    """

    gaits: Annotated[tuple[str, ...], tyro.conf.Positional] = ("trot", "pace", "bound")
    """Gaits; `all` for every gait with a policy."""
    grounds: tuple[str, ...] = ("flat", "perlin:0.10")
    """Terrains, as in `evaluate --terrain`."""
    switches: int = 512
    """Number of shifts of each pair on each terrain."""
    seed: int = 0
    """Seed of terrains, starts and phases."""
    out: Path
    """Folder of the results."""
    overwrite: bool = False
    """Discard earlier results in the folder."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Runs the shifts, and prints the results."""
        try:
            from gaitshift.lab.studies import Pair, run_pair
            from gaitshift.lab.studies.transitions import COLUMNS, page, row_of
        except ImportError as error:
            raise GaitshiftError(
                f"transitions needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        names = self.known_gaits() if self.gaits == ("all",) else tuple(dict.fromkeys(self.gaits))
        if len(names) < 2:
            raise GaitshiftError(f"gaits must name two gaits or more, got {len(names)}")
        check_numbers("switches", self.switches, self.seed)
        loaded = self.load_policies(names)
        for ground in self.grounds:
            from_spec(ground, seed=self.seed, length=9.0, width=9.0)  # checks all specs first
        with resumable_table(
            self.out / TABLE,
            COLUMNS,
            "shifts",
            key=("old", "new", "ground"),
            same={"sensors": self.sensors.name, "seed": self.seed, "switches": self.switches},
            overwrite=self.overwrite,
        ) as table:

            def shifted(pair: Pair, ground: str, report: Report) -> Row:
                outcomes = run_pair(
                    loaded,
                    pair,
                    ground=ground,
                    switches=self.switches,
                    seed=self.seed,
                    sensors=self.sensors,
                    report=report,
                )
                return row_of(pair, ground, self.seed, outcomes, self.sensors)

            parts = [
                table.part(
                    (old, new, ground),
                    f"{old} to {new} on {ground}",
                    partial(shifted, Pair(old, new), ground),
                )
                for ground in self.grounds
                for old, new in permutations(names, 2)
            ]
            run_missing(parts, progress=progress, say=say)
            rows = table.rows
            self._draw(rows)
            command = shlex.join(["gaitshift", *sys.argv[1:]])
            write_text(self.out / README, page(rows, command))
            from gaitshift.show.report.study_pages import write_transition_page

            write_transition_page(rows, self.out / PAGE, command=command)
        if self.json:
            emit_json({"out": str(self.out), "transitions": rows})
        else:
            emit_table(f"shifts, {self.switches} each; results in {self.out}", _table(rows))

    def _draw(self, rows: list[dict[str, Any]]) -> None:
        """Draws one map per ground, of all rows of the table."""
        from gaitshift.lab.studies.transitions import picture_of
        from gaitshift.show.plots.studies import transition_map  # matplotlib is slow to import

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
