"""Statistics and conditions by their names, for files and command lines."""

from dataclasses import fields, replace
from typing import Any

from gaitshift.data import Table, known_names
from gaitshift.errors import GaitshiftError
from gaitshift.shift.condition import Condition
from gaitshift.shift.statistic import AnyStatistic
from gaitshift.shift.statistics.attitude import AttitudeVariance
from gaitshift.shift.statistics.energy import CostOfTransport
from gaitshift.shift.statistics.height_difference import HeightDifference
from gaitshift.shift.statistics.oracle import Oracle
from gaitshift.shift.statistics.plane import PlaneResidual
from gaitshift.shift.statistics.slip import Slip
from gaitshift.shift.statistics.speed import SpeedCommand
from gaitshift.shift.statistics.surprise import TouchdownSurprise
from gaitshift.shift.statistics.timing import ContactTiming
from gaitshift.shift.statistics.value_drop import ValueDrop

STATISTICS: dict[str, type[Any]] = {
    "height_difference": HeightDifference,
    "plane_residual": PlaneResidual,
    "touchdown_surprise": TouchdownSurprise,
    "attitude_variance": AttitudeVariance,
    "contact_timing": ContactTiming,
    "slip": Slip,
    "cost_of_transport": CostOfTransport,
    "value_drop": ValueDrop,
    "speed": SpeedCommand,
    "oracle": Oracle,
}
"""Kinds of statistic; a new one is a file and a line here."""

CONDITIONS: dict[str, Condition] = {
    "height_difference": Condition(),
    # Numbers of `gaitshift identify` (docs/results/shifting).
    "touchdown_surprise": Condition(
        statistic=TouchdownSurprise(),
        alpha=0.0124,
        beta=8.0,
        statistic_back=HeightDifference(),
        alpha_back=0.0055,
        beta_back=18.0,
        leak_back=0.12,
    ),
    "paper": Condition.paper(),
}
"""Conditions ready for use."""


def load_condition(name: str, **changes: float | None) -> Condition:
    """The condition of this name, with some of its numbers changed; None leaves one as it is.

    Raises:
        GaitshiftError: no such condition, or a number out of range.
    """
    if name not in CONDITIONS:
        raise GaitshiftError(known_names("condition", name, tuple(CONDITIONS)))
    given: dict[str, Any] = {k: v for k, v in changes.items() if v is not None}
    return replace(CONDITIONS[name], **given)


def statistic(data: object) -> AnyStatistic:
    """The statistic that a table of a file describes: its `kind`, and settings of that kind."""
    kind = Table(data, keys=_ALL_KEYS).text("kind")
    if kind not in STATISTICS:
        raise GaitshiftError(known_names("statistic", kind, tuple(STATISTICS)))
    made = STATISTICS[kind]
    table = Table(data, keys=("kind", *(field.name for field in fields(made))))
    return made(**{f.name: _value(table, f.name, f.default) for f in fields(made)})


_ALL_KEYS = tuple(
    dict.fromkeys(("kind", *(f.name for made in STATISTICS.values() for f in fields(made))))
)


def _value(table: Table, key: str, default: Any) -> Any:
    """What the table says of a key, of the type of its default."""
    if not table.has(key):
        return default
    if isinstance(default, str):
        return table.text(key)
    if isinstance(default, int):
        return table.whole(key)
    return table.number(key)
