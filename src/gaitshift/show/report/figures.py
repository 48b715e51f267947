"""Figures that people can hover over and zoom into, as the page's script wants them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from gaitshift.show.report.data import packed

Tick = tuple[int, str, str | None]
"""Cell, its label, and a colour other than that of words."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One side of a heat map, a cell a value."""

    name: str
    """With its unit, for beside the map."""
    short: str
    """Said before a value that is read off."""
    values: tuple[str, ...]
    """Of each cell, as they are said."""
    ticks: tuple[Tick, ...]
    """Cells that are named along the side."""

    @classmethod
    def of_numbers(
        cls, name: str, short: str, numbers: Float[np.ndarray, " n"], unit: str = ""
    ) -> "Axis":
        """Rising numbers; ticks are those nearest to 1, 2 and 5 of each power of ten, and 0."""
        return cls(
            name=name,
            short=short,
            values=tuple(f"{value:.3g} {unit}".strip() for value in numbers),
            ticks=tuple(_round_ticks(numbers)),
        )

    @classmethod
    def of_names(cls, name: str, names: Mapping[str, str | None]) -> "Axis":
        """Things by their names, each with a colour."""
        ticks = [(i, word, colour) for i, (word, colour) in enumerate(names.items())]
        return cls(name=name, short=name, values=tuple(names), ticks=tuple(ticks))

    def to_dict(self) -> dict[str, Any]:
        """As the script wants it."""
        return {
            "name": self.name,
            "short": self.short,
            "count": len(self.values),
            "values": self.values,
            "ticks": self.ticks,
        }


@dataclass(frozen=True, kw_only=True)
class Category:
    """Cells that have no shade but the colour of their kind."""

    name: str
    """Said of such a cell."""
    colour: str
    """Of the cells; "pale" goes with the theme."""


@dataclass(frozen=True, kw_only=True)
class Said:
    """A figure of each cell that is told when it is pointed at."""

    name: str
    """Said before it."""
    values: Shaped[np.ndarray, "Y X"] | Sequence[str]
    """Numbers, or texts row by row; NaN and empty texts are passed over."""
    digits: int = 0
    """Decimals of numbers."""
    unit: str = ""
    """Said after it."""
    of: Shaped[np.ndarray, "Y X"] | None = None
    """Told as "… of" these."""

    def to_dict(self) -> dict[str, Any]:
        """As the script wants it."""
        return {
            "name": self.name,
            "values": _cells(self.values),
            "digits": self.digits,
            "unit": self.unit,
            "of": None if self.of is None else _cells(self.of),
        }


def heat_map(
    *,
    title: str,
    x: Axis,
    y: Axis,
    shade: Float[np.ndarray, "Y X"],
    scale: str,
    span: tuple[float, float],
    stops: Sequence[str],
    kind: Int[np.ndarray, "Y X"],
    kinds: Sequence[Category],
    says: Sequence[Said],
    chosen: tuple[int, int] | None = None,
    words: Sequence[str] | None = None,
) -> dict[str, Any]:
    """A heat map: row 0 is at the bottom.

    Args:
        title: for those who cannot see it.
        x: across.
        y: up.
        shade: what cells of kind 0 are shaded by.
        scale: what the shades mean, with unit.
        span: the values of the first and of the last of the stops.
        stops: colours from low to high.
        kind: 0, or 1 + index in `kinds`.
        kinds: what cells without a shade are.
        says: what is told of a cell.
        chosen: cell that is marked, and told of while nothing is pointed at: across, up.
        words: written into the cells, row by row, which are square then.
    """
    return {
        "figure": "map",
        "title": title,
        "x": x.to_dict(),
        "y": y.to_dict(),
        "values": packed(shade.ravel(), "f4"),
        "scale": scale,
        "range": span,
        "stops": list(stops),
        "kind": packed(kind.ravel(), "u1"),
        "kinds": [{"name": one.name, "colour": one.colour} for one in kinds],
        "says": [one.to_dict() for one in says],
        "chosen": chosen,
        "square": words is not None,
        "words": None if words is None else list(words),
    }


@dataclass(frozen=True, kw_only=True)
class Curve:
    """Steps over the unit square."""

    name: str
    """Said before its value."""
    label: str
    """In the legend."""
    colour: str
    """Of the line."""
    x: Float[np.ndarray, " n"]
    """Rising, 0 to 1."""
    y: Float[np.ndarray, " n"]
    """From each x to the next, 0 to 1."""


def curves(*, title: str, x: str, y: str, series: Sequence[Curve]) -> dict[str, Any]:
    """Curves side by side, with the names of the axes."""
    return {
        "figure": "curves",
        "title": title,
        "x": {"name": x},
        "y": {"name": y},
        "series": [
            {
                "name": one.name,
                "label": one.label,
                "colour": one.colour,
                "x": packed(one.x, "f4"),
                "y": packed(one.y, "f4"),
            }
            for one in series
        ],
    }


def _cells(values: Shaped[np.ndarray, "Y X"] | Sequence[str]) -> Any:
    if isinstance(values, np.ndarray):
        return packed(values.ravel(), "f4")
    return list(values)


def _round_ticks(numbers: Float[np.ndarray, " n"]) -> list[Tick]:
    ticks = dict[int, Tick]()
    if numbers[0] == 0.0:
        ticks[0] = (0, "0", None)
    positive = numbers[numbers > 0]
    low, high = math.floor(math.log10(positive[0])), math.ceil(math.log10(positive[-1]))
    for value in (f * 10.0**power for power in range(low, high + 1) for f in (1, 2, 5)):
        if positive[0] * 0.999 <= value <= positive[-1] * 1.001:
            cell = int(np.abs(np.log(np.maximum(numbers, 1e-12) / value)).argmin())
            ticks.setdefault(cell, (cell, f"{value:g}", None))
    return list(ticks.values())
