"""Walks the shipped policies in MuJoCo and PyBullet, and writes docs/results/second-simulator.md.

Usage: python tools/second_simulator.py [--page]

Needs the extra `sim2sim`. Takes about ten minutes on two idle cores. Each outcome is a row of
second_simulator_gaits.csv or second_simulator_shifts.csv beside the page, and runs that have a row
there are not repeated. `--page` runs nothing and writes the page from these rows.
"""

import os
import sys
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from itertools import product
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

GROUNDS = ("flat", "perlin:0.10")
SPEED, STAY = 0.05, 0.95
"""Largest difference of the speeds [m/s], and least survival on noise, of the hypothesis."""

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

{verdicts}

**Metrics**: those of [the gaits](gaits.md). Survival is the share of robots that do not fall.
*Detection* is the way of the base from the beginning of the noise to the first shift.
**N**: {robots} robots × {seconds:g} s for each gait, ground and simulator (seed 0; the first 2 s
are left out), on eight fields where the ground is random; {crossings} crossings in each simulator,
each on a field of its own, the same in both.

With 8 robots the limits of a clean gait are met or missed by chance where a gait is near them, as
pace and three-one are with their touchdowns; with 256 robots all eight are clean in MuJoCo.

{results}
What slows `three_one` and `gallop` in PyBullet is one robot of the eight that does not walk: of
`three_one` it stands on four feet in state 0 of the machine and never steps. The other seven walk
at the speed that they have in MuJoCo, where 1 of 32 and 0 of 128 robots of `three_one` stood in a
pilot.

