"""The statistics of shift conditions: one file each, and its line here."""

from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception
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
"""Statistics by their names in graph files and on the command line."""

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
