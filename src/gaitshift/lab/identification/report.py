"""The report of an identification: README.md and two small tables."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from gaitshift import table
from gaitshift.lab.identification import classifier
from gaitshift.lab.identification.chatter import shipped_rule
from gaitshift.lab.identification.choice import Choice, delay_with_misses
from gaitshift.lab.identification.judging import Judged, OnCourse
from gaitshift.lab.identification.labelled_run import Way
from gaitshift.lab.identification.passage import LENGTH
from gaitshift.lab.identification.statistics import poisson, wilson
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.table import Row
from gaitshift.whole_file import write_text

README, CONDITIONS, COURSES = FILES = ("README.md", "conditions.csv", "courses.csv")

_TITLES = {
    "rough": "When is the start of rough ground detected?",
    "flat": "When is the end of rough ground detected?",
}
_BOUNDS = ("oracle", classifier.NAME)
"""Conditions for comparison only: they use more than a robot has."""


def condition_rows(judged: Sequence[Judged]) -> list[Row]:
    """One row per condition: its numbers, and the results of all courses together."""
    return [_condition_row(one) for one in judged]


def course_rows(judged: Sequence[Judged]) -> list[Row]:
    """One row per condition and course."""
    return [_course_row(one, course) for one in judged for course in one.courses]


def write_report(
    judged: Sequence[Judged],
    out: Path,
    *,
    command: str,
    held_out: bool,
    pictures: Mapping[str, str],
) -> list[Row]:
    """Writes the report into `out`; returns the rows of the conditions.

    Args:
        judged: the conditions.
        out: a folder that exists.
        command: what made it.
        held_out: whether the logs for judging differ from those for choosing.
        pictures: files in the folder, with a caption each.
    """
    conditions, courses = condition_rows(judged), course_rows(judged)
    for name, rows in ((CONDITIONS, conditions), (COURSES, courses)):
        table.write(out / name, rows)
    write_text(out / README, _readme(judged, conditions, courses, command, held_out, pictures))
    return conditions


def hardest_first(judged: Sequence[Judged]) -> list[str]:
    """Courses with ROC curves, by the areas of the first condition that has any."""
    for one in judged:
        areas = {course.course: one.area(course.course) for course in one.courses}
        met = sorted((area[0], course) for course, area in areas.items() if area is not None)
        if met:
            return [course for _, course in met]
    return []


def introduction(judged: Sequence[Judged], held_out: bool) -> tuple[str, str]:
    """Heading of a report, its answer, and how the numbers were chosen and judged."""
    tuned = judged[0].tuned
    who = (
        "The settings were chosen on some logs and judged on others."
        if held_out
        else "The same logs were used to choose and to judge, so the figures are optimistic."
    )
    how = (
        "Each condition was replayed with the given α, β and leak."
        if tuned.choice.is_free is None
        else "Each condition was replayed over a grid of α, β and leak. The chosen setting has the "
        "shortest delay among those without a false shift, even if β is a fifth smaller. "
        f"{who}"
    )
    place = "on rough ground" if tuned.way == "rough" else "after the end of rough ground"
    stand_in = shipped_rule(back=tuned.way == "rough")
    other = "back" if tuned.way == "rough" else "there"
    return _TITLES[tuned.way], (
        f"{_answer(condition_rows(judged), tuned.way)}\n\n"
        f"The tables show how far robots walk {place} until each condition detects it, and how "
        f"often the condition shifts without need. {how} "
        f"A control step is {1000 * CONTROL_PERIOD:g} ms unless a log has another period. β [s] is "
        "the shortest time in which k can exceed β, and β [m] is the distance at the mean speed in "
        f"this time. Area is the area under the ROC curve of passages of {LENGTH:g} m on the "
        f"hardest course, at {_area_words(tuned.choice)}. Chattered counts the robots that would "
        "shift more than once there and once back for each rough stretch, with the default graph's "
        f"rule for the way {other} (α {stand_in.alpha:g} m, β {stand_in.beta:g}, leak "
        f"{stand_in.leak:g}); in the logs they do not shift. Intervals are 95 %."
    )


def _answer(rows: Sequence[Row], way: Way) -> str:
    """Detections and false shifts of the condition with the shortest mean delay, misses counted."""
    real = [row for row in rows if row["condition"] not in _BOUNDS] or rows
    came, detected = (np.array([row[name] for row in real]) for name in ("came", "detected"))
    metres = detected * np.array([row["delay_m"] or 0.0 for row in real])
    best = real[int(np.argmin(delay_with_misses(came, detected, metres)))]
    among = f"Of {len(real)} conditions " if len(real) > 1 else ""
    soonest = " soonest:" if among else ""
    end = "rough ground" if way == "rough" else "the end of rough ground"
    delay = "" if best["delay_m"] is None else f" after {best['delay_m']:.2f} m on average"
    count = best["false_shifts"]
    false = f"{count or 'no'} false shift{'s' * (count > 1)}"
    return (
        f"{among}`{best['condition']}` detects {end}{soonest} in {best['detected']} of "
        f"{best['came']} runs{delay}, with {false} in {best['km']:.2f} km."
    )


def _area_words(choice: Choice) -> str:
    """Description of the β at which areas are computed."""
    if choice.is_free is None:
        return "the given β (no area where k cannot exceed it within a passage)"
    return (
        "the β with the largest area on the logs for choosing (k may not reach the chosen β within "
        "a passage)"
    )


def _condition_row(one: Judged) -> Row:
    tuned, choice = one.tuned, one.tuned.choice
    tallies = [course.tally for course in one.courses]
    came, detected, fired = (
        sum(int(getattr(tally, name)[0, 0]) for tally in tallies)
        for name in ("came", "detected", "fired")
    )
    km = sum(float(tally.km[0, 0]) for tally in tallies)
    delays = [delay for course in one.courses for delay in course.delays_m]
    areas = [area for course in one.courses if (area := one.area(course.course)) is not None]
    soonest = one.soonest if np.isfinite(one.soonest) else None
    return {
        "condition": tuned.candidate.name,
        "alpha": choice.alpha,
        "unit": tuned.candidate.unit,
        "beta": choice.beta,
        "beta_s": soonest,
        "beta_m": None if soonest is None else soonest * one.speed,
        "leak": choice.leak,
        "keeps_still": choice.is_free,
        "came": came,
        "detected": detected,
        "delay_m": float(np.mean(delays)) if delays else None,
        "false_shifts": fired,
        "km": km,
        "robots": sum(tally.robots for tally in tallies),
        "shifts": sum(course.shifts for course in one.courses),
        "chattered": sum(course.chattered for course in one.courses),
        "area": min(area for area, _, _ in areas) if areas else None,
        "area_beta": tuned.area_beta if areas else None,
    }


def _course_row(one: Judged, course: OnCourse) -> Row:
    tally = course.tally
    came, detected, fired = (
        int(getattr(tally, name)[0, 0]) for name in ("came", "detected", "fired")
    )
    km = float(tally.km[0, 0])
    low, high = (x[0] for x in wilson(np.array([float(detected)]), np.array([float(came)])))
    least, most = (x[0] for x in poisson(np.array([float(fired)]), np.array([km])))
    delays = np.array(course.delays_m)
    area = one.area(course.course)
    return {
        "condition": one.tuned.candidate.name,
        "course": course.course,
        "robots": tally.robots,
        "came": came,
        "detected": detected,
        "detected_low": float(low) if came else None,
        "detected_high": float(high) if came else None,
        "delay_m": float(delays.mean()) if detected else None,
        "delay_m_p95": float(np.quantile(delays, 0.95)) if detected else None,
        "delay_s": float(tally.delay_s[0, 0]) if detected else None,
        "false_shifts": fired,
        "km": km,
        "false_per_km": fired / km if km else None,
        "false_per_km_low": float(least) if km else None,
        "false_per_km_high": float(most) if km else None,
        "shifts": course.shifts,
        "chattered": course.chattered,
        "area": None if area is None else area[0],
        "area_low": None if area is None else area[1],
        "area_high": None if area is None else area[2],
        "area_beta": None if area is None else one.tuned.area_beta,
    }


def _readme(
    judged: Sequence[Judged],
    conditions: Sequence[Row],
    courses: Sequence[Row],
    command: str,
    held_out: bool,
    pictures: Mapping[str, str],
) -> str:
    title, words = introduction(judged, held_out)
    parts = [
        f"# {title}",
        words,
        f"Made by `{command}`. The same as an [interactive page](page.html).",
        "## All conditions",
    ]
    parts.append(table.markdown(CONDITIONS_HEAD, [condition_cells(row) for row in conditions]))
    parts += [
        f"No setting of {one.tuned.candidate.name} is free of false shifts on the logs for "
        "choosing; the setting with the fewest false shifts per kilometre is shown."
        for one in judged
        if one.tuned.choice.is_free is False
    ]
    parts += [f"![{line}]({name})" for name, line in pictures.items()]
    for one in judged:
        name = one.tuned.candidate.name
        parts += [f"## {name}", one.tuned.candidate.note.capitalize() + "."]
        of = [row for row in courses if row["condition"] == name]
        parts.append(table.markdown(COURSES_HEAD, [course_cells(row) for row in of]))
    return "\n\n".join(parts) + "\n"


CONDITIONS_HEAD = (
    *("condition", "α", "β", "β [s]", "β [m]", "leak"),
    *("detected", "mean delay [m]", "false shifts", "chattered", "area", "at β"),
)
"""Head of the table of `condition_cells`."""


def condition_cells(row: Row) -> tuple[str, ...]:
    """One of `condition_rows` as text."""
    return (
        row["condition"],
        f"{row['alpha']:.3g} {row['unit']}".strip(),
        f"{row['beta']:g}",
        _number(row["beta_s"], 2),
        _number(row["beta_m"], 2),
        f"{row['leak']:g}",
        f"{row['detected']} of {row['came']}",
        _number(row["delay_m"], 2),
        f"{row['false_shifts']} in {row['km']:.2f} km",
        f"{row['chattered']} of {row['robots']}",
        _number(row["area"], 4) or "–",
        "–" if row["area_beta"] is None else f"{row['area_beta']:g}",
    )


COURSES_HEAD = (
    *("course", "detected", "delay [m]", "95 % within [m]", "delay [s]"),
    *("false shifts", "false shifts per km, 95 %", "chattered", "area", "at β"),
)
"""Head of the table of `course_cells`."""


def course_cells(row: Row) -> tuple[str, ...]:
    """One of `course_rows` as text."""
    low, high = row["false_per_km_low"], row["false_per_km_high"]
    return (
        row["course"],
        f"{row['detected']} of {row['came']}" if row["came"] else "",
        _number(row["delay_m"], 2),
        _number(row["delay_m_p95"], 2),
        _number(row["delay_s"], 2),
        f"{row['false_shifts']} in {row['km']:.2f} km" if row["km"] else "",
        f"{low:.2g} to {high:.2g}" if row["km"] else "",
        f"{row['chattered']} of {row['robots']}",
        ("–" if row["came"] else "")
        if row["area"] is None
        else f"{row['area']:.4f} ({row['area_low']:.3f} to {row['area_high']:.3f})",
        "" if row["area_beta"] is None else f"{row['area_beta']:g}",
    )


def _number(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
