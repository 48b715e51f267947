"""Writes docs/results/gaits.md: the figures and trials of every shipped policy, from its record.

Usage: python tools/gait_results.py     (`tools/ship_policy.py` calls it at its end)
"""

import csv
import json
from collections import Counter
from pathlib import Path
from typing import Any

from gaitshift.control import policy
from gaitshift.gait import gaits
from gaitshift.lab.evaluation import SIZES
from gaitshift.lab.gait_analysis import FIRST_GAITS
from gaitshift.robot.legs import LEGS
from gaitshift.table import markdown

POLICIES = Path(policy.__file__).parent / "policies"
PAGE = Path(__file__).parent.parent / "docs" / "results" / "gaits.md"

EVERY = 10
"""Iterations between two rows of a shipped curve."""

GROUND_FIGURES = ("survival", "distance_share", "lateral_error_p95")
"""Figures that a trial gives of its ground, in the order of their rows."""

HEAD = """# Are the shipped gaits what their names say, and clean?

{clean} of {count} shipped policies walk in the gait of their name, judged by their contacts alone,
and are clean.

The figures are those of {episodes} robots on flat ground for {seconds:g} s, without exploration,
at the nominal speed and frequency of the gait; the first 2 s are left out.
`gaitshift.lab.gait_analysis` defines the figures. This page is made by `tools/gait_results.py`
from the records beside the policies.

- *Clean*: the contacts are those of the gait, and every limit is kept. Trot, pace and bound have
  stricter limits than the other gaits (`src/gaitshift/lab/gait_analysis/verdict.py`). The other
  gaits have no limits on noise of 0.15 m and more, slopes, stairs and steps
  (`src/gaitshift/lab/evaluation/trials.py`).
- *Cycles*: cycles of the machine per second.
- *Pattern*: the share of control steps whose contacts are a stance of the gait.
- *Touchdowns*: touchdowns of a foot per touchdown of the machine's cycle; 1 without chatter.
- *Cost of transport*: mean Σ|τ q̇| / (m g v), mechanical.
"""

TRAINING = """## Training

The policies come from two recipes and two seeds. The record beside each policy names its recipe
and seed, and `make policies` trains by these records ([both recipes](training-recipe.md)).
"""

TRIALS = """## Trials

{pushed} robots walk with pushes on flat ground, and {episodes} on each other ground. *Distance
share* is the distance covered, as a share of the commanded distance. *Lateral error* is the 95th
percentile over the robots. A value that misses its limit is in bold. [Stairs and steps](edges.md)
have a page of their own.
"""

COMMANDS = """## Commands

Each entry is a command → the measured value on flat ground (`gaitshift evaluate GAIT --commands`).
Speeds are tried at the gait's nominal stride frequency, and frequencies at its nominal speed.
"""


def page() -> str:
    """The whole page."""
    names = [*FIRST_GAITS, *(name for name in policy.shipped() if name not in FIRST_GAITS)]
    records = {
        name: json.loads((POLICIES / f"{name}.json").read_text(encoding="utf-8")) for name in names
    }
    size = SIZES["all"]
    head = HEAD.format(
        clean=sum(_is_clean(name, record) for name, record in records.items()),
        count=len(records),
        episodes=size.episodes,
        seconds=size.seconds,
    )
    parts = [head, _figures(records)]
    parts += [TRAINING, _training(records)]
    parts += [TRIALS.format(pushed=size.pushed, episodes=size.episodes), _trials(records)]
    parts += [COMMANDS, _commands(records)]
    parts += [_gait(name, record) for name, record in records.items()]
    return "\n".join(parts)


def _is_clean(name: str, record: dict[str, Any]) -> bool:
    verdict = record["evaluation"]["flat"]["verdict"]
    return verdict["gait"] == name and verdict["clean"]


def _training(records: dict[str, Any]) -> str:
    """One row a gait: its seed, and the iterations of each stage by its curve."""
    rows = []
    for name, record in records.items():
        with (POLICIES / f"{name}.csv").open(newline="", encoding="utf-8") as file:
            counts = Counter(row["stage"] for row in csv.DictReader(file))
        stages = ", ".join(f"{stage} {EVERY * count}" for stage, count in counts.items())
        rows.append((name, str(record["seed"]), str(record["iterations"]), stages))
    return _table(("gait", "seed", "iterations", "stages"), rows)


