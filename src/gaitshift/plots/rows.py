"""The rows of the figures: each draws one thing of one robot over time into one pair of axes."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from gaitshift.legs import LEGS
from gaitshift.log import Log
from gaitshift.plots.palette import GROUND, INK, LEG_COLOURS, PAPER, QUIET, gait_colours
from gaitshift.plots.signals import edges, forward_speed, ground_of, runs, runs_of, smoothed
from gaitshift.plots.style import name_row

_SPEED_SIGMA = 0.2
"""Of the window over the speed [s]: half a stride, so that the course is seen and not the steps."""

_LANE = 0.74
"""Height of a contact bar, of the distance from one foot's lane to the next."""

_ROOM = 0.07
"""Shortest stretch that has words written in, of the figure's width in time."""

_DASHES = (0, (4, 2))


def draw_gaits(axes: Axes, log: Log, robot: int) -> None:
    """A band in the colour of the gait in force, with its name."""
    colours = gait_colours(log.gaits)
    ends, gait = edges(log.time), log.gait[:, robot]
    for start, stop in runs(gait):
        name = log.gaits[gait[start]]
        left, right = ends[start], ends[stop]
        axes.axvspan(left, right, color=colours[name], linewidth=0)
        if right - left >= _ROOM * (ends[-1] - ends[0]):
            middle = (left + right) / 2
            axes.text(middle, 0.46, name, color=PAPER, weight="bold", ha="center", va="center")
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.grid(visible=False)


def tint_gaits(axes: Axes, log: Log, robot: int) -> None:
    """A breath of the gait's colour behind a row."""
    colours = gait_colours(log.gaits)
    ends, gait = edges(log.time), log.gait[:, robot]
    for start, stop in runs(gait):
        colour = colours[log.gaits[gait[start]]]
        axes.axvspan(ends[start], ends[stop], color=colour, alpha=0.07, linewidth=0, zorder=0)


def draw_contacts(axes: Axes, log: Log, robot: int) -> None:
    """A bar for each stance phase of each foot, in the colour of the gait it began in."""
    colours = gait_colours(log.gaits)
    ends, gait = edges(log.time), log.gait[:, robot]
    for leg, _ in enumerate(LEGS):
        phases = runs_of(log.contact[:, robot, leg])
        spans = [(ends[start], ends[stop] - ends[start]) for start, stop in phases]
        faces = [colours[log.gaits[gait[start]]] for start, _ in phases]
        axes.broken_barh(spans, (leg - _LANE / 2, _LANE), facecolors=faces, linewidth=0)
    axes.set_ylim(len(LEGS) - 0.5, -0.5)
    axes.set_yticks(range(len(LEGS)), LEGS)
    axes.grid(visible=False)
    name_row(axes, "feet on the ground")


def draw_foot_heights(axes: Axes, log: Log, robot: int) -> None:
    """The h_i that the shift condition compares."""
    for leg, name in enumerate(LEGS):
        height = 100 * log.foot_height[:, robot, leg]
        colour = LEG_COLOURS[leg]
        axes.plot(log.time, height, color=colour, label=name, drawstyle="steps-post", linewidth=1.5)
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
    axes.yaxis.set_major_locator(MaxNLocator(4))
    name_row(axes, "foot height at last touch, $h_i$ [cm]")


def draw_counter(axes: Axes, log: Log, robot: int) -> None:
    """The counter k below the threshold that it is held against."""
    k, threshold = log.k[:, robot], log.threshold[:, robot]
    axes.fill_between(log.time, k, color=QUIET, alpha=0.25, linewidth=0)
    axes.plot(log.time, k, color=INK, label="k")
    axes.plot(
        log.time, threshold, color=QUIET, linestyle=_DASHES, drawstyle="steps-post", label="β"
    )
    finite = np.concatenate([k, threshold])
    finite = finite[np.isfinite(finite)]
    axes.set_ylim(0, 1.3 * max(finite.max(initial=0.0), 1.0))
    axes.yaxis.set_major_locator(MaxNLocator(4, integer=True))
    for start, stop in runs(threshold):
        if np.isfinite(threshold[start]) and stop - start >= _ROOM * len(threshold):
            words = f"β = {threshold[start]:g}"
            middle = (log.time[start] + log.time[stop - 1]) / 2
            axes.text(middle, threshold[start], words, color=QUIET, ha="center", va="bottom")
    axes.grid(visible=False)
    name_row(axes, "counter k, threshold β [counts]")


def draw_speed(axes: Axes, log: Log, robot: int) -> None:
    """Forward speed, raw and smoothed, and the speed commanded."""
    speed = forward_speed(log, robot)
    command = log.command[:, robot, 0]
    course = smoothed(speed, log.time, _SPEED_SIGMA)
    axes.plot(log.time, speed, color=QUIET, alpha=0.35, linewidth=0.8, label="each step")
    axes.plot(
        log.time,
        command,
        color=QUIET,
        linestyle=_DASHES,
        drawstyle="steps-post",
        label="command",
    )
    axes.plot(log.time, course, color=INK, label="smoothed")
    low, high = min(0.0, course.min()), max(course.max(), command.max())
    axes.set_ylim(low, low + 1.25 * max(high - low, 0.1))
    axes.yaxis.set_major_locator(MaxNLocator(4))
    name_row(axes, "forward speed, dashed: command [m/s]")


def draw_ground(axes: Axes, log: Log, robot: int) -> None:
    """The terrain in profile under the base, and the path of the base above it."""
    base = log.qpos[:, robot, :3]
    height = ground_of(log).height_at(base[:, :2])
    bottom = min(height.min() - 0.08, -0.08)
    axes.fill_between(log.time, height, bottom, color=GROUND, linewidth=0)
    axes.plot(log.time, height, color=INK, linewidth=1.0, label="ground")
    axes.plot(log.time, base[:, 2], color=INK, label="base")
    axes.set_ylim(bottom, max(base[:, 2].max(), height.max()) + 0.08)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    name_row(axes, "base and ground below it, height [m]")
