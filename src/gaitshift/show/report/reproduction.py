"""The report of a reproduction: README.md, figures and small CSV in one folder."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from gaitshift.errors import GaitshiftError
from gaitshift.lab.reproduction.findings import Finding, findings
from gaitshift.lab.reproduction.judging import (
    ABLATED_RUNS,
    JudgedPolicy,
    ablation_rows,
    curve_rows,
    gait_rows,
    judge,
    run_rows,
)
from gaitshift.lab.reproduction.learning_curve import HELD_FOR, WALKING_CHANGES, WALKING_SPEED
from gaitshift.lab.reproduction.plan import LOCKOUT
from gaitshift.lab.reproduction.results import (
    CURVES_FILE,
    GAITS_FILE,
    RUNS_FILE,
    EarlierRuns,
    Results,
)
from gaitshift.show.plots import reproduction as figures
from gaitshift.table import Row, markdown, write
from gaitshift.whole_file import write_text

README = "README.md"

_ALT = {
    figures.REWARDS: "Reward over the iterations, by gait, with the values of the paper",
    figures.COMPARISONS: "Forward speed over the iterations, by setting",
}


def write_report(
    results: Results,
    runs: Path,
    out: Path,
    earlier: EarlierRuns | None = None,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> dict[str, Any]:
    """Writes the report of the finished runs into `out`; returns the same as plain data.

    Args:
        results: the finished runs.
        runs: their folders.
        out: the folder of the report.
        earlier: runs in the tables of an earlier report, whose folders may be gone.
        report: called with the policies judged and those in all.
    """
    if not results.seeds:
        raise GaitshiftError(f"{runs} must hold at least one finished run, got none")
    out.mkdir(parents=True, exist_ok=True)
    judged = judge(results, runs, earlier or EarlierRuns(), report)
    found = findings(results)
    gaits, ablations = gait_rows(judged), ablation_rows(results)
    parts = {
        RUNS_FILE: run_rows(results),
        GAITS_FILE: gaits,
        ABLATED_RUNS: ablations,
        CURVES_FILE: list(curve_rows(results)),
    }
    written = [name for name, rows in parts.items() if rows]
    for name in written:
        write(out / name, parts[name])
    written += figures.draw(results, judged, out)
    write_text(out / README, _readme(results, found, judged, ablations, written))
    return {
        "out": str(out),
        "files": [README, *written],
        "findings": [asdict(finding) for finding in found],
        "gaits": gaits,
        "ablations": ablations,
    }


def _readme(
    results: Results,
    found: list[Finding],
    judged: list[JudgedPolicy],
    ablations: list[Row],
    written: list[str],
) -> str:
    parts = ["# Which statements of the paper hold?", *_answer(found), _introduction(results)]
    if found:
        parts += ["## Verdicts", _verdicts(found)]
        parts += [
            f"**{f.name[0].upper()}{f.name[1:]}.** *The paper:* {f.paper} *Measured:* {f.measured} "
            f"**It {f.verdict}.**"
            for f in found
        ]
    if judged:
        parts += ["## The gaits", _gait_table(judged)]
    parts += [
        f"![{_ALT.get(name, 'Contacts of the feet over two seconds')}]({name})"
        for name in written
        if name.endswith(".png") and name != figures.COMPARISONS
    ]
    if len(ablations) > 1:
        parts += ["## Ablations", _ablation_table(ablations)]
    if figures.COMPARISONS in written:
        parts.append(f"![{_ALT[figures.COMPARISONS]}]({figures.COMPARISONS})")
    return "\n\n".join(parts) + "\n"


def _answer(found: list[Finding]) -> list[str]:
    """How many statements hold, in one sentence; no sentence where none is tested."""
    if not found:
        return []
    verdicts = [finding.verdict for finding in found]
    return [
        f"Of {len(found)} statements {verdicts.count('holds')} hold, "
        f"{verdicts.count('holds in part')} hold in part, and "
        f"{verdicts.count('does not hold')} do not hold."
    ]


def _introduction(results: Results) -> str:
    plan = results.plan
    recipe = plan.jobs[0].recipe
    runs = sum(map(len, results.seeds.values()))
    return "\n".join(
        (
            "This page compares each statement of the paper with our runs, and says whether it "
            f"holds. Written by `gaitshift reproduce` from {runs} of {len(plan.jobs)} runs; all "
            "numbers and verdicts are computed from them.",
            f"Each run has {recipe.robots} robots × {recipe.steps} steps × {recipe.iterations} "
            "iterations on flat ground at 100 Hz, with the rewards of Table I, b = 200, and the "
            f"network and PPO settings of the paper; there are {plan.seeds} seeds for each gait.",
            "Three settings depart from the paper: gains of 80/2, because Kp = 3 cannot hold this "
            f"robot up (see the ablation); a lock-out of {LOCKOUT} steps between changes of the "
            "machine's state, as the published plateau implies; and a bonus that is added to the "
            "reward.",
            f"Each ablation changes one setting of trot, over {plan.ablation_seeds} seeds and "
            f"{plan.ablation_iterations} iterations, against the same of the reference.",
            f"A run *walks* from the first of {HELD_FOR} successive iterations with a mean speed "
            f"above {WALKING_SPEED:g} m/s and more than {WALKING_CHANGES:g} changes of the "
            "machine's state per second. *At the end* is the last tenth of the iterations. "
            "Training figures include exploration noise. Curves dip every "
            f"{recipe.checkpoint_every} iterations, as all robots start again at a checkpoint.",
        )
    )


def _verdicts(found: list[Finding]) -> str:
    return markdown(("statement", "verdict"), [(f.name, f"**{f.verdict}**") for f in found])


def _gait_table(judged: list[JudgedPolicy]) -> str:
    head = (
        "gait",
        "seed",
        "walks from iteration",
        "survival",
        "speed [m/s]",
        "pattern fraction",
        "cycles [1/s]",
        "touchdowns per cycle",
        "cost of transport",
    )
    return markdown(
        head,
        [
            (
                one.gait,
                str(one.seed),
                _text(one.walks_at, "never"),
                *map(_text, one.figures.values()),
            )
            for one in judged
        ],
    )


def _ablation_table(rows: list[Row]) -> str:
    columns = {
        "group": "question",
        "label": "setting",
        "walking": "walking",
        "walk_from_iteration": "from iteration",
        "as_fast": "as fast",
        "late_speed": "speed at the end [m/s]",
        "late_survival": "survival",
        "late_changes_per_s": "changes of state [1/s]",
        "late_stance_fraction": "share of steps with the stance of the state",
    }
    shown = [{**row, "walking": f"{row['walking']} of {row['seeds']}"} for row in rows]
    return markdown(
        tuple(columns.values()),
        [tuple(_text(row[key], "never") for key in columns) for row in shown],
    )


def _text(value: str | float | None, nothing: str = "–") -> str:
    if value is None:
        return nothing
    if isinstance(value, str):
        return value
    rounded = round(value, 2)  # or 4.9999 stands as 5.00 and, read back from a table, as 5
    return f"{rounded:g}" if rounded == int(rounded) else f"{rounded:.2f}"
