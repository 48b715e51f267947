"""Walks the shipped policies in MuJoCo and PyBullet, and writes docs/results/second-simulator.md.

Usage: python tools/second_simulator.py [--page]

Needs the extra `sim2sim`. Takes about half an hour on two cores. Each outcome is a row of
second_simulator_gaits.csv or second_simulator_shifts.csv beside the page, and runs that have a row
there are not repeated. `--page` writes the page from the rows that there are.
"""

import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from statistics import mean
from typing import Any

from gaitshift import table
from gaitshift.control import policy
from gaitshift.lab.evaluation import DemoConfig, EvaluationConfig, evaluate, run_demo
from gaitshift.lab.gait_analysis import FIRST_GAITS
from gaitshift.sim.simulator import SIMULATORS

RESULTS = Path(__file__).parent.parent / "docs" / "results"
PAGE = RESULTS / "second-simulator.md"
GAITS, SHIFTS = RESULTS / "second_simulator_gaits.csv", RESULTS / "second_simulator_shifts.csv"

ROBOTS, SECONDS, CROSSINGS = 8, 10.0, 20
NOISE_AT = 8.0
"""Where the noise begins on the demonstration's track [m]."""

GROUNDS = (("flat", 0.0), ("perlin:0.10", 0.0))
"""Grounds and pushes [N] for all gaits."""
FURTHER = (("flat", 120.0), ("slope:10", 0.0), ("slope:-10", 0.0))
"""The same for trot, pace and bound alone."""

TEXT = """# Do the shipped policies walk in a second simulator?

{answer}

The second simulator is PyBullet 3.2.7. It simulates ANYmal B's public URDF (the wheel
`example-robot-data`) with contacts of its own: other shapes, another solver, another softness.
Policies, loops, conditions and measures are the same code in both
([how it is built](../design.md#a-second-simulator)).

**Hypothesis**, written before these runs and after a pilot with 8 robots. In PyBullet

1. each of the eight gaits has its own name on flat ground by its contacts and is clean, no robot
   falls, and the mean speed differs from that in MuJoCo by at most 0.05 m/s;
2. on noise of 0.10 m 0.95 or more of the robots of each gait stay up, and the mean speed differs by
   at most 0.05 m/s;
3. the default condition shifts to the bound on the noise and back behind it, without a fall, in 20
   of 20 crossings of the demonstration's track, and detects the noise within 0.3 m of where it does
   in MuJoCo, in the mean.

Pushes and slopes are reported without a hypothesis.

**Metrics**: those of [the gaits](gaits.md). Survival is the share of robots that do not fall.
*Detection* is the way of the base from the beginning of the noise to the first shift.
**N**: {robots} robots × {seconds:g} s for each gait, ground and simulator (seed 0; the first 2 s
are left out), on eight fields where the ground is random; {crossings} crossings in each simulator,
each on a field of its own, the same in both.

{results}
This page is made by `python tools/second_simulator.py`. One gait alone: `gaitshift evaluate trot
--simulator pybullet --episodes 8`.
"""


@dataclass(frozen=True, kw_only=True)
class Walk:
    """One evaluation of a gait."""

    simulator: str
    gait: str
    terrain: str
    push: float

    def run(self) -> list[dict[str, Any]]:
        """Its row."""
        config = EvaluationConfig(
            terrain=self.terrain,
            push=self.push,
            episodes=ROBOTS,
            seconds=SECONDS,
            simulator=self.simulator,
        )
        figures, _ = evaluate(policy.load(self.gait), config)
        verdict = figures["verdict"]
        names = ("survival", "speed_mean", "cost_of_transport", "pattern_fraction")
        row = {"simulator": self.simulator, "gait": self.gait, "terrain": self.terrain}
        row |= {"push": self.push, "named": verdict["gait"], "clean": verdict["clean"]}
        row |= {name: "" if figures[name] is None else f"{figures[name]:.4f}" for name in names}
        misses = (f"{miss['figure']} {miss['value']}" for miss in verdict["misses"])
        return [{**row, "misses": "; ".join(misses)}]


@dataclass(frozen=True, kw_only=True)
class Crossings:
    """The demonstration, as often as `CROSSINGS`."""

    simulator: str

    def run(self) -> list[dict[str, Any]]:
        """A row a robot."""
        _, summaries = run_demo(DemoConfig(episodes=CROSSINGS, simulator=self.simulator))
        rows: list[dict[str, Any]] = []
        for seed, summary in enumerate(summaries):
            shifts = summary["switches"]
            gaits = [shift["from"] for shift in shifts[:1]] + [shift["to"] for shift in shifts]
            row = {"simulator": self.simulator, "seed": seed, "survived": summary["survived"]}
            row |= {"finished": summary["finished"], "gaits": " ".join(gaits)}
            row |= {"at": " ".join(f"{shift['x_m']:.2f}" for shift in shifts)}
            rows.append(row)
        return rows


def runs() -> Iterator[Walk | Crossings]:
    """All that have no row yet, the longest first."""
    crossed = {row["simulator"] for row in _rows(SHIFTS)}
    yield from (Crossings(simulator=name) for name in SIMULATORS if name not in crossed)
    keys = ("simulator", "gait", "terrain", "push")
    done = {tuple(row[key] for key in keys) for row in _rows(GAITS)}
    for grounds, gaits in ((GROUNDS, policy.shipped()), (FURTHER, FIRST_GAITS)):
        for terrain, push in grounds:
            for gait in gaits:
                for name in SIMULATORS:
                    if (name, gait, terrain, str(push)) not in done:
                        yield Walk(simulator=name, gait=gait, terrain=terrain, push=push)


