"""Numbers that a user gives: their names, units, sensible ranges and spelling."""

from dataclasses import dataclass

import numpy as np

from gaitshift.errors import GaitshiftError


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A named number in a closed range; it says itself what would have been right."""

    name: str
    """What the number is, as it stands in error lines."""
    unit: str
    """Its unit, as it stands in error lines; empty for a count or a ratio."""
    low: float
    """The smallest value taken, in `unit`."""
    high: float
    """The largest value taken, in `unit`."""

    def check(self, value: float) -> float:
        """Value itself; `GaitshiftError` where it is outside the range or not a number."""
        if not self.low <= value <= self.high:
            raise GaitshiftError(f"{self.name} must be {self.range}, got {value:g}")
        return value

    @property
    def range(self) -> str:
        """The range in words: `0 to 1 m`."""
        return f"{self.low:g} to {self.high:g} {self.unit}".rstrip()


def spell(kind: str, number: float) -> str:
    """Spec of a kind of ground with its number, the shortest that reads back exactly."""
    return f"{kind}:{np.format_float_positional(number, trim='-')}"
