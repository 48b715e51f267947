"""The table of shifts: a row a pair and ground, kept as it grows."""

import csv
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gaitshift.errors import GaitshiftError
from gaitshift.identification import wilson
from gaitshift.studies.transitions import Outcomes, Pair

Row = dict[str, Any]

PHASES = 10
"""Parts that the stride is cut into."""

COLUMNS: tuple[str, ...] = (
    "old",
    "new",
    "ground",
    "seed",
    "switches",
    "successes",
    "low",
    "high",
    "fell",
    "settle_s",
    "settle_s_p95",
    "dip_m_s",
    "tilt_deg_p95",
    "worst_phase",
    "worst_phase_success",
)
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


def read_rows(path: Path) -> list[Row]:
    """The rows of an earlier, perhaps unfinished, table; none where there is no file.

    Raises:
        GaitshiftError: it is no such table.
    """
    if not path.is_file():
        return []
    with path.open(newline="") as file:
        reader = csv.DictReader(file)
        rows = list(reader)
    if tuple(reader.fieldnames or ()) != COLUMNS or any(None in row.values() for row in rows):
        raise GaitshiftError(f"{path} is no table of shifts; give another --out, or --overwrite")
    whole = ("seed", "switches", "successes", "fell")
    real = ("low", "high", "settle_s", "settle_s_p95", "dip_m_s", "tilt_deg_p95")
    real += ("worst_phase_success",)
    try:
        return [
            row
            | {name: int(row[name]) for name in whole}
            | {name: float(row[name]) if row[name] else "" for name in real}
            for row in rows
        ]
    except ValueError as error:
        raise GaitshiftError(f"{path}: {error}") from error


def write_rows(rows: Sequence[Row], path: Path) -> None:
    """Writes the table, whole or not at all."""
    part = path.with_suffix(".part")
    with part.open("w", newline="") as file:
        lines = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        lines.writeheader()
        lines.writerows(rows)
    part.replace(path)


def is_of(row: Row, pair: Pair, ground: str, seed: int, switches: int) -> bool:
    """Whether a row holds these very shifts."""
    wanted = (pair.old, pair.new, ground, seed, switches)
    return tuple(row[name] for name in ("old", "new", "ground", "seed", "switches")) == wanted
