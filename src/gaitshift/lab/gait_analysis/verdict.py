"""What a gait has to reach to be called clean, and whether it does."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from gaitshift.gait import RewardMachine
from gaitshift.lab.gait_analysis.phase import phase_errors
from gaitshift.robot.legs import LEGS, MIRRORED_LEGS


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limits of one class of gaits, all ours; figures are those of `measure`."""

    survival: float
    """Least share of robots on their feet at the end."""
    speed_error: float
    """Greatest distance of the mean speed from the command [m/s]."""
    pattern_fraction: float
    """Least share of steps in a stance set of the gait."""
    touchdown_error: float
    """Greatest distance of a foot's touchdowns a cycle from 1."""
    phase_error: float
    """Greatest distance of a foot's phase from the ideal [stride]."""
    phase_consistency: float
    """Least resultant length of a foot's phase."""
    duty_asymmetry: float
    """Greatest difference of duty factor, left to right, of a gait that is its own mirror image."""
    clearance: float
    """Least height of each foot at the top of its swing [m]."""
    stalled: float = 0.01
    """Greatest share of robots that stand because their machine does not go on."""


FIRST = Limits(
    survival=0.999,
    speed_error=0.05,
    pattern_fraction=0.80,
    touchdown_error=0.10,
    phase_error=0.05,
    phase_consistency=0.95,
    duty_asymmetry=0.05,
    clearance=0.05,
)
"""Of the paper's three gaits."""

OTHERS = Limits(
    survival=0.99,
    speed_error=0.10,
    pattern_fraction=0.65,
    touchdown_error=0.20,
    phase_error=0.08,
    phase_consistency=0.90,
    duty_asymmetry=0.05,
    clearance=0.04,
)
"""Of every other gait."""

STAND_PATTERN, STAND_DRIFT = 0.99, 0.02
"""Of a gait that stands: least share of steps on all feet of its stance, and greatest drift [m]; it
has the limits of survival and speed of the others, and none that are about strides."""

FIRST_GAITS = ("trot", "pace", "bound")
"""The paper's."""

LIMITS: Mapping[str, Limits] = dict.fromkeys(FIRST_GAITS, FIRST)
"""Gaits with limits of their own class."""


def limits_of(gait: str) -> Limits:
    """The limits of a gait, by its name."""
    return LIMITS.get(gait, OTHERS)


_UNITS = {"speed_error": "m/s", "phase_error": "stride", "clearance": "m", "drift": "m"}


@dataclass(frozen=True, kw_only=True)
class Check:
    """One figure against its limit."""

    figure: str
    """Name of the figure: a field of `Limits`."""
    foot: str | None = None
    """The worst foot, where the limit is for each foot; its name in `LEGS`."""
    value: float | None
    """None: nothing to measure, which does not pass."""
    bound: Literal["at_least", "at_most"]
    """Whether the limit is a lower or an upper bound."""
    limit: float
    """In the unit of the figure."""

    @property
    def passed(self) -> bool:
        """Whether the value meets the limit."""
        if self.value is None:
            return False
        return self.value >= self.limit if self.bound == "at_least" else self.value <= self.limit

    @property
    def unit(self) -> str:
        """Unit of value and limit; empty for shares."""
        return _UNITS.get(self.figure, "")

    def to_dict(self) -> dict[str, Any]:
        """As JSON has it."""
        foot = {} if self.foot is None else {"foot": self.foot}
        return {"figure": self.figure, **foot, "value": self.value, self.bound: self.limit}


def checks(figures: Mapping[str, Any], machine: RewardMachine) -> tuple[Check, ...]:
    """Checks of the figures of `measure` against all limits of the machine's gait.

    A limit on each foot gives the check of the worst foot. Duty factors of left and right are
    compared where the gait is its own mirror image.
    """
    limits = limits_of(machine.name)
    if machine.stands:
        pattern, drift = figures["pattern_fraction"], figures["drift"]
        return (
            _whole(limits, "survival", figures["survival"], "at_least"),
            _whole(limits, "speed_error", figures["speed_error"], "at_most"),
            Check(figure="pattern_fraction", value=pattern, bound="at_least", limit=STAND_PATTERN),
            Check(figure="drift", value=drift, bound="at_most", limit=STAND_DRIFT),
        )
    touchdowns = figures["touchdowns_per_cycle"]
    touchdown_error = None if touchdowns is None else np.abs(np.array(touchdowns) - 1.0)
    phase = np.array([np.nan if x is None else x for x in figures["phase"]])
    result = [
        _whole(limits, "survival", figures["survival"], "at_least"),
        _whole(limits, "speed_error", figures["speed_error"], "at_most"),
        _whole(limits, "pattern_fraction", figures["pattern_fraction"], "at_least"),
        _worst(limits, "touchdown_error", touchdown_error, "at_most"),
        _worst(limits, "phase_error", phase_errors(phase, machine), "at_most"),
        _worst(limits, "phase_consistency", figures["phase_consistency"], "at_least"),
        _worst(limits, "clearance", figures["clearance"], "at_least"),
        _whole(limits, "stalled", figures["stalled"], "at_most"),
    ]
    if machine.mirrored_states() is not None:
        duty = figures["duty_factor"]
        asymmetry = None if duty is None else _asymmetry(duty)
        result.append(_worst(limits, "duty_asymmetry", asymmetry, "at_most"))
    return tuple(result)


def _asymmetry(duty: list[float]) -> np.ndarray:
    return np.abs(np.array(duty) - np.array(duty)[list(MIRRORED_LEGS)])


def _whole(
    limits: Limits, figure: str, value: float | None, bound: Literal["at_least", "at_most"]
) -> Check:
    return Check(figure=figure, value=value, bound=bound, limit=getattr(limits, figure))


def _worst(
    limits: Limits, figure: str, values: Any, bound: Literal["at_least", "at_most"]
) -> Check:
    """Check of the foot with the worst value; a foot without a value counts as worst."""
    limit = getattr(limits, figure)
    if values is None:
        return Check(figure=figure, value=None, bound=bound, limit=limit)
    each = np.array([np.nan if x is None else x for x in values], dtype=float)
    missing = np.flatnonzero(np.isnan(each))
    if missing.size:
        return Check(
            figure=figure, foot=LEGS[int(missing[0])], value=None, bound=bound, limit=limit
        )
    worst = int(each.argmin() if bound == "at_least" else each.argmax())
    return Check(
        figure=figure, foot=LEGS[worst], value=float(each[worst]), bound=bound, limit=limit
    )
