"""Shifts from every gait to every other: a heat map of how often they fail."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure

from gaitshift.errors import GaitshiftError
from gaitshift.show.plots.palette import INK, PALE, PAPER, QUIET, gait_colours
from gaitshift.show.plots.style import check_target, house_style, save

_LEAST = 1e-4
"""Share of failures from which a cell is shaded."""

_CELL = 0.85
"""Of the figure [inch]."""


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
