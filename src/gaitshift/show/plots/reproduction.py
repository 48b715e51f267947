"""The figures of a reproduction: the paper's Fig. 1, its Figs. 2 to 4, and the ablations."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from gaitshift.lab.log import Log
from gaitshift.lab.reproduction.judging import JudgedPolicy, middle
from gaitshift.lab.reproduction.plan import (
    ABLATIONS,
    AS_IN_THE_PAPER,
    PLATEAU,
    START,
    ZERO_CROSSING,
)
from gaitshift.lab.reproduction.results import Results, Seeds
from gaitshift.robot.command import PAPER_SPEED
from gaitshift.show.plots import contact_diagram
from gaitshift.show.plots.style import (
    DASHES,
    INK,
    QUIET,
    check_target,
    few_ticks,
    gait_colours,
    house_style,
    name_row,
    save,
)

Courses = Sequence[Float[np.ndarray, " _"]]
"""One quantity over the iterations, an array per seed; that of a diverged run is shorter."""

_SIZE = (7.5, 4.9)
"""Size of the figure of rewards [inch]."""

_PANEL = (3.75, 2.6)
"""Size of one comparison [inch]."""

_COMPARED = (INK, "#0072b2", "#d55e00")
"""Colours of the settings, the reference first."""


@dataclass(frozen=True, kw_only=True)
class Landmarks:
    """Landmarks of published curves."""

    start: float
    """Reward at the first iteration."""
    plateau: tuple[float, float]
    """Least and greatest reward at the end."""
    zero_crossing: Mapping[str, float]
    """Iteration at which each gait's reward crosses zero."""


def reward_curves(rewards: Mapping[str, Courses], landmarks: Landmarks, path: Path) -> Figure:
    """Draws the reward of each gait over the iterations, and the paper's landmarks beside it.

    Lines are means over seeds, bands their standard deviation.

    Raises:
        GaitshiftError: another file ending, or no such folder.
    """
    check_target(path)
    colours = gait_colours(rewards)
    with house_style():
        figure = Figure(figsize=_SIZE)
        axes = figure.add_axes((0.10, 0.13, 0.87, 0.65))
        low, high = landmarks.plateau
        axes.axhspan(low, high, color=QUIET, alpha=0.22, linewidth=0, gid="plateau")
        axes.axhline(0.0, color=QUIET, linewidth=0.8)
        for gait, courses in rewards.items():
            _draw_mean(axes, courses, colours[gait], gait)
        for gait, iteration in landmarks.zero_crossing.items():
            if gait in colours:
                axes.plot(iteration, 0.0, "v", color=colours[gait], markersize=9, clip_on=False)
        axes.plot(
            0, landmarks.start, ">", color=QUIET, markersize=9, clip_on=False, label="paper: start"
        )
        axes.plot([], [], "v", color=QUIET, markersize=9, label="paper: zero, by gait")
        axes.fill_between([], [], [], color=QUIET, alpha=0.22, linewidth=0, label="paper: end")
        axes.set_xlim(0, max(len(course) for courses in rewards.values() for course in courses))
        axes.set_xlabel("iteration")
        few_ticks(axes)
        name_row(axes, "reward [per control step]; band: standard deviation over seeds")
        handles, labels = axes.get_legend_handles_labels()
        for row, part in enumerate((slice(0, len(rewards)), slice(len(rewards), None))):
            figure.legend(
                handles[part],
                labels[part],
                loc="upper left",
                bbox_to_anchor=(0.085, 0.995 - 0.06 * row),
                ncols=3,
                handlelength=1.2,
                columnspacing=2.0,
                handletextpad=0.5,
                borderpad=0.0,
                borderaxespad=0.4,
            )
        save(figure, path)
    return figure


