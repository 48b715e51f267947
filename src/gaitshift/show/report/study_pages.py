"""The pages of studies: interactive results of `identify` and `transitions`."""

import html
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gaitshift.lab.identification.judging import Judged
from gaitshift.lab.identification.report import (
    CONDITIONS_HEAD,
    COURSES_HEAD,
    condition_cells,
    condition_rows,
    course_cells,
    course_rows,
    hardest_first,
)
from gaitshift.lab.studies.transitions import HEAD, TITLE, answer, row_cells, succeeded
from gaitshift.show.plots.identification import DETECTED, FALSE, LATEST, LINES, OTHERS, roc
from gaitshift.show.plots.style import gait_colours
from gaitshift.show.report.data import title_of
from gaitshift.show.report.figures import Axis, Category, Curve, Said, curves, heat_map
from gaitshift.show.report.page import facts_table, figure, table, write_page
from gaitshift.table import Row

_PASSAGES = {
    "rough": "rough ground against others",
    "flat": "level ground against rough ground",
}
"""Passages of the ROC curves, by the way."""

_FALSE = Category(name="false shifts", colour=FALSE)
_MISSED = Category(name="most passages missed", colour="pale")


def write_identification_page(
    judged: Sequence[Judged], path: Path, *, title: str, words: str, command: str
) -> None:
    """Writes the page of an identification: ROC curves, and a map and a table per condition.

    Args:
        judged: the conditions.
        path: the HTML file.
        title: its heading.
        words: how numbers were chosen and judged.
        command: what made it.
    """
    figures: dict[str, Mapping[str, Any]] = {}
    summary = [condition_cells(row) for row in condition_rows(judged)]
    sections = [("All conditions", table(CONDITIONS_HEAD, [(cells, None) for cells in summary]))]
    met = hardest_first(judged)
    for index, course in enumerate(met):
        figures[f"roc{index}"] = _roc(judged, course)
    folded = [_folded(course, figure(f"roc{i}"), i == 0) for i, course in enumerate(met)]
    if folded:
        sections.append((f"Passages of {_PASSAGES[judged[0].tuned.way]}", "".join(folded)))
    folded = list[str]()
    for index, one in enumerate(judged):
        inner = f"<p>{html.escape(one.tuned.candidate.note.capitalize())}.</p>"
        if one.tuned.choice.is_free is not None:  # else nothing was tried but the given numbers
            figures[f"map{index}"] = _condition_map(one)
            inner += figure(f"map{index}")
        rows = [(course_cells(row), None) for row in course_rows([one])]
        folded.append(
            _folded(_titled(summary[index]), inner + table(COURSES_HEAD, rows), index == 0)
        )
    sections += [
        ("Each condition", "".join(folded)),
        ("Settings", facts_table({"command": command})),
    ]
    write_page(path, title=title, summary=words, sections=sections, figures=figures)


def write_transition_page(rows: Sequence[Row], path: Path, *, command: str) -> None:
    """Writes the page of shifts: a map and a table per ground.

    Args:
        rows: of the table of shifts (`studies.transitions.row_of`).
        path: the HTML file.
        command: what made the last of them.
    """
    figures: dict[str, Mapping[str, Any]] = {}
    sections: list[tuple[str, str]] = []
    for index, ground in enumerate(dict.fromkeys(row["ground"] for row in rows)):
        of = [row for row in rows if row["ground"] == ground]
        figures[f"ground{index}"] = _transition_map(of)
        cells = [(row_cells(row), None) for row in of]
        count = f"<p>{succeeded(of)} shifts succeeded.</p>"
        content = count + figure(f"ground{index}") + table(HEAD, cells)
        sections.append((f"On {ground}", content))
    sections.append(("Settings", facts_table({"command": command})))
    write_page(
        path,
        title=TITLE,
        summary=f"{answer(rows)} "
        "Policy and reward machine are swapped at a random phase of the old gait's stride. "
        "A shift succeeds if the robot does not fall within 5 s and shows the new gait.",
        sections=sections,
        figures=figures,
    )


