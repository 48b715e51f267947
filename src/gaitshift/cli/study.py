"""`gaitshift study`: whether shifting the gait helps."""

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gaitshift import policy as policies
from gaitshift.cli.output import check_folder, emit_json, emit_table, progress, say
from gaitshift.errors import GaitshiftError
from gaitshift.switching import CONDITIONS

TABLE, README = "crossings.csv", "README.md"


@dataclass(frozen=True, kw_only=True)
class Study:
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
            from gaitshift.studies.crossing import cross, ways
            from gaitshift.studies.crossing_table import COLUMNS, PICTURE, is_of, page, row_of
            from gaitshift.studies.table import read_rows, write_rows
        except ImportError as error:
            raise GaitshiftError(
                f"study needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        if not 2 <= self.runs <= 1_000_000:
            raise GaitshiftError(f"{self.runs} runs: 2 to 1000000 would be right")
        if self.seed < 0:
            raise GaitshiftError(f"seed {self.seed}: a seed is 0 or larger")
        for amplitude in self.amplitudes:
            if not 0 <= amplitude <= 1:
                raise GaitshiftError(f"an amplitude of {amplitude:g} m: 0 to 1 m would be right")
        every = ways(self.flat_gait, self.rough_gait, self.conditions)
        loaded = {gait: policies.load(gait) for gait in (self.flat_gait, self.rough_gait)}
        path = self.out / TABLE
        if not path.is_file():
            check_folder(self.out, overwrite=self.overwrite, ours=(TABLE, README))
        rows = [] if self.overwrite else read_rows(path, COLUMNS, "crossings")
        self.out.mkdir(parents=True, exist_ok=True)
        for amplitude in self.amplitudes:
            for way in every:
                if any(is_of(row, way, amplitude, self.seed, self.runs) for row in rows):
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
        from gaitshift.plots.crossings import crossings_figure  # matplotlib is slow to import

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
