"""When an edge may be taken: feet down, feet up, long enough in the state."""

from dataclasses import dataclass

from gaitshift.errors import GaitshiftError
from gaitshift.gait.feet import (
    Feet,
    check_feet,
    feet_label,
    feet_of_label,
    feet_text,
    mirrored_feet,
)
from gaitshift.robot.legs import LABEL_COUNT

MOST_DWELL = 1000
"""Longest dwell a file may ask for [control steps]: 10 s at the paper's 100 Hz. Ours."""


@dataclass(frozen=True, kw_only=True)
class Guard:
    """The condition of an edge on the contacts (paper III-C) and on time.

    The contacts are the paper's. The dwell is ours, after the lock-out of the first author's
    earlier code: without it the feet learn to vibrate.
    """

    down: Feet
    """Feet that must touch."""

    up: Feet
    """Feet that must not touch; feet neither down nor up are free."""

    dwell: int = 0
    """Least number of control steps in the source state, the present one counted; 0 and 1: any."""

    def __post_init__(self):
        check_feet(self.down | self.up)
        if both := self.down & self.up:
            raise GaitshiftError(
                f"a foot must be in 'down' or in 'up', got {feet_text(both)} in both"
            )
        check_dwell(self.dwell)

    def holds_in(self, feet: Feet) -> bool:
        """Whether the contacts suit the guard when these feet alone touch."""
        return self.down <= feet and not self.up & feet

    @property
    def labels(self) -> tuple[int, ...]:
        """The contact patterns that suit the guard, in the numbers of `legs.label_of`."""
        low, high = feet_label(self.down), feet_label(self.up)
        return tuple(n for n in range(LABEL_COUNT) if n & low == low and not n & high)

    def pattern_shared_with(self, other: "Guard") -> Feet | None:
        """Feet of one contact pattern that suits both guards, None where there is none."""
        shared = set(self.labels).intersection(other.labels)
        return feet_of_label(min(shared)) if shared else None

    def mirrored(self) -> "Guard":
        """Return the guard of the robot seen in a mirror."""
        return Guard(
            down=mirrored_feet(self.down),
            up=mirrored_feet(self.up),
            dwell=self.dwell,
        )

    def demands(self) -> list[str]:
        """List what the guard asks for, for people."""
        lines = [f"{feet_text(self.down)} down"] if self.down else []
        lines += [f"{feet_text(self.up)} up"] if self.up else []
        return lines + ([f"after {self.dwell} steps"] if self.dwell > 1 else [])


def check_dwell(dwell: int) -> None:
    """Refuse a negative or absurd dwell, with a `GaitshiftError`."""
    if not 0 <= dwell <= MOST_DWELL:
        raise GaitshiftError(f"dwell must be 0 to {MOST_DWELL} control steps, got {dwell}")