def _figures(records: dict[str, Any]) -> str:
    rows = []
    for name, record in records.items():
        flat = record["evaluation"]["flat"]
        verdict = flat["verdict"]
        rows.append(
            (
                name,
                f"{verdict['gait']}, {'clean' if verdict['clean'] else 'not clean'}",
                f"{flat['speed_mean']:.2f}",
                f"{flat['cycles_per_s']:.2f}",
                f"{flat['pattern_fraction']:.2f}",
                _feet(flat["touchdowns_per_cycle"]),
                _feet(flat["phase"]),
                f"{min(flat['phase_consistency']):.2f}",
                _feet(flat["duty_factor"]),
                f"{100 * min(flat['clearance']):.0f}",
                f"{flat['cost_of_transport']:.2f}",
            )
        )
    legs = " ".join(LEGS)
    head = (
        "gait",
        "named as",
        "speed [m/s]",
        "cycles [Hz]",
        "pattern",
        f"touchdowns a cycle, {legs}",
        f"phase, {legs}",
        "least consistency",
        f"duty factor, {legs}",
        "least clearance [cm]",
        "cost of transport",
    )
    return _table(head, rows)


def _trials(records: dict[str, Any]) -> str:
    """One row a trial on its ground, one column a gait; in bold what misses its limit."""
    trials = {
        name: {row["trial"]: row for row in record["evaluation"]["trials"] if _is_ground(row)}
        for name, record in records.items()
    }
    titles = list(dict.fromkeys(title for rows in trials.values() for title in rows))
    titles.sort(key=lambda title: GROUND_FIGURES.index(title.split()[0]))
    body = [(title, *(_value(rows.get(title)) for rows in trials.values())) for title in titles]
    return _table(("trial", *trials), body)


def _commands(records: dict[str, Any]) -> str:
    """One row per gait: commands and measured values."""
    rows = []
    for name, record in records.items():
        asked = record["evaluation"]["commands"]
        speeds, frequencies = asked[: len(asked) // 2], asked[len(asked) // 2 :]
        pairs = (
            ", ".join(f"{row[command]:.2f} → {row[figure]:.2f}" for row in part)
            for part, command, figure in (
                (speeds, "forward_speed", "speed_mean"),
                (frequencies, "stride_frequency", "cycles_per_s"),
            )
        )
        rows.append((name, *pairs, f"{min(row['survival'] for row in asked):.2f}"))
    return _table(("gait", "speed [m/s]", "cycles [Hz]", "least survival"), rows)


def _is_ground(row: dict[str, Any]) -> bool:
    return row["trial"].split()[0] in GROUND_FIGURES


def _gait(name: str, record: dict[str, Any]) -> str:
    machine = gaits.load(name)
    misses = [
        f"{row['trial']}: {_plain(row['value'])}, limit {_limit(row)}"
        for row in record["evaluation"]["trials"]
        if row["passed"] is False
    ]
    lines = [f"## {machine.title}\n", f"{machine.description}\n"]
    lines.append(f"![Gait diagram and phases of {name}](gaits/{name}.png)\n")
    recipe = f", preset `{record['preset']}`"
    made, judged = record["command"], record["evaluation"]["command"]
    lines.append(f"Made by `{made}`{recipe}, judged by `{judged}`.")
    lines.append(f"[Its training](training/{name}.png).\n")
    lines += (
        ["Limits missed:\n", *(f"- {miss}" for miss in misses), ""]
        if misses
        else ["All limits are kept.\n"]
    )
    return "\n".join(lines)


def _value(row: dict[str, Any] | None) -> str:
    if row is None:
        return ""
    text = _plain(row["value"])
    return f"**{text}**" if row["passed"] is False else text


def _plain(value: float | None) -> str:
    return "never arrived" if value is None else f"{value:.3f}"


def _limit(row: dict[str, Any]) -> float:
    return row["at_least"] if "at_least" in row else row["at_most"]


def _feet(values: list[float]) -> str:
    return " ".join(f"{value:.2f}" for value in values)


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    return markdown(head, rows) + "\n"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(f"written: {PAGE}")
