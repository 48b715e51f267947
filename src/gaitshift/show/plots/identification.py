"""Results of an identification: a map over α and β, and ROC curves."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FuncFormatter, NullFormatter

from gaitshift.lab.identification.judging import Judged
from gaitshift.show.plots.style import (
    GROUND,
    INK,
    PALE,
    PAPER,
    QUIET,
    check_target,
    house_style,
    save,
)

LINES = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00"),
    *("#7b4ea3", "#8c6d46", "#44aa99", "#882255", "#1f2933"),
)
"""Colours after Okabe and Ito, and Tol; no figure shows both conditions and gaits."""

LATEST = 6.0
"""Largest delay of the colour scale [m]."""

FALSE = "#f3d9c4"
"""Colour of settings with false shifts."""

DETECTED = "true positive rate: passages to detect, with a shift"
OTHERS = "false positive rate: other passages, with a shift"
"""Axes of a ROC curve."""


def condition_map(one: Judged, path: Path) -> Figure:
    """Mean delay of a detection over α and β, where there is no false shift, and the choice.

    The figures are those of the recordings for choosing.
    """
    check_target(path)
    tuned = one.tuned
    grid, tally = tuned.grid, tuned.tally
    quiet = tally.fired == 0
    mostly = tally.missed < 0.5
    delay = np.where(quiet & mostly, tally.delay_m, np.nan)
    with house_style():
        figure = Figure(figsize=(8.5, 5.6))
        axes = figure.subplots()
        axes.grid(visible=False)
        axes.set_facecolor(PALE)
        shades = LinearSegmentedColormap.from_list("delay", ["#0b3c5d", "#4f97c4", "#dcebf5"])
        mesh = axes.pcolormesh(
            grid.betas, grid.alphas, delay, cmap=shades, vmin=0.0, vmax=LATEST, shading="nearest"
        )
        alarmed = np.where(~quiet, 1.0, np.nan)
        false = LinearSegmentedColormap.from_list("false", [FALSE, FALSE])
        axes.pcolormesh(grid.betas, grid.alphas, alarmed, cmap=false, shading="nearest")
        choice = tuned.choice
        axes.plot(choice.beta, choice.alpha, "o", color=PAPER, markersize=9, mec=INK, mew=2)
        axes.set_xscale("symlog", linthresh=1.0, linscale=0.3)  # β may be 0
        axes.set_yscale("log")
        axes.set_xlabel("β [counts]")
        unit = tuned.candidate.unit
        axes.set_ylabel(f"α [{unit}]" if unit else "α")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter(FuncFormatter(_plain))
            axis.set_minor_formatter(NullFormatter())
        regions = (
            (bool((~quiet).any()), FALSE, "false shifts"),
            (bool((quiet & ~mostly).any()), PALE, "most passages missed"),
        )
        axes.legend(
            handles=[Patch(color=colour, label=name) for there, colour, name in regions if there],
            loc="upper left",
            bbox_to_anchor=(0.0, -0.14),
            ncols=2,
            frameon=False,
            fontsize=12,
        )
        ends = "max" if (delay > LATEST).any() else "neither"
        bar = cast(Any, figure.colorbar(mesh, ax=axes, pad=0.02, extend=ends))
        bar.set_label("mean delay [m]")
        bar.outline.set_visible(False)
        soonest = f"{one.soonest:.2g} s or longer" if np.isfinite(one.soonest) else "never"
        axes.set_title(
            f"{tuned.candidate.name}\nα = {choice.alpha:.3g} {unit}".rstrip()
            + f", β = {choice.beta:g} ({soonest}), leak {choice.leak:g}",
            loc="left",
            fontsize=12,
        )
        figure.tight_layout()
        save(figure, path)
    return figure


def roc_figure(judged: Sequence[Judged], course: str, path: Path) -> Figure:
    """ROC curves of passages of a course against all others, one line per condition."""
    check_target(path)
    with house_style():
        figure = Figure(figsize=(9.2, 5.6))
        axes = figure.subplots()
        rows: list[tuple[float, str, float, str]] = []
        kept = [one for one in judged if one.area(course) is not None]
        for index, one in enumerate(kept):
            area = one.area(course)
            x, y = roc(one.scores_on(course), one.other_scores)
            colour = LINES[index % len(LINES)] if index < len(LINES) else GROUND
            axes.plot(x, y, color=colour)
            tuned = one.tuned
            rows.append((area[0] if area else 0.0, tuned.candidate.name, tuned.area_beta, colour))
        for line, (area, name, beta, colour) in enumerate(sorted(rows, reverse=True)):
            axes.text(
                1.03,
                0.97 - 0.09 * line,
                f"{area:.3f}  {name}, β {beta:g}",
                color=colour,
                transform=axes.transAxes,
                va="top",
                fontsize=12,
            )
        axes.text(
            1.03, 1.06, "area at β", color=QUIET, transform=axes.transAxes, va="top", fontsize=12
        )
        axes.set_xlim(-0.01, 1.0)
        axes.set_ylim(0.0, 1.01)
        axes.set_xlabel(OTHERS)
        axes.set_ylabel(DETECTED)
        axes.set_title(f"passages of 3 m, {course} against the rest", loc="left", fontsize=12)
        figure.tight_layout()
        figure.subplots_adjust(right=0.6)
        save(figure, path)
    return figure


def roc(wanted: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """False and true positive rates at each α, the strictest first.

    Passages of equal score are one sloped segment, so that the area below counts ties by half.
    """
    levels = np.unique(np.concatenate([wanted, others]))[::-1]
    x = np.array([0.0, *[(others >= level).mean() for level in levels]])
    y = np.array([0.0, *[(wanted >= level).mean() for level in levels]])
    return x, y


def _plain(value: float, position: float | None) -> str:
    return f"{value:g}"
