"""Time to each gait: one lane per gait, gaitshift above the baseline, one dot per seed."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from gaitshift.errors import GaitshiftError
from gaitshift.lab.benchmark.outcome import Outcome, middle, ratio, ratio_text
from gaitshift.show.plots.style import (
    INK,
    PALE,
    PAPER,
    QUIET,
    check_target,
    gait_colours,
    house_style,
    save,
)

_WIDTH, _LANE, _MARGINS = 7.5, 1.15, 0.95
"""Width of the figure, and heights of a lane and of the margins above and below all lanes
[inch]."""

_ROWS = (-0.19, 0.19)
"""Positions of gaitshift and the baseline in a lane, as shares of its height."""

_TICKS = (1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1800, 3600, 7200, 14400)
"""[s]"""


def time_to_gait_figure(outcomes: Sequence[Outcome], path: Path) -> Figure:
    """Draws the training time of every seed, the median, and the ratio of the medians.

    A hollow dot with an arrow is a training that was stopped there without the gait.

    Raises:
        GaitshiftError: no outcomes, another file ending, or no such folder.
    """
    check_target(path)
    if not outcomes:
        raise GaitshiftError(f"{path}: there must be outcomes to draw, got none")
    gaits = list(dict.fromkeys(outcome.gait for outcome in outcomes))
    learners = list(dict.fromkeys(outcome.learner for outcome in outcomes))
    height = _LANE * len(gaits) + _MARGINS
    with house_style():
        figure = Figure(figsize=(_WIDTH, height))
        axes = figure.subplots()
        _draw_scale(axes, [outcome.seconds for outcome in outcomes], len(gaits))
        for lane, gait in enumerate(gaits):
            medians: list[Outcome] = []
            for learner, shift in zip(learners, _ROWS, strict=False):
                row = [o for o in outcomes if (o.gait, o.learner) == (gait, learner)]
                if row:
                    ours = learner == learners[0]
                    colour = gait_colours([gait])[gait] if ours else QUIET
                    _draw_row(axes, row, lane + shift, colour)
                    medians.append(middle(row))
            _name_lane(axes, gait, lane, medians)
        figure.subplots_adjust(left=0.12, right=0.80, top=1 - 0.2 / height, bottom=0.75 / height)
        save(figure, path)
    return figure


def _draw_scale(axes: Axes, seconds: list[float], lanes: int) -> None:
    low, high = min(seconds) / 1.5, max(seconds) * 1.6
    axes.set_xscale("log")
    axes.set_xlim(low, high)
    axes.set_ylim(lanes - 0.5, -0.5)
    ticks = [tick for tick in _TICKS if low < tick < high]
    axes.set_xticks(ticks, [str(tick) for tick in ticks])
    axes.xaxis.set_minor_locator(NullLocator())
    axes.set_xlabel("training time until the gait passes the check [s]")
    axes.grid(visible=True, axis="x")
    axes.grid(visible=False, axis="y")
    axes.set_yticks([])
    for line in range(1, lanes):
        axes.axhline(line - 0.5, color=PALE, linewidth=0.8)


def _draw_row(axes: Axes, row: list[Outcome], y: float, colour: str) -> None:
    median = middle(row)
    axes.plot([axes.get_xlim()[0], median.seconds], [y, y], color=colour, alpha=0.35, linewidth=4)
    for outcome in row:
        face = colour if outcome.reached else PAPER
        axes.plot(outcome.seconds, y, "o", markersize=8, color=colour, markerfacecolor=face)
        if not outcome.reached:
            axes.annotate(
                "",
                (outcome.seconds, y),
                (26, 0),
                xycoords="data",
                textcoords="offset points",
                arrowprops={"arrowstyle": "<-", "color": colour, "shrinkA": 0, "shrinkB": 5},
            )
    bound = "" if median.reached else "> "
    axes.annotate(
        f"{row[0].learner}: {bound}{median.seconds:.0f} s",
        (0.0, y),
        (4, 7),
        color=colour,
        fontsize=11,
        va="bottom",
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
    )


def _name_lane(axes: Axes, gait: str, lane: int, medians: list[Outcome]) -> None:
    axes.annotate(
        gait,
        (0.0, lane),
        (-10, 0),
        color=gait_colours([gait])[gait],
        ha="right",
        va="center",
        weight="bold",
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
    )
    times = ratio(*medians) if len(medians) == 2 else None
    if times is None:
        return
    axes.annotate(
        f"{ratio_text(times, is_lower_bound=not medians[1].reached)} ×\nfaster",
        (1.0, lane),
        (12, 0),
        color=INK,
        va="center",
        xycoords=("axes fraction", "data"),
        textcoords="offset points",
    )
