"""The contact diagram after Hildebrand: when each foot is down."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitshift.lab.log import Log
from gaitshift.show.plots.rows import draw_contacts
from gaitshift.show.plots.signals import check_robot, gait_spans, period, shift_times, window
from gaitshift.show.plots.style import INK, QUIET, check_target, gait_colours, house_style, save

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
    """The names of the gaits above the bars, each over its time."""
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
    """The duty factor of each foot, right of its lane."""
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
