"""`gaitshift study`: whether shifting the gait helps."""

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaitshift.cli.growing import README, check_numbers, kept_rows
from gaitshift.cli.output import emit_json, emit_table, progress, say
from gaitshift.cli.robot_options import RobotOptions
from gaitshift.errors import GaitshiftError
from gaitshift.lab.table import write_rows
from gaitshift.shift import CONDITIONS

TABLE = "crossings.csv"


@dataclass(frozen=True, kw_only=True)
class Study(RobotOptions):
    """Send robots over noise in one gait, in the other, and shifted by each condition.

    Tells survival, distance, speed and cost of transport with intervals, beside an oracle that sees
    the ground. Writes crossings.csv, README.md and a figure. What the table has already is kept, so
    that a command that was broken off goes on.
    """

    flat_gait: str = "trot"
    """The gait for flat ground."""
    rough_gait: str = "bound"
    """The gait for rough ground."""
    conditions: tuple[str, ...] = tuple(CONDITIONS)
    """Conditions by name."""
    amplitudes: tuple[float, ...] = (0.0, 0.05, 0.10, 0.15, 0.20, 0.25)
    """Of the noise [m]."""
    runs: int = 512
    """Robots of each way at each amplitude."""
    seed: int = 0
    """Seed of grounds and starts."""
    out: Path
    """Folder of the results."""
    overwrite: bool = False
    """Begin anew where there are results already."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Crosses, and tells what came of it."""
        try:
            from gaitshift.lab.studies.crossing import cross, ways
            from gaitshift.lab.studies.crossing_table import COLUMNS, PICTURE, is_of, page, row_of
        except ImportError as error:
            raise GaitshiftError(
                f"study needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        check_numbers("runs", self.runs, self.seed, least=2)
        for amplitude in self.amplitudes:
            if not 0 <= amplitude <= 1:
                raise GaitshiftError(f"an amplitude of {amplitude:g} m: 0 to 1 m would be right")
        every = ways(self.flat_gait, self.rough_gait, self.conditions)
        loaded = self.load_policies((self.flat_gait, self.rough_gait))
        path = self.out / TABLE
        rows = kept_rows(
            path,
            COLUMNS,
            "crossings",
            overwrite=self.overwrite,
            alike={"seed": self.seed, "runs": self.runs},
        )
        for amplitude in self.amplitudes:
            for way in every:
                if any(is_of(row, way, amplitude) for row in rows):
                    say(f"{way.name} over {amplitude:g} m is there already, and kept")
                    continue
                with progress(f"{way.name}, {amplitude:g} m") as report:
                    crossings = cross(
                        loaded,
                        way,
                        amplitude=amplitude,
                        runs=self.runs,
                        seed=self.seed,
                        report=report,
                    )
                rows.append(row_of(way, amplitude, self.seed, crossings))
                write_rows(path, COLUMNS, rows)
        from gaitshift.show.plots.crossings import crossings_figure  # matplotlib is slow to import

        crossings_figure(rows, self.out / PICTURE)
        command = shlex.join(["gaitshift", *sys.argv[1:]])
        (self.out / README).write_text(page(rows, command))
        if self.json:
            emit_json({"out": str(self.out), "crossings": rows})
        else:
            emit_table(f"crossings, {self.runs} each; more in {self.out}", _table(rows))


def _table(rows: list[dict[str, Any]]) -> list[tuple[str, ...]]:
    head = ("noise", "way", "survived", "arrived", "speed [m/s]", "CoT", "shifts")
    return [head] + [
        (
            f"{row['amplitude']:g} m",
            row["way"],
            f"{row['survived']} of {row['runs']}",
            str(row["arrived"]),
            f"{row['speed_m_s']}",
            f"{row['cost_of_transport']}",
            f"{row['shifts']}",
        )
        for row in rows
    ]
