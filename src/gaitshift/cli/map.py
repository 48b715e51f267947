"""`gaitshift map`: which gait is best at which speed, on which ground."""

import shlex
import sys
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import tyro

from gaitshift.cli.output import README, check_numbers, emit_json, progress, say
from gaitshift.cli.resumable import resumable_table
from gaitshift.cli.robot_options import RobotOption, SensorOption
from gaitshift.control import policy as policies
from gaitshift.data import check_ranges
from gaitshift.errors import GaitshiftError
from gaitshift.lab.resume import Report, run_missing
from gaitshift.sim.terrain import from_spec
from gaitshift.table import Row
from gaitshift.whole_file import write_text

TABLE = "map.csv"


@dataclass(frozen=True, kw_only=True)
class Map(RobotOption, SensorOption):
    """Measure survival, progress and cost of gaits at many speeds, on many grounds.

    Speeds outside a gait's range are left out. Writes map.csv, README.md with the best gait at each
    speed, and a figure. Rows that the table already has are not repeated, so an interrupted command
    resumes, and more gaits, speeds or grounds may be added.
    """

    policies: Annotated[tuple[str, ...], tyro.conf.Positional]
    """Shipped policies by the names of their gaits, or policy files ending in .onnx."""
    speeds: tuple[float, ...] = (0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6)
    """Forward speeds [m/s]."""
    grounds: tuple[str, ...] = ("flat",)
    """Grounds, as in `evaluate --terrain`."""
    bodies: tuple[str, ...] = ("own",)
    """What differs from the robot's model: own (nothing), or NAME:VALUE joined by +, such as
    payload:5 or friction:0.4+strength:0.8; names are those of `env.randomisation`."""
    frequencies: int = 1
    """Stride frequencies of a gait's range at each speed, of which the best counts; 1: the gait's
    own."""
    robots: int = 128
    """Robots at each place."""
    seconds: float = 12.0
    """Length of a run [s]."""
    push: float = 0.0
    """Largest push on the base [N]."""
    objective: Literal["energy", "electrical-energy", "progress"] = "energy"
    """What makes a gait the best: least energy for the distance, or most progress."""
    survival: float = 0.99
    """Least share of the robots that survive, for a gait to be the best."""
    seed: int = 0
    """Seed of terrains, starts, pushes and sensors."""
    out: Path
    """Folder of the results."""
    overwrite: bool = False
    """Discard earlier results in the folder."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Measures, draws, and prints the best gaits."""
        try:
            from gaitshift.lab.studies.best import Objective
            from gaitshift.lab.studies.gait_map import (
                COLUMNS,
                KEY,
                PICTURE,
                Place,
                answers,
                body_of,
                check_speeds,
                page,
                places,
                row_of,
                walk,
            )
        except ImportError as error:
            raise GaitshiftError(
                f"map needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        check_numbers("robots", self.robots, self.seed, least=2)
        check_ranges(self, seconds=(3.0, 3600.0), frequencies=(1, 100), push=(0.0, 1000.0))
        check_speeds(self.speeds)
        objective = Objective(name=self.objective, survival=self.survival)
        for ground in self.grounds:
            from_spec(ground, seed=self.seed, length=9.0, width=9.0)  # checks all specs first
        for body in self.bodies:
            body_of(body)
        robot = self.read_robot()
        loaded = {name: policies.load(name, robot) for name in dict.fromkeys(self.policies)}
        wanted = places(
            loaded,
            grounds=self.grounds,
            bodies=self.bodies,
            speeds=self.speeds,
            frequencies=self.frequencies,
        )
        if not wanted:
            ranges = ((name, *one.machine.speed_range) for name, one in loaded.items())
            known = ", ".join(f"{name} {low:g} to {high:g} m/s" for name, low, high in ranges)
            raise GaitshiftError(f"speeds must be in the range of a gait: {known}")
        same = {
            "sensors": self.sensors.name,
            "push": self.push,
            "seed": self.seed,
            "robots": self.robots,
            "seconds": self.seconds,
        }

        def walked(name: str, place: Place, report: Report) -> Row:
            walks = walk(
                loaded[name],
                place,
                robots=self.robots,
                seconds=self.seconds,
                push=self.push,
                seed=self.seed,
                sensors=self.sensors,
                report=report,
            )
            return row_of(name, loaded[name], place, walks, **same)

        with resumable_table(
            self.out / TABLE, COLUMNS, "maps", key=KEY, same=same, overwrite=self.overwrite
        ) as table:
            parts = [
                table.part(
                    (name, place.ground, place.body, place.speed, place.stride_frequency),
                    f"{name} at {place.speed:g} m/s, {place.stride_frequency:.2f} Hz on "
                    f"{place.ground}",
                    partial(walked, name, place),
                )
                for name, place in wanted
            ]
            run_missing(parts, progress=progress, say=say)
            rows = table.rows
            from gaitshift.show.plots.gait_map import map_figure  # matplotlib is slow to import

            map_figure(rows, self.out / PICTURE, objective)
            command = shlex.join(["gaitshift", *sys.argv[1:]])
            write_text(self.out / README, page(rows, objective, command))
        if self.json:
            emit_json({"out": str(self.out), "map": rows})
        else:
            print("\n".join(answers(rows, objective)))
            print(f"results in {self.out}: {README}, {PICTURE}, {TABLE}")
