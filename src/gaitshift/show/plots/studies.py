"""The figures of studies: crossings over noise, and shifts from every gait to every other."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from gaitshift.errors import GaitshiftError
from gaitshift.show.plots.style import (
    DASHES,
    INK,
    PALE,
    PAPER,
    QUIET,
    check_target,
    few_ticks,
    gait_colours,
    house_style,
    name_row,
    save,
)

_ASIDE = 0.0015
"""Offset between the marks of two ways, so that none hides another [m]."""

_MARKS = ("o", "s", "^", "v", "D", "P", "X")


def crossings_figure(rows: Sequence[Mapping[str, Any]], path: Path) -> Figure:
    """Survival, distance, speed and cost of transport over the amplitude, one line per way.

    Raises:
        GaitshiftError: there are no rows.
    """
    check_target(path)
    if not rows:
        raise GaitshiftError(f"{path}: there must be crossings to draw, got none")
    names = list(dict.fromkeys(row["way"] for row in rows))
    alone = [name.removesuffix(" only") for name in names if name.endswith(" only")]
    colours = {f"{gait} only": colour for gait, colour in gait_colours(alone).items()}
    others = [name for name in names if name not in colours and name != "oracle"]
    colours |= gait_colours(others) | {"oracle": QUIET}
    with house_style():
        figure = Figure(figsize=(11.0, 7.6))
        grid = figure.subplots(2, 2, sharex=True)
        for index, name in enumerate(names):
            of = sorted(
                (row for row in rows if row["way"] == name), key=lambda row: row["amplitude"]
            )
            _line(grid[0, 0], of, ("survived", ""), colours[name], index, name)
            for axes, mean, half in (
                (grid[0, 1], "distance_m", "distance_half"),
                (grid[1, 0], "speed_m_s", "speed_half"),
                (grid[1, 1], "cost_of_transport", "cost_half"),
            ):
                _line(axes, of, (mean, half), colours[name], index, name)
        titles = ("survival", "distance [m]", "speed [m/s]", "cost of transport")
        for axes, title in zip(grid.ravel(), titles, strict=True):
            name_row(axes, title)
            few_ticks(axes)
            axes.set_ylim(bottom=0.0)
        for axes in grid[1]:
            axes.set_xlabel("amplitude of the noise [m]", color=INK)
        handles, labels = grid[0, 0].get_legend_handles_labels()
        figure.tight_layout(rect=(0.0, 0.08, 1.0, 1.0))
        figure.legend(handles, labels, loc="lower center", ncols=min(len(names), 5), fontsize=12)
        save(figure, path)
    return figure


def _line(
    axes: Axes,
    rows: Sequence[Mapping[str, Any]],
    columns: tuple[str, str],
    colour: str,
    index: int,
    label: str,
) -> None:
    """One way's figures with their intervals; missing figures are left out."""
    name, half = columns
    rows = [row for row in rows if row[name] != ""]
    x = np.array([row["amplitude"] for row in rows]) + index * _ASIDE
    if half:
        y = np.array([row[name] for row in rows])
        below = above = np.array([row[half] for row in rows])
    else:
        y = np.array([row["survived"] / row["runs"] for row in rows])
        below = np.maximum(y - np.array([row["low"] for row in rows]), 0.0)
        above = np.maximum(np.array([row["high"] for row in rows]) - y, 0.0)
    axes.errorbar(
        x,
        y,
        yerr=np.stack([below, above]),
        color=colour,
        marker=_MARKS[index % len(_MARKS)],
        markersize=6,
        linestyle=DASHES if label.endswith(" only") else "-",
        elinewidth=1.0,
        label=label.replace("_", " "),
    )


_LEAST = 1e-4
"""Least share of failures with a shade."""

_CELL = 0.85
"""Size of the figure [inch]."""


def transition_map(rows: Sequence[Mapping[str, Any]], path: Path) -> Figure:
    """Failures of shifts on one ground: old gaits down, new gaits across.

    Raises:
        GaitshiftError: no rows, or rows of several grounds.
    """
    check_target(path)
    grounds = {row["ground"] for row in rows}
    if len(grounds) != 1:
        raise GaitshiftError(
            f"{path}: a map must show the shifts on one terrain, got {len(grounds)}"
        )
    gaits = list(dict.fromkeys(name for row in rows for name in (row["old"], row["new"])))
    at = {name: index for index, name in enumerate(gaits)}
    share = np.full((len(gaits), len(gaits)), np.nan)
    words: dict[tuple[int, int], str] = {}
    for row in rows:
        cell = at[row["old"]], at[row["new"]]
        failed = row["switches"] - row["successes"]
        share[cell] = max(failed / row["switches"], _LEAST / 2)
        words[cell] = f"{failed}" if failed else "0"
    total = {row["switches"] for row in rows}
    of = f" of {min(total)}" if len(total) == 1 else ""
    with house_style():
        size = _CELL * len(gaits)
        figure = Figure(figsize=(size + 2.4, size + 1.9))
        axes = figure.subplots()
        axes.grid(visible=False)
        axes.set_facecolor(PALE)
        steps = [PAPER, "#f7c9a9", "#d55e00", "#7a2f00"]
        shades = LinearSegmentedColormap.from_list("failures", steps)
        axes.imshow(share, cmap=shades, norm=LogNorm(_LEAST, 1.0), aspect="equal")
        for (row_at, column), text in words.items():
            dark = share[row_at, column] > 0.1
            colour = PAPER if dark else INK if text != "0" else QUIET
            axes.text(column, row_at, text, ha="center", va="center", color=colour, fontsize=11)
        names = [name.replace("_", "-") for name in gaits]
        axes.set_xticks(range(len(gaits)), names, rotation=40, ha="left", rotation_mode="anchor")
        axes.set_yticks(range(len(gaits)), names)
        axes.xaxis.tick_top()
        axes.tick_params(length=0)
        colours = gait_colours(gaits)
        for labels in (axes.get_xticklabels(), axes.get_yticklabels()):
            for name, label in zip(gaits, labels, strict=True):
                label.set_color(colours[name])
                label.set_fontweight("bold")
        axes.set_ylabel("from")
        axes.set_xlabel(f"failed shifts{of}, {min(grounds)}")
        figure.tight_layout()
        save(figure, path)
    return figure