This page is made by `python tools/second_simulator.py`. One gait alone: `gaitshift evaluate trot
--simulator pybullet --episodes 8`.
"""


@dataclass(frozen=True, kw_only=True)
class Walk:
    """One evaluation of a gait."""

    simulator: str
    gait: str
    terrain: str

    def run(self) -> list[dict[str, Any]]:
        """Its row."""
        config = EvaluationConfig(
            terrain=self.terrain, episodes=ROBOTS, seconds=SECONDS, simulator=self.simulator
        )
        figures, _ = evaluate(policy.load(self.gait), config)
        verdict = figures["verdict"]
        names = ("survival", "speed_mean", "cost_of_transport", "pattern_fraction")
        row = {"simulator": self.simulator, "gait": self.gait, "terrain": self.terrain}
        row |= {"named": verdict["gait"], "clean": verdict["clean"]}
        row |= {name: "" if figures[name] is None else f"{figures[name]:.4f}" for name in names}
        misses = (f"{miss['figure']} {miss['value']:.3g}" for miss in verdict["misses"])
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
    done = {(row["simulator"], row["gait"], row["terrain"]) for row in _rows(GAITS)}
    for terrain, gait, name in product(GROUNDS, policy.shipped(), SIMULATORS):
        if (name, gait, terrain) not in done:
            yield Walk(simulator=name, gait=gait, terrain=terrain)


def page() -> str:
    """The whole page; without an answer before all runs are done."""
    texts = {"answer": "The runs are not done yet.", "verdicts": "", "results": ""}
    if not any(runs()):
        pairs = {
            (gait, terrain): [
                next(r for r in _rows(GAITS) if _key(r) == (name, gait, terrain))
                for name in SIMULATORS
            ]
            for terrain, gait in product(GROUNDS, _gaits())
        }
        texts["answer"], texts["verdicts"] = _verdicts(pairs)
        texts["results"] = f"{_gait_table(pairs)}\n\n{_shift_table()}\n"
    return TEXT.format(robots=ROBOTS, seconds=SECONDS, crossings=CROSSINGS, **texts)


Pairs = dict[tuple[str, str], list[dict[str, str]]]
"""The row in MuJoCo and that in PyBullet, by gait and ground."""


def _verdicts(pairs: Pairs) -> tuple[str, str]:
    """The answer in one paragraph, and what holds of each hypothesis."""
    flat, noise = ({g: pairs[g, ground] for g in _gaits()} for ground in GROUNDS)
    clean = [gait for gait, (_, row) in flat.items() if _is_clean(row, gait)]
    upright = [gait for gait, (_, row) in flat.items() if float(row["survival"]) == 1.0]
    stay = [gait for gait, (_, row) in noise.items() if float(row["survival"]) >= STAY]
    slow, slow_on_noise = (_off(rows) for rows in (flat, noise))
    ways = {name: _ways(name) for name in SIMULATORS}
    there = sum(_is_there_and_back(r) for r in _rows(SHIFTS) if r["simulator"] == "pybullet")
    later = mean(ways["pybullet"]) - mean(ways["mujoco"])
    count = len(flat)
    answer = (
        f"Yes: in PyBullet {len(clean)} of {count} gaits have their own name on flat ground and "
        f"are clean, and {count - len(slow)} of {count} keep the speed that they have in MuJoCo. "
        f"The default condition shifts there and back in {there} of {CROSSINGS} crossings."
    )
    verdicts = (
        f"1. {len(clean)} of {count} are clean and {len(upright)} of {count} never fall; "
        f"{_speeds(slow)}.",
        f"2. {len(stay)} of {count} stay up; {_speeds(slow_on_noise)}.",
        f"3. {there} of {CROSSINGS}; detection is {later:+.2f} m from that in MuJoCo.",
    )
    return answer, "**What holds**:\n\n" + "\n".join(verdicts)


def _off(rows: dict[str, list[dict[str, str]]]) -> list[str]:
    """Gaits whose speed differs by more than `SPEED`, with their speeds in both."""
    return [
        f"{gait} {first['speed_mean']} → {second['speed_mean']} m/s"
        for gait, (first, second) in rows.items()
        if not abs(float(first["speed_mean"]) - float(second["speed_mean"])) <= SPEED
    ]


def _speeds(off: list[str]) -> str:
    return f"the speed differs by more in {', '.join(off)}" if off else "all keep the speed"


def _gait_table(pairs: Pairs) -> str:
    head = ("gait", "ground", "verdict", "survival", "speed [m/s]", "CoT", "pattern")
    figures = ("survival", "speed_mean", "cost_of_transport", "pattern_fraction")
    lines: list[tuple[str, ...]] = []
    for (gait, terrain), rows in pairs.items():
        verdicts = " / ".join(map(_verdict, rows))
        lines.append((gait, terrain, verdicts, *(_pair(rows, figure) for figure in figures)))
    note = "Each cell: MuJoCo / PyBullet. *CoT* is the mechanical cost of transport."
    return f"{note}\n\n{table.markdown(head, lines)}"


def _pair(rows: list[dict[str, str]], figure: str) -> str:
    return " / ".join(f"{float(row[figure]):.2f}" for row in rows)


def _shift_table() -> str:
    head = ("simulator", "there and back, no fall", "detection, mean [m]", "least", "most")
    lines: list[tuple[str, ...]] = []
    for name in SIMULATORS:
        own = [row for row in _rows(SHIFTS) if row["simulator"] == name]
        ways = _ways(name)
        way = (f"{value:.2f}" for value in (mean(ways), min(ways), max(ways)))
        lines.append((name, f"{sum(map(_is_there_and_back, own))} of {len(own)}", *way))
    return table.markdown(head, lines)


def _ways(simulator: str) -> list[float]:
    """From the beginning of the noise to the first shift [m], of the crossings that shift."""
    own = (row for row in _rows(SHIFTS) if row["simulator"] == simulator and row["at"])
    return [float(row["at"].split()[0]) - NOISE_AT for row in own]


def _is_there_and_back(row: dict[str, str]) -> bool:
    return row["finished"] == "True" and row["gaits"] == "trot bound trot"


def _gaits() -> tuple[str, ...]:
    return (*FIRST_GAITS, *(gait for gait in policy.shipped() if gait not in FIRST_GAITS))


def _key(row: dict[str, str]) -> tuple[str, ...]:
    return row["simulator"], row["gait"], row["terrain"]


def _is_clean(row: dict[str, str], gait: str) -> bool:
    return row["named"] == gait and row["clean"] == "True"


def _verdict(row: dict[str, str]) -> str:
    return f"{row['named']}, {'clean' if row['clean'] == 'True' else 'not clean'}"


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
    PAGE.write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main()