def comparison_curves(
    panels: Mapping[str, Mapping[str, Courses]], path: Path, *, aim: float
) -> Figure:
    """Draws the speed of each setting over the iterations [m/s], one panel per question.

    Lines are means over seeds, bands from the least to the greatest; the dashed line is the
    commanded speed. The first setting of a panel is its reference.

    Raises:
        GaitshiftError: another file ending, or no such folder.
    """
    check_target(path)
    rows = (len(panels) + 1) // 2
    with house_style():
        figure = Figure(figsize=(2 * _PANEL[0], rows * _PANEL[1] + 0.3))
        page = figure.subplots(rows, 2, squeeze=False, sharex=True, sharey=True).ravel()
        for axes, (question, settings) in zip(page, panels.items(), strict=False):
            axes.axhline(aim, color=QUIET, linestyle=DASHES, linewidth=1.0)
            for colour, (label, courses) in zip(_COMPARED, settings.items(), strict=False):
                _draw_mean(axes, courses, colour, label, whole_range=True)
            axes.set_title(question, loc="left", size=13, weight="bold", color=INK)
            axes.legend(loc="upper left", fontsize=10, handlelength=1.2, borderaxespad=0.2)
            few_ticks(axes)
            axes.tick_params(labelbottom=True)
        for axes in page[len(panels) :]:
            axes.set_visible(False)
        figure.supxlabel("iteration", size=13, color=INK)
        figure.supylabel("forward speed [m/s]", size=13, color=INK)
        page[0].set_ylim(-0.3, 2.3)
        longest = max(len(c) for panel in panels.values() for s in panel.values() for c in s)
        page[0].set_xlim(0, longest)
        figure.tight_layout(pad=0.6)
        save(figure, path)
    return figure


def _draw_mean(
    axes: Axes, courses: Courses, colour: str, label: str, *, whole_range: bool = False
) -> None:
    """A line and a band over as many iterations as any run has."""
    longest = max(map(len, courses))
    table = np.full((len(courses), longest), np.nan)
    for row, course in zip(table, courses, strict=True):
        row[: len(course)] = course
    iteration, mean = np.arange(1, longest + 1), np.nanmean(table, axis=0)
    spread = np.nanstd(table, axis=0)
    low, high = mean - spread, mean + spread
    if whole_range:
        low, high = np.nanmin(table, axis=0), np.nanmax(table, axis=0)
    axes.fill_between(iteration, low, high, color=colour, alpha=0.2, linewidth=0)
    axes.plot(iteration, mean, color=colour, label=label)


REWARDS, COMPARISONS = "reward.png", "ablations.png"

CONTACT_TIME = 2.0
"""Length of a contact diagram [s], as in the paper."""


def draw(results: Results, judged: list[JudgedPolicy], out: Path) -> list[str]:
    """Draws all available figures into `out`; returns the names of the files."""
    drawn: list[str] = []
    rewards = {gait: _columns(seeds, "reward") for gait, seeds in results.gaits()}
    rewards = {gait: curves for gait, curves in rewards.items() if curves}
    if rewards:
        landmarks = Landmarks(start=START, plateau=PLATEAU, zero_crossing=ZERO_CROSSING)
        reward_curves(rewards, landmarks, out / REWARDS)
        drawn.append(REWARDS)
    for gait in rewards:
        shown = middle(judged, gait)
        if shown is not None:
            path = out / f"contacts-{gait}.png"
            if shown.log is not None:
                _draw_contacts(shown.log, path)
            if path.is_file():  # drawn now, or by an earlier report
                drawn.append(path.name)
    panels = _panels(results)
    if panels:
        comparison_curves(panels, out / COMPARISONS, aim=PAPER_SPEED)
        drawn.append(COMPARISONS)
    return drawn


def _draw_contacts(log: Log, path: Path) -> None:
    """The last two seconds of the first robot that is still on its feet (else of the first)."""
    upright = (~log.fallen[-1]).nonzero()[0]
    robot = int(upright[0]) if upright.size else 0
    end = float(log.time[-1])
    contact_diagram(log, path, robot, t0=end - CONTACT_TIME, t1=end)


def _panels(results: Results) -> Mapping[str, Mapping[str, Courses]]:
    """Speeds by group and label, the reference first."""
    reference = results.reference
    panels: dict[str, dict[str, Courses]] = {}
    if reference is None:
        return panels
    ablations = dict(results.ablations())
    for setting in ABLATIONS:
        if setting.name in ablations:
            first = {AS_IN_THE_PAPER[setting.group]: _columns(reference, "speed")}
            panel = panels.setdefault(setting.group, first)
            panel[setting.label] = _columns(ablations[setting.name], "speed")
    return {
        group: {label: curves for label, curves in panel.items() if curves}
        for group, panel in panels.items()
    }


def _columns(seeds: Seeds, column: str) -> Courses:
    """One column of every run that has a curve."""
    return [getattr(curve, column) for curve in seeds.curves if len(curve)]
