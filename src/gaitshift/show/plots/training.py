"""The learning curves of a training, from its `progress.csv`."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import ArrayLike

from gaitshift.errors import GaitshiftError
from gaitshift.show.plots.style import (
    INK,
    PALE,
    QUIET,
    check_target,
    few_ticks,
    house_style,
    name_row,
    save,
)
from gaitshift.table import read

COURSES = (
    ("reward", 1.0, "reward [per control step]"),
    ("speed", 1.0, "forward speed [m/s]"),
    ("survival", 100.0, "chance to walk 10 s without a fall [%]"),
    ("changes_per_s", 1.0, "changes of machine state [1/s]"),
)
"""Column, factor, and name of the row."""

_NEEDED = ("iteration", "stage", "steps", "wall_s", *(column for column, _, _ in COURSES))

_LIMITS = {"survival": (-4.0, 104.0)}
"""Fixed ends of the scale, by column."""

_SIZE = (7.5, 8.4)
"""[inch]"""

_AVERAGED = 25
"""The thick line averages over one of this many parts of the training."""


def training_curves(progress_csv: Path, path: Path) -> Figure:
    """Draws reward, speed, survival and changes a second over control steps and wall time.

    Thin: each iteration; thick: a moving average. Grey bands separate the stages.

    Raises:
        GaitshiftError: no such file, not a `progress.csv`, fewer than two iterations, another file
            ending, or no such folder.
    """
    check_target(path)
    table = read_progress(progress_csv)
    steps = numbers(table, "steps", progress_csv) / 1e6
    wall = numbers(table, "wall_s", progress_csv) / 60
    with house_style():
        figure = Figure(figsize=_SIZE)
        page = list(figure.subplots(len(COURSES), sharex=True))
        for axes, (column, factor, label) in zip(page, COURSES, strict=True):
            _draw_course(axes, steps, factor * numbers(table, column, progress_csv))
            axes.set_ylim(_LIMITS.get(column))
            name_row(axes, label)
        _mark_stages(page, steps, [row["stage"] for row in table])
        page[0].set_xlim(0.0, steps[-1])
        page[-1].set_xlabel("control steps [millions]")
        _add_wall_time(page[-1], steps, wall)
        figure.subplots_adjust(left=0.09, right=0.97, top=0.925, bottom=0.15, hspace=0.42)
        save(figure, path)
    return figure


def read_progress(path: Path) -> list[dict[str, str]]:
    """The lines of a training's `progress.csv`.

    Raises:
        GaitshiftError: no such file, not a `progress.csv`, or fewer than two iterations.
    """
    table = read(path, may_be_cut=True)
    if len(table) < 2:
        raise GaitshiftError(f"{path} must have 2 iterations or more to draw, got {len(table)}")
    missing = [column for column in _NEEDED if column not in table[0]]
    if missing:
        raise GaitshiftError(
            f"{path} is not the progress.csv of a training: it lacks '{missing[0]}'"
        )
    return table


def numbers(table: list[dict[str, str]], column: str, path: Path) -> Float[np.ndarray, " n"]:
    """A column of these lines; `path` is for errors."""
    try:
        return np.array([float(row[column]) for row in table])
    except (TypeError, ValueError) as error:
        raise GaitshiftError(f"{path}: column '{column}' must hold numbers") from error


def _draw_course(
    axes: Axes, steps: Float[np.ndarray, " n"], values: Float[np.ndarray, " n"]
) -> None:
    axes.plot(steps, values, color=QUIET, alpha=0.4, linewidth=0.8, label="each iteration")
    axes.plot(steps, _averaged(values), color=INK, label="average")
    few_ticks(axes)


def _averaged(values: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Mean over as many neighbours on both sides, fewer towards the ends."""
    reach = len(values) // (2 * _AVERAGED)
    total = np.append(0.0, np.cumsum(values))
    index = np.arange(len(values))
    half = np.minimum(reach, np.minimum(index, len(values) - 1 - index))
    return (total[index + half + 1] - total[index - half]) / (2 * half + 1)


def _mark_stages(
    page: Sequence[Axes], steps: Float[np.ndarray, " n"], stages: Sequence[str]
) -> None:
    """A grey band behind every other stage, and the names above."""
    starts = [i for i, stage in enumerate(stages) if i == 0 or stage != stages[i - 1]]
    ends = [0.0, *(float(steps[i - 1]) for i in starts[1:]), float(steps[-1])]
    for n, start in enumerate(starts):
        left, right = ends[n], ends[n + 1]
        for axes in page:
            if n % 2 == 1:
                axes.axvspan(left, right, color=PALE, alpha=0.5, linewidth=0, zorder=0)
        page[0].annotate(
            stages[start],
            ((left + right) / 2, 1.0),
            (0, 24),
            color=QUIET,
            ha="center",
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
        )


def _add_wall_time(
    axes: Axes, steps: Float[np.ndarray, " n"], wall: Float[np.ndarray, " n"]
) -> None:
    """A second scale below the first: the training time so far [min]."""
    there, back = np.append(0.0, steps), np.append(0.0, wall)

    def minutes(x: ArrayLike) -> ArrayLike:
        return np.interp(np.asarray(x, dtype=float), there, back)

    def millions(x: ArrayLike) -> ArrayLike:
        return np.interp(np.asarray(x, dtype=float), back, there)

    scale = axes.secondary_xaxis(-0.42, functions=(minutes, millions))
    ticks = [float(tick) for tick in MaxNLocator(6).tick_values(0.0, wall[-1])]
    scale.set_xticks([tick for tick in ticks if tick <= wall[-1]])
    scale.set_xlabel("wall time [min]")
