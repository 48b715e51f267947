"""The figure of a run: contacts, signals of the condition, and shifts of gait."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitshift.lab.log import Log
from gaitshift.show.plots import rows
from gaitshift.show.plots.signals import (
    check_robot,
    fall_time,
    has_condition,
    period,
    shift_times,
)
from gaitshift.show.plots.style import INK, PAPER, QUIET, check_target, house_style, save


@dataclass(frozen=True)
class _Row:
    draw: Callable[[Axes, Log, int], None]
    height: float
    """[inch]"""
    tinted: bool = True
    """Whether its background has the colours of the gaits."""
    of_condition: bool = False
    """Whether it shows a shift condition; such rows are left out without one."""


_ROWS = (
    _Row(rows.draw_gaits, 0.30, tinted=False),
    _Row(rows.draw_contacts, 1.30, tinted=False),
    _Row(rows.draw_foot_heights, 1.30, of_condition=True),
    _Row(rows.draw_counter, 1.10, of_condition=True),
    _Row(rows.draw_speed, 1.10),
    _Row(rows.draw_ground, 1.20),
)
"""Rows from top to bottom."""

_WIDTH, _LEFT, _RIGHT = 10.0, 0.72, 0.22
_HEAD, _FOOT, _GAP = 1.15, 0.62, 0.42
"""Measures of the page [inch]."""


def demo_figure(log: Log, path: Path, robot: int = 0) -> Figure:
    """Draws one robot's run into a PNG (1600 pixels wide), SVG or PDF file.

    Rows over one time axis [s]: gait, contacts, foot heights h_i, counter k below its threshold,
    forward speed, base and ground; those of the condition are left out without one.
    Lines through all rows mark the shifts, and the time after a fall is grey.

    Raises:
        GaitshiftError: no such robot, a log of less than two steps, another file ending, or no
            such folder.
    """
    check_target(path)
    check_robot(log, robot)
    shown = [row for row in _ROWS if has_condition(log, robot) or not row.of_condition]
    with house_style():
        figure = Figure(figsize=(_WIDTH, _page_height(shown)))
        page = _lay_out(figure, shown)
        for axes, row in zip(page, shown, strict=True):
            row.draw(axes, log, robot)
            if row.tinted:
                rows.tint_gaits(axes, log, robot)
        _share_time(page, log)
        _mark_shifts(page, log, robot)
        _mark_fall(page, log, robot)
        _write_head(figure, log, robot)
        save(figure, path)
    return figure


def _page_height(shown: Sequence[_Row]) -> float:
    return _HEAD + sum(row.height for row in shown) + _GAP * (len(shown) - 1) + _FOOT


def _lay_out(figure: Figure, shown: Sequence[_Row]) -> list[Axes]:
    """One pair of axes per row."""
    page, axes = _page_height(shown), list[Axes]()
    top, width = page - _HEAD, _WIDTH - _LEFT - _RIGHT
    for row in shown:
        box = (_LEFT / _WIDTH, (top - row.height) / page, width / _WIDTH, row.height / page)
        axes.append(figure.add_axes(box))
        top -= row.height + _GAP
    return axes


def _share_time(page: Sequence[Axes], log: Log) -> None:
    """One time axis, labelled at the bottom; it begins a step before the first entry."""
    for axes in page:
        axes.set_xlim(float(log.time[0]) - period(log), float(log.time[-1]) + period(log))
    for axes in page[:-1]:
        axes.tick_params(axis="x", labelbottom=False, length=0)
        axes.spines["bottom"].set_visible(False)
    page[-1].set_xlabel("time [s]")


def _mark_shifts(page: Sequence[Axes], log: Log, robot: int) -> None:
    """A line through all rows at each shift, with its time above."""
    for time in shift_times(log, robot):
        for axes in page[1:]:
            axes.axvline(time, color=INK, linewidth=1.2, gid="shift", zorder=3)
        page[0].text(time, 1.15, f"{time:.2f} s", ha="center", va="bottom", size=12)


def _mark_fall(page: Sequence[Axes], log: Log, robot: int) -> None:
    """Greys out all rows after a fall."""
    time = fall_time(log, robot)
    if time is None:
        return
    for axes in page:
        axes.axvspan(time, axes.get_xlim()[1], color=PAPER, alpha=0.65, linewidth=0, zorder=4)
        axes.axvline(time, color=INK, linewidth=2.5, gid="fall", zorder=5)
    late = time > np.mean(page[0].get_xlim())
    page[0].text(
        time,
        1.15,
        f"fell at {time:.2f} s",
        ha="right" if late else "left",
        va="bottom",
        weight="bold",
    )


def _write_head(figure: Figure, log: Log, robot: int) -> None:
    count, fell = len(shift_times(log, robot)), fall_time(log, robot)
    shifted = f"{count or 'no'} gait shift{'' if count == 1 else 's'}"
    seconds = float(log.time[-1]) if fell is None else fell
    words = f"{shifted} in {seconds:.1f} s" + ("" if fell is None else ", then a fall")
    metres = float(
        np.linalg.norm(
            log.truth.base_position_w[-1, robot, :2] - log.truth.base_position_w[0, robot, :2]
        )
    )
    detail = f"{log.robot}, {metres:.1f} m on {log.terrain.replace(',', ', ')}"
    page, left = float(figure.get_figheight()), _LEFT / _WIDTH
    figure.text(left, 1 - 0.30 / page, words, size=19, weight="bold", va="center")
    figure.text(left, 1 - 0.62 / page, detail, size=13, color=QUIET, va="center")
