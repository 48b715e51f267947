"""The table and the page of shifts: a row a pair and ground."""

from collections.abc import Sequence

import numpy as np

from gaitshift.lab.identification import wilson
from gaitshift.lab.studies.transitions import Outcomes, Pair
from gaitshift.table import Row, markdown

PHASES = 10
"""Number of parts of the stride."""

COLUMNS: dict[str, type] = {
    "old": str,
    "new": str,
    "ground": str,
    "seed": int,
    "switches": int,
    "successes": int,
    "low": float,
    "high": float,
    "fell": int,
    "settle_s": float,
    "settle_s_p95": float,
    "dip_m_s": float,
    "tilt_deg_p95": float,
    "worst_phase": str,
    "worst_phase_success": float,
}
"""Columns of the CSV file; `low` and `high` bound the 95 % interval of the success rate."""

_INTRODUCTION = """# Gait shifts at a random phase

The tables show how often a shift from each gait to each other gait succeeds on each ground. Policy
and reward machine are swapped at a random phase of the old gait's stride. A shift succeeds if the
robot does not fall within 5 s and, from some stride on, the contacts match the new gait in at least
half of the steps of every stride. Settle time ends with the first such stride. Dip is the largest
drop of the mean speed of a stride below the slower of the two commands. Intervals are 95 % Wilson
intervals."""

HEAD = (
    "from",
    "to",
    "succeeded",
    "interval",
    "fell",
    "settled, 95 % within [s]",
    "dip [m/s]",
    "tilt, 95 % within [°]",
    "worst phase",
)
"""Above the cells of `row_cells`."""


def row_of(pair: Pair, ground: str, seed: int, outcomes: Outcomes) -> Row:
    """The row of the shifts of a pair."""
    n, good = len(outcomes.success), int(outcomes.success.sum())
    low, high = wilson(np.array([float(good)]), np.array([float(n)]))
    settled = outcomes.settle[outcomes.success]
    parts = np.minimum((outcomes.phase * PHASES).astype(int), PHASES - 1)
    shares = [
        float(outcomes.success[parts == part].mean()) if (parts == part).any() else 1.0
        for part in range(PHASES)
    ]
    worst = int(np.argmin(shares))
    return {
        "old": pair.old,
        "new": pair.new,
        "ground": ground,
        "seed": seed,
        "switches": n,
        "successes": good,
        "low": round(float(low[0]), 5),
        "high": round(float(high[0]), 5),
        "fell": int(outcomes.fell.sum()),
        "settle_s": round(float(np.median(settled)), 2) if good else "",
        "settle_s_p95": round(float(np.quantile(settled, 0.95)), 2) if good else "",
        "dip_m_s": round(float(outcomes.dip.mean()), 3),
        "tilt_deg_p95": round(float(np.degrees(np.quantile(outcomes.tilt, 0.95))), 1),
        "worst_phase": f"{worst / PHASES:g} to {(worst + 1) / PHASES:g}",
        "worst_phase_success": round(shares[worst], 4),
    }


def page(rows: Sequence[Row], command: str) -> str:
    """The whole page; `command` computed the last rows."""
    parts = [_INTRODUCTION, f"Made by `{command}`. The same as an [interactive page](page.html)."]
    for ground in dict.fromkeys(row["ground"] for row in rows):
        of = [row for row in rows if row["ground"] == ground]
        total, good = (sum(row[name] for row in of) for name in ("switches", "successes"))
        parts += [
            f"## {ground}",
            f"{good} of {total} shifts succeeded.",
            f"![Failed shifts on {ground}]({picture_of(ground)})",
            markdown(HEAD, [row_cells(row) for row in of]),
        ]
    return "\n\n".join(parts) + "\n"


def picture_of(ground: str) -> str:
    """File name of the map of a ground."""
    return f"{ground.replace(':', '-')}.png"


def row_cells(row: Row) -> tuple[str, ...]:
    """A row of the table of shifts as text."""
    return (
        row["old"],
        row["new"],
        f"{row['successes']} of {row['switches']}",
        f"{row['low']:.4f} to {row['high']:.4f}",
        str(row["fell"]),
        str(row["settle_s_p95"]),
        f"{row['dip_m_s']:.2f}",
        f"{row['tilt_deg_p95']:.0f}",
        f"{row['worst_phase']}: {row['worst_phase_success']:.3f}",
    )
