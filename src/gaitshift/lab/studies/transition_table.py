"""The table of shifts: a row a pair and ground."""

import numpy as np

from gaitshift.lab.identification import wilson
from gaitshift.lab.studies.transitions import Outcomes, Pair
from gaitshift.lab.table import Row

PHASES = 10
"""Parts that the stride is cut into."""

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
"""Of the CSV file; `low` and `high` are the interval of the success rate (95 %)."""


def row_of(pair: Pair, ground: str, seed: int, outcomes: Outcomes) -> Row:
    """What came of the shifts of a pair."""
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


def is_of(row: Row, pair: Pair, ground: str) -> bool:
    """Whether a row holds the shifts of this pair on this ground."""
    return (row["old"], row["new"], row["ground"]) == (pair.old, pair.new, ground)
