"""The limits of a clean gait."""

from collections.abc import Mapping
from dataclasses import dataclass


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
    """Greatest difference of duty factor between left and right, of a symmetric gait."""
    clearance: float
    """Least height of each foot at the top of its swing [m]."""


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
"""Limits of the paper's three gaits."""

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
"""Limits of every other gait."""

FIRST_GAITS = ("trot", "pace", "bound")
"""The paper's gaits."""

LIMITS: Mapping[str, Limits] = dict.fromkeys(FIRST_GAITS, FIRST)
"""Gaits whose limits are not those of every other gait."""


def limits_of(gait: str) -> Limits:
    """The limits of a gait, by its name."""
    return LIMITS.get(gait, OTHERS)
