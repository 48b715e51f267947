"""`gaitshift study`: whether shifting the gait helps."""

import shlex
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

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
from gaitshift.table import Row
from gaitshift.whole_file import write_text

TABLE = "crossings.csv"


@dataclass(frozen=True, kw_only=True)
class Study(RobotOptions, SensorOption):
    """Compare robots on rough ground: in either gait alone, and with shifts by each condition.

    Reports survival, distance, speed and cost of transport with intervals, and those of an oracle
    that knows the ground. Writes crossings.csv, README.md and a figure. Rows that the table already
    has are not repeated, so an interrupted command resumes.
    """

    flat_gait: str = "trot"
    """Gait on flat ground."""
    rough_gait: str = "bound"
    """The gait for rough ground."""
    conditions: tuple[str, ...] = ("terrain", "height_difference", "paper")
    """Shipped gait graphs of two gaits, or TOML files."""
    amplitudes: tuple[float, ...] = (0.0, 0.05, 0.10, 0.15, 0.20, 0.25)
    """Amplitudes of the Perlin noise [m]."""
    runs: int = 512
    """Robots for each gait or condition at each amplitude."""
    seed: int = 0
    """Seed of terrains and starts."""
    out: Path
    """Folder of the results."""
    overwrite: bool = False
    """Discard earlier results in the folder."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Runs the crossings, and prints the results."""
        try:
            from gaitshift.lab.studies.crossing import (
                COLUMNS,
                PICTURE,
                Strategy,
                cross,
                page,
                row_of,
                strategies,
            )
        except ImportError as error:
            raise GaitshiftError(
                f"study needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        check_numbers("runs", self.runs, self.seed, least=2)
        for amplitude in self.amplitudes:
            if not 0 <= amplitude <= 1:
                raise GaitshiftError(f"amplitudes must be 0 to 1 m, got {amplitude:g}")
        every = strategies(self.flat_gait, self.rough_gait, self.conditions)
        loaded = self.load_policies((self.flat_gait, self.rough_gait))
        with resumable_table(
            self.out / TABLE,
            COLUMNS,
            "crossings",
            key=("amplitude", "way"),
            same={"sensors": self.sensors.name, "seed": self.seed, "runs": self.runs},
            overwrite=self.overwrite,
        ) as table:

            def crossed(way: Strategy, amplitude: float, report: Report) -> Row:
                crossings = cross(
                    loaded,
                    way,
                    amplitude=amplitude,
                    runs=self.runs,
                    seed=self.seed,
                    sensors=self.sensors,
                    report=report,
                )
                return row_of(way, amplitude, self.seed, crossings, self.sensors)

            parts = [
                table.part(
                    (amplitude, way.name),
                    f"{way.name} at {amplitude:g} m",
                    partial(crossed, way, amplitude),
                )
                for amplitude in self.amplitudes
                for way in every
            ]
            run_missing(parts, progress=progress, say=say)
            rows = table.rows
            # Here, because matplotlib is slow to import.
            from gaitshift.show.plots.studies import crossings_figure

            crossings_figure(rows, self.out / PICTURE)
            command = shlex.join(["gaitshift", *sys.argv[1:]])
            write_text(self.out / README, page(rows, command))
        if self.json:
            emit_json({"out": str(self.out), "crossings": rows})
        else:
            emit_table(f"crossings, {self.runs} robots each; results in {self.out}", _table(rows))


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
