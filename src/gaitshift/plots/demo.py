"""The figure of a run: what the feet did, what the condition saw, and when the gait shifted."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitshift.log import Log
from gaitshift.plots import rows
from gaitshift.plots.palette import INK, PAPER, QUIET
from gaitshift.plots.signals import check_robot, edges, fall, shifts
from gaitshift.plots.style import check_target, house_style, save

_ROWS: tuple[tuple[float, Callable[[Axes, Log, int], None]], ...] = (
    (0.30, rows.draw_gaits),
    (1.30, rows.draw_contacts),
    (1.30, rows.draw_foot_heights),
    (1.10, rows.draw_counter),
    (1.10, rows.draw_speed),
    (1.20, rows.draw_ground),
)
"""Height of each row [inch], and what draws it."""

_WIDTH, _LEFT, _RIGHT = 10.0, 0.72, 0.22
_HEAD, _FOOT, _GAP = 1.15, 0.62, 0.42
"""Measures of the page [inch]."""


def demo_figure(log: Log, path: Path, robot: int = 0) -> Figure:
    """Draws one robot's run into a PNG (1600 pixels wide), SVG or PDF file.

    Six rows over one time axis [s]: gait, contacts, foot heights, counter, speed, ground. Lines
    through all rows mark the shifts; a grey veil covers what comes after a fall.

    Raises:
        GaitshiftError: no such robot, a log of less than two steps, another file ending, or no
            such folder.
    """
    check_target(path)
    check_robot(log, robot)
    with house_style():
        figure = Figure(figsize=(_WIDTH, _page_height()))
        page = _lay_out(figure)
        for axes, (_, draw) in zip(page, _ROWS, strict=True):
            draw(axes, log, robot)
        for axes in page[2:]:
            rows.tint_gaits(axes, log, robot)
        _share_time(page, log)
        _mark_shifts(page, log, robot)
        _mark_fall(page, log, robot)
        _write_head(figure, log, robot)
        save(figure, path)
    return figure


def _page_height() -> float:
    return _HEAD + sum(height for height, _ in _ROWS) + _GAP * (len(_ROWS) - 1) + _FOOT


def _lay_out(figure: Figure) -> list[Axes]:
    """One pair of axes a row, from the top down."""
    page, axes = _page_height(), list[Axes]()
    top = page - _HEAD
    for height, _ in _ROWS:
        width = _WIDTH - _LEFT - _RIGHT
        box = (_LEFT / _WIDTH, (top - height) / page, width / _WIDTH, height / page)
        axes.append(figure.add_axes(box))
        top -= height + _GAP
    return axes


def _share_time(page: Sequence[Axes], log: Log) -> None:
    ends = edges(log.time)
    begin = 2 * ends[0] - ends[1]
    for axes in page:
        axes.set_xlim(begin, ends[-1])
        axes.tick_params(
            axis="x", labelbottom=axes is page[-1], length=4 if axes is page[-1] else 0
        )
    for axes in page[:-1]:
        axes.spines["bottom"].set_visible(False)
    page[-1].set_xlabel("time [s]")


def _mark_shifts(page: Sequence[Axes], log: Log, robot: int) -> None:
    """A line through all rows at each shift, with its time above."""
    for entry in shifts(log, robot):
        time = float(log.time[entry])
        for axes in page[1:]:
            axes.axvline(time, color=INK, linewidth=1.2, gid="shift", zorder=3)
        page[0].text(time, 1.15, f"{time:.2f} s", ha="center", va="bottom", size=12)


def _mark_fall(page: Sequence[Axes], log: Log, robot: int) -> None:
    """A veil over everything after a fall: the robot counts no more."""
    entry = fall(log, robot)
    if entry is None:
        return
    time, end = float(log.time[entry]), edges(log.time)[-1]
    for axes in page:
        axes.axvspan(time, end, color=PAPER, alpha=0.65, linewidth=0, zorder=4)
        axes.axvline(time, color=INK, linewidth=2.5, gid="fall", zorder=5)
    page[0].text(time, 1.15, f"fell at {time:.2f} s", ha="center", va="bottom", weight="bold")


def _write_head(figure: Figure, log: Log, robot: int) -> None:
    count, fallen = len(shifts(log, robot)), fall(log, robot)
    shifted = f"{count or 'no'} gait shift{'' if count == 1 else 's'}"
    seconds = log.time[-1 if fallen is None else fallen]
    words = f"{shifted} in {seconds:.1f} s" + ("" if fallen is None else ", then a fall")
    metres = float(np.linalg.norm(log.qpos[-1, robot, :2] - log.qpos[0, robot, :2]))
    detail = f"{log.robot}, {metres:.1f} m on {log.terrain.replace(',', ', ')}"
    page, left = _page_height(), _LEFT / _WIDTH
    figure.text(left, 1 - 0.30 / page, words, size=19, weight="bold", va="center")
    figure.text(left, 1 - 0.62 / page, detail, size=13, color=QUIET, va="center")
