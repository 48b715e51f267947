"""The figure of a map: cost or progress over the speed, and the best gait along the axis."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.transforms import blended_transform_factory

from gaitshift.errors import GaitshiftError
from gaitshift.lab.studies.best import Objective, Ranking, rankings
from gaitshift.lab.studies.gait_map import by_ground
from gaitshift.robot.state import GRAVITY
from gaitshift.show.plots.style import (
    INK,
    PAPER,
    QUIET,
    check_target,
    few_ticks,
    gait_colours,
    house_style,
    save,
)

_TITLES = {
    "energy": "cost of transport",
    "electrical-energy": "electrical cost of transport",
    "progress": "progress",
}

_STRIP = 0.035
"""Height of the strip of the best gaits, as a share of the panel."""

_FROUDE = (0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0)
"""Froude numbers that are marked."""

_MOST = 4.0
"""Costs above this many times the least of a panel are cut off."""


def map_figure(
    rows: Sequence[Mapping[str, Any]], path: Path, objective: Objective | None = None
) -> Figure:
    """One panel a ground, after Hoyt and Taylor (1981).

    A line is a policy; a hollow mark is where it cannot be the best (`Objective.misses`). The strip
    at the lower edge has the colour of the best policy. The upper axis is the Froude number v²/(gh)
    with the height h of the stance.

    Raises:
        GaitshiftError: there are no rows.
    """
    check_target(path)
    if not rows:
        raise GaitshiftError(f"{path}: there must be rows of a map to draw, got none")
    objective = objective or Objective()
    of_ground = by_ground([dict(row) for row in rows])
    names = list(dict.fromkeys(row["policy"] for row in rows))
    colours = _colours({row["policy"]: row["gait"] for row in rows})
    across = min(len(of_ground), 3)
    down = -(-len(of_ground) // across)
    with house_style():
        figure = Figure(figsize=(max(5.0 * across, 7.0), 4.6 * down + 0.6))
        grid = figure.subplots(down, across, squeeze=False)
        for axes in grid.ravel()[len(of_ground) :]:
            axes.set_visible(False)
        for axes, (ground, of) in zip(grid.ravel(), of_ground, strict=False):
            _panel(axes, ground, of, objective, colours)
        handles = [Line2D([], [], color=colours[name], marker="o", markersize=6) for name in names]
        labels = _labels(names)
        columns = max(1, int(figure.get_figwidth() / (0.6 + 0.09 * max(map(len, labels)))))
        lines = -(-len(labels) // columns)
        height = (0.15 + 0.25 * lines) / figure.get_figheight()
        figure.tight_layout(rect=(0.0, height, 1.0, 1.0))
        figure.legend(handles, labels, loc="lower center", ncols=columns, fontsize=12)
        save(figure, path)
    return figure


def _colours(gaits: Mapping[str, str]) -> dict[str, str]:
    """Colour of each policy: that of its gait, or another for a second policy of the gait."""
    first: dict[str, str] = {}
    for name, gait in gaits.items():
        first[name] = name if gait in first.values() else gait
    return dict(zip(first, gait_colours(first.values()).values(), strict=True))


def _labels(names: Sequence[str]) -> list[str]:
    """The names without a folder that all of them have."""
    folders = {name.rpartition("/")[0] for name in names}
    short = [name.rpartition("/")[2] for name in names] if len(folders) == 1 else names
    return [name.replace("_", "-") for name in short]


def _panel(
    axes: Axes,
    ground: str,
    rows: Sequence[Mapping[str, Any]],
    objective: Objective,
    colours: Mapping[str, str],
) -> None:
    """One ground."""
    ranked = rankings([dict(row) for row in rows], objective)
    for name, colour in colours.items():
        _line(axes, name, ranked, objective, colour)
    best = [objective.value(one.rows[0]) for one in ranked if one.rows]
    if best and objective.name != "progress":
        top = max(axes.get_ylim()[1], 0.0)
        axes.set_ylim(0.0, min(top, _MOST * max(best)))
    axes.set_ylim(bottom=0.0)
    _strip(axes, ranked, colours)
    axes.set_xlim(left=0.0)
    title = f"{ground}: {_TITLES[objective.name]}"
    axes.set_title(title, color=INK, loc="left", fontsize=14, pad=30)
    axes.set_xlabel("speed asked for [m/s]", color=INK)
    few_ticks(axes)
    height = float(rows[0]["leg_m"])
    froude = axes.secondary_xaxis(
        "top",
        functions=(
            lambda v: np.square(v) / (GRAVITY * height),
            lambda f: np.sqrt(np.maximum(f, 0.0) * GRAVITY * height),
        ),
    )
    fastest = axes.get_xlim()[1] ** 2 / (GRAVITY * height)
    froude.set_xticks([f for f in _FROUDE if f < fastest])
    froude.xaxis.set_major_formatter(lambda f, _: f"{f:g}")
    froude.tick_params(labelsize=10, colors=QUIET, length=3)
    froude.set_xlabel("Froude number", color=QUIET, fontsize=10, loc="right")


def _line(
    axes: Axes, name: str, ranked: Sequence[Ranking], objective: Objective, colour: str
) -> None:
    """The figures of one policy, with their intervals."""
    own = [
        (one.speed, row, can)
        for one in ranked
        for rows, can in ((one.rows, True), (one.others, False))
        for row in rows
        if row["policy"] == name and objective.knows(row)
    ]
    if not own:
        return
    own.sort(key=lambda each: each[0])
    x = [speed for speed, _, _ in own]
    y = [objective.value(row) for _, row, _ in own]
    half = [objective.half(row) for _, row, _ in own]
    axes.errorbar(x, y, yerr=half, color=colour, elinewidth=1.0, label=name)
    for at, value, (_, _, can) in zip(x, y, own, strict=True):
        face = colour if can else PAPER
        axes.plot(at, value, "o", color=colour, markerfacecolor=face, markersize=6)


def _strip(axes: Axes, ranked: Sequence[Ranking], colours: Mapping[str, str]) -> None:
    """Along the lower edge, the best policy at each speed, halfway to the next speeds."""
    speeds = np.array([one.speed for one in ranked])
    middle = (speeds[1:] + speeds[:-1]) / 2
    ends = np.array([*speeds[:1], *middle, *speeds[-1:]])
    across = blended_transform_factory(axes.transData, axes.transAxes)
    for one, left, right in zip(ranked, ends[:-1], ends[1:], strict=True):
        if one.best is None:
            continue
        strip = Rectangle((left, 0.0), right - left, _STRIP, transform=across)
        strip.set(facecolor=colours[one.best], edgecolor="none", zorder=0.5)
        axes.add_patch(strip)
