"""The page about shifts: README.md beside the table and its maps."""

from collections.abc import Sequence

from gaitshift.lab.table import Row

_INTRODUCTION = """# Gait shifts at a random phase

Policy and reward machine are swapped at a random phase of the old gait's stride. A shift succeeds
if the robot does not fall within 5 s and, from some stride on, the contacts match the new gait in
at least half of the steps of every stride. Settle time ends with the first such stride. Dip is the
largest drop of the mean speed of a stride below the slower of the two commands. Intervals are 95 %
Wilson intervals."""

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


def page(rows: Sequence[Row], command: str) -> str:
    """The whole page; `command` made the last of the rows."""
    parts = [_INTRODUCTION, f"Made by `{command}`. The same as an [interactive page](page.html)."]
    for ground in dict.fromkeys(row["ground"] for row in rows):
        of = [row for row in rows if row["ground"] == ground]
        total, good = (sum(row[name] for row in of) for name in ("switches", "successes"))
        lines = [HEAD, ("---",) * len(HEAD), *(row_cells(row) for row in of)]
        parts += [
            f"## {ground}",
            f"{good} of {total} shifts succeeded.",
            f"![Failed shifts on {ground}]({picture_of(ground)})",
            "\n".join(f"| {' | '.join(line)} |" for line in lines),
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
