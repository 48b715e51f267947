"""The table and the page of crossings: a row an amplitude and way."""

from collections.abc import Sequence
from math import sqrt

import numpy as np
from jaxtyping import Float

from gaitshift.lab.identification import wilson
from gaitshift.lab.studies.crossing import AFTER, BEFORE, NOISE, PATIENCE, Crossings, Strategy
from gaitshift.table import Row, markdown

COLUMNS: dict[str, type] = {
    "amplitude": float,
    "way": str,
    "seed": int,
    "runs": int,
    "survived": int,
    "low": float,
    "high": float,
    "arrived": int,
    "distance_m": float,
    "distance_half": float,
    "speed_m_s": float,
    "speed_half": float,
    "cost_of_transport": float,
    "cost_half": float,
    "shifts": float,
    "chattered": int,
}
"""`low` and `high` bound Wilson's interval of the share that survived; `…_half` is half the width
of the interval of a mean (95 % both)."""

PICTURE = "crossings.png"

ENOUGH = 2
"""Shifts needed for one stretch of noise; more are chatter."""


def row_of(way: Strategy, amplitude: float, seed: int, crossings: Crossings) -> Row:
    """The row of the crossings of one strategy."""
    n, fell = len(crossings.fell), int(crossings.fell.sum())
    low, high = wilson(np.array([float(n - fell)]), np.array([float(n)]))
    cost = crossings.cost_of_transport
    means = {
        "distance_m": (crossings.distance, "distance_half"),
        "speed_m_s": (crossings.speed, "speed_half"),
        "cost_of_transport": (cost[~np.isnan(cost)], "cost_half"),
    }
    row: Row = {
        "amplitude": amplitude,
        "way": way.name,
        "seed": seed,
        "runs": n,
        "survived": n - fell,
        "low": round(float(low[0]), 5),
        "high": round(float(high[0]), 5),
        "arrived": int(crossings.arrived.sum()),
        "shifts": round(float(crossings.shifts.mean()), 2),
        "chattered": int((crossings.shifts > ENOUGH).sum()),
    }
    for name, (values, half) in means.items():
        row[name], row[half] = mean_of(values)
    return {name: row[name] for name in COLUMNS}


def mean_of(values: Float[np.ndarray, " K"]) -> tuple[float | str, float | str]:
    """Mean, and half the width of its interval (95 %, normal); empty texts where too few."""
    if len(values) < 2:
        return "", ""
    half = 1.96 * float(values.std(ddof=1)) / sqrt(len(values))
    return round(float(values.mean()), 4), round(half, 4)


def page(rows: Sequence[Row], command: str) -> str:
    """The whole page; `command` computed the last rows."""
    head = (
        "way",
        "survived",
        "interval",
        "arrived",
        "distance [m]",
        "speed [m/s]",
        "CoT",
        "shifts",
        "chattered",
    )
    parts = [
        "# Does the shift help on rough ground?",
        "The tables compare two gaits and the shifts between them on noise of each amplitude. "
        f"Robots cross {BEFORE:g} m of level ground, {NOISE:g} m of Perlin noise of one amplitude "
        f"and {AFTER:g} m of level ground: in one gait, in the other, with shifts by a condition, "
        "or with shifts by an oracle that knows where the noise is. Fields and starts are the same "
        "for all. Survived: no fall before the finish. Arrived: at the finish within "
        f"{PATIENCE:g} times the time at the commanded speed. Distance and speed are means over "
        "all robots, up to the fall of those that fell; CoT is over robots that walked at least "
        f"1 m. Chattered: more than {ENOUGH} shifts (one there and one back). Intervals are 95 %, "
        "Wilson intervals for shares.",
        f"Made by `{command}`.",
        f"![Survival, distance, speed and cost of transport over the amplitude]({PICTURE})",
    ]
    for amplitude in dict.fromkeys(row["amplitude"] for row in rows):
        of = [row for row in rows if row["amplitude"] == amplitude]
        parts += [
            f"## {amplitude:g} m",
            markdown(head, [_cells(row) for row in of]),
        ]
    return "\n\n".join(parts) + "\n"


def _cells(row: Row) -> tuple[str, ...]:
    def mean(name: str, half: str) -> str:
        return f"{row[name]:.2f} ± {row[half]:.2f}" if row[name] != "" else "–"

    return (
        row["way"],
        f"{row['survived']} of {row['runs']}",
        f"{row['low']:.3f} to {row['high']:.3f}",
        str(row["arrived"]),
        mean("distance_m", "distance_half"),
        mean("speed_m_s", "speed_half"),
        mean("cost_of_transport", "cost_half"),
        f"{row['shifts']:.1f}",
        str(row["chattered"]),
    )
