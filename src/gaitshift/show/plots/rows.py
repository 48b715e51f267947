"""The rows of figures: each draws one quantity of one robot over time into one pair of axes."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitshift.lab.log import Log
from gaitshift.robot.legs import LEGS
from gaitshift.show.plots.signals import (
    check_robot,
    gait_at,
    gait_spans,
    ground_below,
    period,
    shift_times,
    smoothed,
    spans,
    window,
)
from gaitshift.show.plots.style import (
    DASHES,
    GROUND,
    INK,
    LEG_COLOURS,
    PAPER,
    QUIET,
    check_target,
    few_ticks,
    gait_colours,
    house_style,
    name_row,
    save,
)

_SPEED_SIGMA = 0.2
"""Width of the window that smooths the speed [s]: half a stride, which hides single steps."""

_LANE = 0.74
"""Height of a contact bar, as a share of the distance between lanes."""

_ROOM = 0.07
"""Shortest stretch with a label, as a share of the time shown."""


def draw_gaits(axes: Axes, log: Log, robot: int) -> None:
    """A band in the colour of the present gait, with its name."""
    colours = gait_colours(log.gaits)
    for name, span in gait_spans(log, robot):
        axes.axvspan(span.begin, span.end, color=colours[name], linewidth=0)
        if span.end - span.begin >= _ROOM * np.ptp(log.time):
            axes.text(span.middle, 0.46, name, color=PAPER, weight="bold", ha="center", va="center")
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.grid(visible=False)


def tint_gaits(axes: Axes, log: Log, robot: int) -> None:
    """A pale background in the colour of the gait."""
    colours = gait_colours(log.gaits)
    for name, span in gait_spans(log, robot):
        axes.axvspan(span.begin, span.end, color=colours[name], alpha=0.07, linewidth=0, zorder=0)


def draw_contacts(axes: Axes, log: Log, robot: int) -> None:
    """A bar for each stance phase of each foot, in the colour of the gait at its start."""
    colours = gait_colours(log.gaits)
    for leg in range(len(LEGS)):
        contact = log.sensed.contact[:, robot, leg]
        stances = [span for span in spans(log, contact) if contact[span.entry]]
        bars = [(span.begin, span.end - span.begin) for span in stances]
        faces = [colours[gait_at(log, robot, span.entry)] for span in stances]
        axes.broken_barh(bars, (leg - _LANE / 2, _LANE), facecolors=faces, linewidth=0)
    axes.set_ylim(len(LEGS) - 0.5, -0.5)
    axes.set_yticks(range(len(LEGS)), LEGS)
    axes.grid(visible=False)
    name_row(axes, "feet on the ground")


def draw_foot_heights(axes: Axes, log: Log, robot: int) -> None:
    """The foot heights h_i of the shift condition, each from the foot's first touch on."""
    for leg, name in enumerate(LEGS):
        known = np.cumsum(log.sensed.contact[:, robot, leg]) > 0
        height, colour = 100 * log.touch_height[known, robot, leg], LEG_COLOURS[leg]
        axes.plot(
            log.time[known],
            height,
            color=colour,
            label=name,
            drawstyle="steps-post",
            linewidth=1.5,
        )
    axes.legend(
        ncols=4,
        loc="lower right",
        bbox_to_anchor=(1.0, 0.99),
        borderpad=0.0,
        borderaxespad=0.0,
        handlelength=1.1,
        handletextpad=0.4,
        columnspacing=1.2,
    )
    few_ticks(axes)
    name_row(axes, "foot height at last touch, hᵢ [cm]")


def draw_counter(axes: Axes, log: Log, robot: int) -> None:
    """The counter k and its threshold, with the threshold's value."""
    k, threshold = log.k[:, robot], log.threshold[:, robot]
    axes.fill_between(log.time, k, color=QUIET, alpha=0.25, linewidth=0)
    axes.plot(log.time, k, color=INK, label="k")
    axes.plot(log.time, threshold, color=QUIET, linestyle=DASHES, drawstyle="steps-post", label="β")
    for span in spans(log, threshold):
        value = float(threshold[span.entry])
        if span.end - span.begin >= _ROOM * np.ptp(log.time):
            axes.text(span.middle, value, f"β = {value:g}", color=QUIET, ha="center", va="bottom")
    axes.set_ylim(0, 1.3 * max(float(k.max()), float(threshold.max())))
    few_ticks(axes)
    axes.grid(visible=False)
    name_row(axes, "counter k, threshold β [counts]")


