"""The page of a log: one robot's run."""

import base64
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from gaitshift.gait import gaits
from gaitshift.lab.gait_analysis import measure
from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.show.plots.signals import check_robot, fall_time, gait_spans, shift_times
from gaitshift.show.report.data import run_data, title_of
from gaitshift.show.report.page import Row, facts_table, table, write_page

MOST_VIDEO = 6_000_000
"""Largest video on a page [bytes], so that the page opens quickly; a larger one is left out."""

_LEAST_STRETCH = 3.0
"""Least time in a gait for a verdict [s]; the first second is left out."""


def write_report(
    log: Log,
    path: Path,
    *,
    robot: int = 0,
    description: Robot = ANYMAL_B,
    video: Path | None = None,
    facts: Mapping[str, str] | None = None,
) -> None:
    """Writes the page of one robot's run, whole or not at all.

    Args:
        log: the run.
        path: the HTML file.
        robot: whose run.
        description: of the robots of the log.
        video: an mp4 to show beside it, where it is not too large.
        facts: settings of the run, as text by name.

    Raises:
        GaitshiftError: a robot that is not in the log, or a log of another kind of robot.
    """
    check_robot(log, robot)
    description.check_is(log.robot, "the log")
    spans = gait_spans(log, robot)
    title = " → ".join(title_of(name) for name, _ in spans[:8]) + (" → …" if spans[8:] else "")
    known = {"ground": log.terrain, "robot": log.robot, "seen": f"robot {robot + 1} of {_n(log)}"}
    write_page(
        path,
        title=title,
        summary=_summary(log, robot),
        walks=[("", run_data(log, robot, description))],
        sections=[
            ("Gaits", table(STRETCH_HEAD, stretches(log, robot, description))),
            ("Shifts", table(_SHIFT_HEAD, _shifts(log, robot)) or "<p>No shift.</p>"),
            ("Film", _video(video)),
            ("Settings", facts_table(known, facts)),
        ],
    )


STRETCH_HEAD = ("gait", "from", "to", "gait by contacts", "speed", "pattern", "misses")
_SHIFT_HEAD = ("at", "where", "from", "to", "k")


def _summary(log: Log, robot: int) -> str:
    fell = fall_time(log, robot)
    seconds = float(log.time[-1]) if fell is None else fell
    last = max(int(np.searchsorted(log.time, seconds)) - 1, 0)
    x = log.truth.base_position_w[:, robot, 0]
    way = float(x[last] - x[0])
    speed = way / seconds if seconds > 0 else 0.0
    count = len(shift_times(log, robot))
    shifts = "no shift of gait" if count == 0 else f"{count} shift{'s' * (count > 1)} of gait"
    end = "no fall" if fell is None else f"fall after {fell:.1f} s"
    return f"{way:.1f} m in {seconds:.1f} s, {speed:.2f} m/s, {shifts}, {end}"


def _shifts(log: Log, robot: int) -> list[Row]:
    rows: list[Row] = []
    for (before, _), (after, span) in zip(
        gait_spans(log, robot), gait_spans(log, robot)[1:], strict=False
    ):
        x = float(log.truth.base_position_w[span.entry, robot, 0])
        k = f"{log.k[span.entry, robot]:.4g} of {log.threshold[span.entry, robot]:.4g}"
        cells = (f"{span.begin:.2f} s", f"{x:.2f} m", title_of(before), title_of(after), k)
        rows.append((cells, max(span.begin - 1.0, 0.0)))
    return rows


def stretches(log: Log, robot: int, description: Robot) -> list[Row]:
    """A row for each stretch in one gait: its verdict, and when it begins."""
    rows: list[Row] = []
    alone = log.robots(slice(robot, robot + 1))
    machines = {name: gaits.load(name) for name in log.gaits if name in gaits.names()}
    for name, span in gait_spans(log, robot):
        cells = [title_of(name), f"{span.begin:.1f} s", f"{span.end:.1f} s"]
        if name not in machines or span.end - span.begin < _LEAST_STRETCH:
            rows.append(((*cells, "too short to judge", "", "", ""), span.begin))
            continue
        end = int(np.searchsorted(log.time, span.end - 1e-9))
        figures = _judged(alone[span.entry : end], machines, description)
        verdict, misses = figures["verdict"], [m["figure"] for m in figures["verdict"]["misses"]]
        named = title_of(verdict["gait"]) if verdict["gait"] != "none" else "no gait"
        cells += [f"{named}{', clean' if verdict['clean'] else ''}"]
        cells += [_number(figures["speed_mean"], " m/s"), _number(figures["pattern_fraction"], "")]
        rows.append(((*cells, ", ".join(m.replace("_", " ") for m in misses)), span.begin))
    return rows


def _judged(stretch: Log, machines: Mapping[str, Any], robot: Robot) -> dict[str, Any]:
    """Figures of a stretch, its time counted from its beginning."""
    since = stretch.time - float(stretch.time[0])
    moved = replace(stretch, sensed=replace(stretch.sensed, time=since))
    return measure(moved, machines, robot, warm_up=1.0)


def _video(path: Path | None) -> str:
    if path is None or not path.is_file() or path.stat().st_size > MOST_VIDEO:
        return ""
    data = base64.b64encode(path.read_bytes()).decode("ascii")
    return (
        "<video controls muted playsinline preload='auto' "
        f"src='data:video/mp4;base64,{data}'></video>"
    )


def _number(value: float | None, unit: str) -> str:
    return "–" if value is None else f"{value:.2f}{unit}"


def _n(log: Log) -> int:
    return log.k.shape[1]
