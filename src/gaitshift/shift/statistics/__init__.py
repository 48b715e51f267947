"""What shift conditions watch: a new statistic is one file, and its line here."""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception
from gaitshift.shift.statistic import AnyStatistic
from gaitshift.shift.statistics.height_difference import HeightDifference
from gaitshift.shift.statistics.oracle import Oracle
from gaitshift.shift.statistics.plane import PlaneResidual
from gaitshift.shift.statistics.rivals import (
    AttitudeVariance,
    ContactTiming,
    CostOfTransport,
    Slip,
    SpeedCommand,
    ValueDrop,
)
from gaitshift.shift.statistics.surprise import TouchdownSurprise

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
"""Statistics by the name that graph files and command lines call them."""

Watched = AnyStatistic | Oracle
"""What an edge of a graph may watch."""


def watch(
    statistic: Watched,
    memory: Any,
    sensed: Proprioception,
    rough: Bool[np.ndarray, " N"] | None = None,
) -> tuple[Any, Float[np.ndarray, "N M"]]:
    """What a statistic remembers after a control step, and its numbers.

    Raises:
        GaitshiftError: an oracle, and nobody says which ground is `rough`.
    """
    if isinstance(statistic, Oracle):
        if rough is None:
            raise GaitshiftError("an oracle needs the truth about the ground, which is not given")
        return memory, statistic.values(rough)
    return statistic.step(memory, sensed)
