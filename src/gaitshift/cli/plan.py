"""`gaitshift plan`: the gait graph that a map of gaits speaks for."""

import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from gaitshift.cli.output import emit_json, emit_table, say
from gaitshift.data import check_ranges
from gaitshift.errors import GaitshiftError
from gaitshift.table import read_typed
from gaitshift.whole_file import write_text


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Identify a gait graph from a map: which gait at which speed, and where to shift.

    Thresholds lie where the gaits' figures cross, with hysteresis. A gait that is nowhere clearly
    the best is left out. Writes a graph file for `demo --speeds`, `view` and `deploy`.
    """

    map: Annotated[Path, tyro.conf.Positional]
    """map.csv of `gaitshift map`, or its folder."""
    objective: Literal["energy", "electrical-energy", "progress"] = "energy"
    """What makes a gait the best: least energy for the distance, or most progress."""
    survival: float = 0.99
    """Least share of the robots that survive."""
    ground: str = "flat"
    """Ground of the map."""
    hysteresis: float = 0.05
    """Least distance of the thresholds from the crossing, up and down [m/s]."""
    seed: int = 0
    """Seed of the draws for the intervals of thresholds."""
    out: Path
    """Graph file, ending in .toml."""
    overwrite: bool = False
    """Replace the file if it exists."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Reads the map, writes the graph, and prints its edges."""
        try:
            from gaitshift.lab.studies.best import Objective
            from gaitshift.lab.studies.gait_map import COLUMNS
            from gaitshift.lab.studies.plan import graph_text, plan
        except ImportError as error:
            raise GaitshiftError(
                f"plan needs the package '{error.name}'; install gaitshift[identify]"
            ) from error
        objective = Objective(name=self.objective, survival=self.survival)
        check_ranges(self, hysteresis=(0.0, 1.0), seed=(0, 2**31))
        if self.out.suffix != ".toml":
            raise GaitshiftError(f"--out must end in .toml, got {self.out}")
        if self.out.exists() and not self.overwrite:
            raise GaitshiftError(f"{self.out} exists; give another --out, or --overwrite")
        path = self.map / "map.csv" if self.map.is_dir() else self.map
        if not path.is_file():
            raise GaitshiftError(f"no map {path}")
        rows = read_typed(path, COLUMNS, "maps")
        found = plan(
            rows, objective, ground=self.ground, hysteresis=self.hysteresis, seed=self.seed
        )
        for name in found.left_out:
            say(f"{name} is nowhere clearly the best, left out")
        for one in found.nobody:
            say(f"no gait meets the objective at {one.first:g} to {one.last:g} m/s")
        command = shlex.join(["gaitshift", *sys.argv[1:]])
        self.out.parent.mkdir(parents=True, exist_ok=True)
        text = graph_text(found, objective, ground=self.ground, source=command)
        write_text(self.out, text)
        edges: list[dict[str, Any]] = [
            {
                "slower": one.slower,
                "faster": one.faster,
                "crossing": round(one.speed, 4),
                "low": round(one.low, 4),
                "high": round(one.high, 4),
                "up": round(one.up, 3),
                "down": round(one.down, 3),
            }
            for one in found.crossings
        ]
        if self.json:
            emit_json({"out": str(self.out), "policies": list(found.gaits), "edges": edges})
            return
        head = ("from", "to", "cross at [m/s]", "95 %", "up above", "down below")
        cells = [
            (
                edge["slower"],
                edge["faster"],
                f"{edge['crossing']:.3f}",
                f"{edge['low']:.3f} to {edge['high']:.3f}",
                f"{edge['up']:.3f}",
                f"{edge['down']:.3f}",
            )
            for edge in edges
        ]
        emit_table(
            f"the best by {self.objective} on {self.ground}; graph in {self.out}", [head, *cells]
        )