def _titled(cells: tuple[str, ...]) -> str:
    name, alpha, beta, seconds, metres, leak, detected, delay, false, *_ = cells
    numbers = f"α {alpha}, β {beta} ({seconds or '–'} s, {metres or '–'} m), leak {leak}"
    return f"{name}: {numbers}: detected {detected}, delay {delay or '–'} m; {false} false"


def _folded(title: str, inner: str, opened: bool) -> str:
    state = " open" if opened else ""
    return f"<details{state}><summary>{html.escape(title)}</summary>{inner}</details>"


def _condition_map(one: Judged) -> dict[str, Any]:
    tuned = one.tuned
    grid, tally, choice, unit = tuned.grid, tuned.tally, tuned.choice, tuned.candidate.unit
    kind = np.where(tally.fired > 0, 1, np.where(tally.missed < 0.5, 0, 2))
    return heat_map(
        title=f"Mean delay of {tuned.candidate.name} over α and β",
        x=Axis.of_numbers("β [counts]", "β", grid.betas),
        y=Axis.of_numbers(f"α [{unit}]" if unit else "α", "α", grid.alphas, unit),
        shade=tally.delay_m,
        scale=f"mean delay, 0 to {LATEST:g} m",
        span=(0.0, LATEST),
        stops=("#0b3c5d", "#4f97c4", "#dcebf5"),
        kind=kind,
        kinds=(_FALSE, _MISSED),
        says=(
            Said(name="detected", values=tally.detected, of=tally.came),
            Said(name="after", values=tally.delay_m, digits=2, unit="m"),
            Said(name="or", values=tally.delay_s, digits=2, unit="s"),
            Said(name="false shifts", values=tally.fired),
            Said(name="in", values=tally.km, digits=2, unit="km"),
        ),
        chosen=(
            int(np.searchsorted(grid.betas, choice.beta)),
            int(np.abs(grid.alphas - choice.alpha).argmin()),
        ),
    )


def _roc(judged: Sequence[Judged], course: str) -> dict[str, Any]:
    series: list[tuple[float, Curve]] = []
    for index, one in enumerate(judged):
        area = one.area(course)
        if area is not None:
            name = one.tuned.candidate.name
            x, y = roc(one.scores_on(course), one.other_scores)
            colour = LINES[index % len(LINES)]
            label = f"{name} {area[0]:.3f} at β {one.tuned.area_beta:g}"
            series.append((area[0], Curve(name=name, label=label, colour=colour, x=x, y=y)))
    series.sort(key=lambda pair: -pair[0])
    return curves(
        title=f"ROC curves on {course}",
        x=OTHERS,
        y=DETECTED,
        series=[curve for _, curve in series],
    )


def _transition_map(rows: Sequence[Row]) -> dict[str, Any]:
    """Failures by pair: new gaits across, old ones down."""
    gaits = list(dict.fromkeys(name for row in rows for name in (row["old"], row["new"])))
    colours = gait_colours(gaits)
    titles = {title_of(name): colours[name] for name in gaits}
    count = len(gaits)
    failed = np.zeros((count, count))
    kind = np.full((count, count), 2)
    cells: dict[str, list[str]] = {name: [""] * count**2 for name in HEAD[2:]}
    words = [""] * count**2
    for row in rows:
        j, i = count - 1 - gaits.index(row["old"]), gaits.index(row["new"])
        failures = row["switches"] - row["successes"]
        failed[j, i] = failures / row["switches"]
        kind[j, i] = 0 if failures else 1
        words[j * count + i] = str(failures)
        for name, cell in zip(cells, row_cells(row)[2:], strict=True):
            cells[name][j * count + i] = cell
    return heat_map(
        title=f"Failed shifts on {rows[0]['ground']}",
        x=Axis.of_names("to", dict(titles)),
        y=Axis.of_names("from", dict(reversed(titles.items()))),
        shade=np.sqrt(failed),
        scale="failed, 0 to 100 % (square-root scale)",
        span=(0.0, 1.0),
        stops=("#f7e3d6", "#d55e00", "#7a2f00"),
        kind=kind,
        kinds=(
            Category(name="none failed", colour="#cfe3d6"),
            Category(name="not tried", colour="pale"),
        ),
        says=[Said(name=name, values=values) for name, values in cells.items()],
        words=words,
    )