def draw_speed(axes: Axes, log: Log, robot: int) -> None:
    """Forward speed, at each step and smoothed, and the commanded speed."""
    speed = log.truth.forward_speed[:, robot]
    command = log.sensed.need("forward_speed_command", "the plot")[:, robot]
    course = smoothed(speed, period(log), _SPEED_SIGMA)
    axes.plot(log.time, speed, color=QUIET, alpha=0.35, linewidth=0.8, label="each step")
    axes.plot(
        log.time, command, color=QUIET, linestyle=DASHES, drawstyle="steps-post", label="command"
    )
    axes.plot(log.time, course, color=INK, label="smoothed")
    low = min(0.0, float(course.min()))
    high = max(float(course.max()), float(command.max()), low + 0.1)
    axes.set_ylim(low, low + 1.25 * (high - low))
    few_ticks(axes)
    name_row(axes, "forward speed, dashed: command [m/s]")


def draw_ground(axes: Axes, log: Log, robot: int) -> None:
    """The ground in profile, and the path of the base above it."""
    base, ground = log.truth.base_position_w[:, robot, 2], ground_below(log, robot)
    bottom = min(float(ground.min()), 0.0) - 0.08
    axes.fill_between(log.time, ground, bottom, color=GROUND, linewidth=0)
    axes.plot(log.time, ground, color=INK, linewidth=1.0, label="ground")
    axes.plot(log.time, base, color=INK, label="base")
    axes.set_ylim(bottom, max(float(base.max()), float(ground.max())) + 0.08)
    few_ticks(axes)
    name_row(axes, "base and ground, height [m]")


_SIZE = (7.5, 2.9)
"""[inch]"""


def contact_diagram(
    log: Log, path: Path, robot: int = 0, *, t0: float = 0.0, t1: float = float("inf")
) -> Figure:
    """Draws a robot's stance phases between `t0` and `t1` [s] into a PNG, SVG or PDF file.

    Bars in the colour of the gait, one lane a foot, FL at the top; beside each lane the share of
    the time that the foot stood.

    Raises:
        GaitshiftError: no such robot, fewer than two steps in the window, another file ending, or
            no such folder.
    """
    check_target(path)
    check_robot(log, robot)
    part = window(log, t0, t1)
    with house_style():
        figure = Figure(figsize=_SIZE)
        axes = figure.add_axes((0.07, 0.22, 0.83, 0.60))
        draw_contacts(axes, part, robot)
        axes.set_ylabel("")
        axes.set_xlim(float(part.time[0]), float(part.time[-1]) + period(part))
        axes.set_xlabel("time [s]")
        for time in shift_times(part, robot):
            axes.axvline(time, color=INK, linewidth=1.2, gid="shift")
        _write_gaits(axes, part, robot)
        _write_shares(axes, part, robot)
        save(figure, path)
    return figure


def _write_gaits(axes: Axes, log: Log, robot: int) -> None:
    """The names of the gaits above the bars, each where it is in force."""
    colours = gait_colours(log.gaits)
    for name, span in gait_spans(log, robot):
        axes.text(
            span.middle,
            -0.65,
            name,
            color=colours[name],
            ha="center",
            va="bottom",
            size=14,
            weight="bold",
        )


def _write_shares(axes: Axes, log: Log, robot: int) -> None:
    """How long each foot stood, right of its lane."""
    right = axes.get_xlim()[1]
    for leg, share in enumerate(log.sensed.contact[:, robot].mean(axis=0)):
        axes.annotate(
            f"{100 * share:.0f} %",
            (right, leg),
            (8, 0),
            textcoords="offset points",
            va="center",
            size=12,
        )
    axes.text(right, -0.65, "  stood", va="bottom", size=12, color=QUIET)
