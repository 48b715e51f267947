"""The best gait at each place of a map, by an objective, and by how much it is better."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import hypot

from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.table import Row

FIGURES = {
    "energy": ("cost_of_transport", "cost_half", -1),
    "electrical-energy": ("electrical_cost_of_transport", "electrical_half", -1),
    "progress": ("progress", "progress_half", 1),
}
"""Figures by objective: the column, that of half its interval, and 1 where more is better."""

SPEED_ERROR, LEAST_SPEED_ERROR = 0.1, 0.05
"""A gait that shall save energy keeps the speed asked for, within this share of it, or this
[m/s]; ours."""


@dataclass(frozen=True, kw_only=True)
class Objective:
    """What makes a gait the best.

    Raises:
        GaitshiftError: there is no such objective, or `survival` is not a share.
    """

    name: str = "energy"
    """The least mechanical or electrical energy for the distance, or the furthest progress."""
    survival: float = 0.99
    """Least share of the robots that survive."""

    def __post_init__(self) -> None:
        if self.name not in FIGURES:
            raise GaitshiftError(known_names("objective", self.name, tuple(FIGURES)))
        if not 0.0 <= self.survival <= 1.0:
            raise GaitshiftError(f"survival must be 0 to 1, got {self.survival:g}")

    def value(self, row: Row) -> float:
        """The figure of a row."""
        return row[FIGURES[self.name][0]]

    def half(self, row: Row) -> float:
        """Half the width of the figure's interval."""
        return row[FIGURES[self.name][1]]

    def knows(self, row: Row) -> bool:
        """Whether a row has the figure; it has none where no robot went anywhere."""
        return row[FIGURES[self.name][0]] != ""

    def loss(self, row: Row) -> float:
        """The figure, such that less is better."""
        return -FIGURES[self.name][2] * self.value(row)

    def misses(self, row: Row) -> str:
        """Why a row cannot be the best, in a few words; empty where it can."""
        if row["survived"] < self.survival * row["robots"]:
            return f"survival {row['survived'] / row['robots']:.3f}"
        if FIGURES[self.name][0] == "progress":
            return ""
        speed, asked = row["speed_m_s"], row["speed"]
        if speed == "" or not self.knows(row):
            return "no distance"
        if abs(speed - asked) > max(SPEED_ERROR * asked, LEAST_SPEED_ERROR):
            return f"{speed:.2f} m/s"
        return ""


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """The policies at one speed on one ground, the best first."""

    speed: float
    """Commanded speed [m/s]."""
    rows: tuple[Row, ...]
    """The best row of each policy that can be the best."""
    others: tuple[Row, ...]
    """A row of each policy that cannot: the one that is nearest to it."""

    @property
    def best(self) -> str | None:
        """The best policy; None: no policy can be."""
        return self.rows[0]["policy"] if self.rows else None

    def margin(self, objective: Objective) -> tuple[float, float] | None:
        """By how much the best is better than the next, and half the interval of that (95 %).

        None where there is no other.
        """
        if len(self.rows) < 2:
            return None
        first, second = self.rows[:2]
        apart = objective.loss(second) - objective.loss(first)
        return apart, hypot(objective.half(first), objective.half(second))


def rankings(rows: Sequence[Row], objective: Objective) -> list[Ranking]:
    """The policies at each speed, of rows on one ground with one body.

    Of several stride frequencies each policy has the best.
    """
    found: list[Ranking] = []
    for speed, at_speed in groupby(sorted(rows, key=lambda row: row["speed"]), _speed):
        good, bad = list[Row](), list[Row]()
        for _, of in groupby(sorted(at_speed, key=_policy), _policy):
            own = list(of)
            fit = [row for row in own if not objective.misses(row)]
            if fit:
                good.append(min(fit, key=objective.loss))
            else:
                bad.append(max(own, key=lambda row: row["survived"]))
        good.sort(key=objective.loss)
        found.append(Ranking(speed=speed, rows=tuple(good), others=tuple(bad)))
    return found


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """Neighbouring speeds of a map at which one policy is the best."""

    policy: str | None
    """The policy; None: none can be the best."""
    first: float
    """Least of these speeds [m/s]."""
    last: float
    """Greatest of them [m/s]."""


def stretches(ranked: Sequence[Ranking]) -> list[Stretch]:
    """The best policies from slow to fast."""
    found: list[Stretch] = []
    for best, of in groupby(ranked, lambda one: one.best):
        speeds = [one.speed for one in of]
        found.append(Stretch(policy=best, first=speeds[0], last=speeds[-1]))
    return found


def _speed(row: Row) -> float:
    return row["speed"]


def _policy(row: Row) -> str:
    return row["policy"]
