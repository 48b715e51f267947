"""What shift conditions watch: a new statistic is one file, and its line here."""

from pkgutil import resolve_name
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import AnyStatistic
from gaitshift.shift.statistics.oracle import Oracle

_STATISTICS = {
    "height_difference": "gaitshift.shift.statistics.height_difference:HeightDifference",
    "plane_residual": "gaitshift.shift.statistics.plane:PlaneResidual",
    "touchdown_surprise": "gaitshift.shift.statistics.surprise:TouchdownSurprise",
    "attitude_variance": "gaitshift.shift.statistics.rivals:AttitudeVariance",
    "contact_timing": "gaitshift.shift.statistics.rivals:ContactTiming",
    "slip": "gaitshift.shift.statistics.rivals:Slip",
    "cost_of_transport": "gaitshift.shift.statistics.rivals:CostOfTransport",
    "value_drop": "gaitshift.shift.statistics.rivals:ValueDrop",
    "speed": "gaitshift.shift.statistics.rivals:SpeedCommand",
    "oracle": "gaitshift.shift.statistics.oracle:Oracle",
}

STATISTICS: dict[str, type[Any]] = {name: resolve_name(of) for name, of in _STATISTICS.items()}
"""Statistics by the name that graph files and command lines call them."""

Watched = AnyStatistic | Oracle
"""What an edge of a graph may watch."""


def watch(
    statistic: Watched,
    memory: Any,
    sensed: Proprioception,
    rough: Bool[np.ndarray, " N"] | None = None,
) -> tuple[Any, Float[np.ndarray, "N M"]]:
    """The memory of a statistic after a control step, and its values.

    Raises:
        GaitshiftError: the statistic is an oracle, and `rough` is not given.
    """
    if isinstance(statistic, Oracle):
        if rough is None:
            raise GaitshiftError("an oracle needs the truth about the ground, which is not given")
        return memory, statistic.values(rough)
    return statistic.step(memory, sensed)
