"""Data of interactive figures for the page's script."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int, Shaped

from gaitshift.show.report.data import packed

Tick = tuple[int, str, str | None]
"""Index of a cell, its label, and a colour other than that of text."""


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One axis of a heat map, with one value per cell."""

    name: str
    """Label with the unit."""
    short: str
    """Short name before a value in the readout."""
    values: tuple[str, ...]
    """Text of the value of each cell."""
    ticks: tuple[Tick, ...]
    """Cells with a label on the axis."""

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
    """Cells with a fixed colour for their kind in place of a shade."""

    name: str
    """Label of such a cell."""
    colour: str
    """Colour of the cells; "pale" follows the theme."""


@dataclass(frozen=True, kw_only=True)
class Said:
    """A quantity of each cell, shown on hover."""

    name: str
    """Label before the value."""
    values: Shaped[np.ndarray, "Y X"] | Sequence[str]
    """Numbers, or texts row by row; NaN and empty texts are left out."""
    digits: int = 0
    """Decimals of numbers."""
    unit: str = ""
    """Unit after the value."""
    of: Shaped[np.ndarray, "Y X"] | None = None
    """Totals, shown as "… of TOTAL"; None: no totals."""

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
        title: text alternative.
        x: horizontal axis.
        y: vertical axis.
        shade: values that shade the cells of kind 0.
        scale: label of the shades, with unit.
        span: the values of the first and of the last of the stops.
        stops: colours from low to high.
        kind: 0, or 1 + index in `kinds`.
        kinds: the kinds of cells without a shade.
        says: quantities of a cell, shown on hover.
        chosen: marked cell (column, row), which is described while no cell is hovered over.
        words: texts in the cells, row by row; the cells are then square.
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
    """A step curve in the unit square."""

    name: str
    """Said before its value."""
    label: str
    """Text in the legend."""
    colour: str
    """Of the line."""
    x: Float[np.ndarray, " n"]
    """Rising, 0 to 1."""
    y: Float[np.ndarray, " n"]
    """Values from each x to the next, 0 to 1."""


def curves(*, title: str, x: str, y: str, series: Sequence[Curve]) -> dict[str, Any]:
    """Several curves in one figure, with the names of the axes."""
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