def results() -> tuple[str, str]:
    """The answer in one paragraph, and the tables."""
    rows = {(r["simulator"], r["gait"], r["terrain"], r["push"]): r for r in _rows(GAITS)}
    if not rows:
        return "Not run yet.", ""
    second = [row for row in rows.values() if row["simulator"] == "pybullet"]
    flat = [row for row in second if (row["terrain"], row["push"]) == ("flat", "0.0")]
    clean = [row for row in flat if row["named"] == row["gait"] and row["clean"] == "True"]
    differ = {key[1:]: _difference(rows, key[1:]) for key in rows if key[0] == "pybullet"}
    noise = [row for row in second if row["terrain"] == "perlin:0.10"]
    shifts = _rows(SHIFTS)
    there = [row for row in shifts if row["simulator"] == "pybullet" and _is_there_and_back(row)]
    answer = (
        f"{len(clean)} of {len(flat)} gaits have their own name on flat ground and are clean, with "
        f"a speed within {_worst(differ, 'flat'):.2f} m/s of that in MuJoCo; on noise of 0.10 m "
        f"{_least(noise):.2f} or more of each gait's robots stay up. The default condition shifts "
        f"there and back in {len(there)} of {CROSSINGS} crossings without a fall."
    )
    return answer, "\n".join((_gait_table(rows), _shift_table(shifts)))


def _gait_table(rows: dict[tuple[str, ...], dict[str, str]]) -> str:
    head = ("gait", "ground", "push [N]", "verdict", "survival", "speed [m/s]", "CoT", "pattern")
    lines: list[tuple[str, ...]] = []
    for terrain, push in (*GROUNDS, *FURTHER):
        for gait in (*FIRST_GAITS, *(g for g in policy.shipped() if g not in FIRST_GAITS)):
            pair = [rows.get((name, gait, terrain, str(push))) for name in SIMULATORS]
            if None in pair:
                continue
            cells = [gait, terrain, f"{push:g}"]
            cells += [" / ".join(_verdict(row) for row in pair if row)]
            for figure in ("survival", "speed_mean", "cost_of_transport", "pattern_fraction"):
                cells.append(" / ".join(_two(row[figure]) for row in pair if row))
            lines.append(tuple(cells))
    note = "Each cell: MuJoCo / PyBullet. *CoT*: mechanical cost of transport.\n"
    return f"{note}\n{table.markdown(head, lines)}\n"


def _shift_table(rows: list[dict[str, str]]) -> str:
    head = ("simulator", "there and back, no fall", "detection, mean [m]", "least", "most")
    lines: list[tuple[str, ...]] = []
    for name in SIMULATORS:
        own = [row for row in rows if row["simulator"] == name]
        ways = [float(row["at"].split()[0]) - NOISE_AT for row in own if row["at"]]
        if ways:
            count = sum(map(_is_there_and_back, own))
            way = (f"{value:.2f}" for value in (mean(ways), min(ways), max(ways)))
            lines.append((name, f"{count} of {len(own)}", *way))
    return f"{table.markdown(head, lines)}\n"


def _is_there_and_back(row: dict[str, str]) -> bool:
    return row["finished"] == "True" and row["gaits"] == "trot bound trot"


def _difference(rows: dict[tuple[str, ...], dict[str, str]], key: tuple[str, ...]) -> float:
    """Of the mean speeds in the two simulators [m/s]; 0 where one is missing."""
    speeds = [rows[(name, *key)]["speed_mean"] for name in SIMULATORS if (name, *key) in rows]
    return abs(float(speeds[0]) - float(speeds[1])) if len(speeds) == 2 and all(speeds) else 0.0


def _worst(differences: dict[tuple[str, ...], float], terrain: str) -> float:
    return max(value for key, value in differences.items() if key[1:] == (terrain, "0.0"))


def _least(rows: list[dict[str, str]]) -> float:
    return min((float(row["survival"]) for row in rows), default=float("nan"))


def _verdict(row: dict[str, str]) -> str:
    return f"{row['named']}{', clean' if row['clean'] == 'True' else ', not clean'}"


def _two(value: str) -> str:
    return f"{float(value):.2f}" if value else "–"


def _rows(path: Path) -> list[dict[str, str]]:
    return table.read(path, may_be_cut=True) if path.exists() else []


def _run(one: Walk | Crossings) -> list[dict[str, Any]]:
    return one.run()


def main() -> None:
    """Runs what is missing, and writes the page."""
    if sys.argv[1:] != ["--page"]:
        with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
            waiting = {pool.submit(_run, one): one for one in runs()}
            for done in as_completed(waiting):
                target = SHIFTS if isinstance(waiting[done], Crossings) else GAITS
                for row in done.result():
                    table.append(target, row)
                print(waiting[done], flush=True)
    answer, tables = results()
    text = TEXT.format(
        answer=answer, robots=ROBOTS, seconds=SECONDS, crossings=CROSSINGS, results=tables
    )
    PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
