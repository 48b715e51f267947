"""One edge of a machine: the way from a state to another, with its guard and its bonus."""

import math
from dataclasses import dataclass

from gaitshift.errors import GaitshiftError
from gaitshift.reward_machine.feet import in_leg_order, mirrored_name
from gaitshift.reward_machine.guard import Guard
from gaitshift.reward_machine.reading import Table, located

_KEYS = ("from", "to", "down", "up", "dwell", "swing_height", "bonus")


@dataclass(frozen=True, kw_only=True)
class Edge:
    """One line of δu, from a state and the labels that suit a guard to a state (paper III-B)."""

    source: str
    """Name of the state that is left."""

    target: str
    """Name of the state that is reached."""

    guard: Guard
    """When the edge is taken."""

    bonus: float = 1.0
    """δr of the edge, as a multiplier of the bonus b that all edges share (paper III-C: 200)."""

    def __post_init__(self):
        if self.source == self.target:
            raise GaitshiftError(
                "a transition must lead to another state; where no guard holds the machine stays"
            )
        if not math.isfinite(self.bonus):
            raise GaitshiftError(f"bonus must be a finite number, not {self.bonus}")

    def mirrored(self) -> "Edge":
        """Return the edge of the robot seen in a mirror."""
        return Edge(
            source=mirrored_name(self.source),
            target=mirrored_name(self.target),
            guard=self.guard.mirrored(),
            bonus=self.bonus,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the table [[transition]] of a gait file, with nothing left to a default."""
        return {
            "from": self.source,
            "to": self.target,
            "down": in_leg_order(self.guard.down),
            "up": in_leg_order(self.guard.up),
            "dwell": self.guard.dwell,
            "swing_height": self.guard.swing_height,
            "bonus": self.bonus,
        }

    @classmethod
    def from_dict(cls, data: object, *, number: int, dwell: int, swing_height: float) -> "Edge":
        """Read the table [[transition]], the `number`-th of its file.

        Dwell [control steps] and swing height [m] are the file's own, for an edge that names none.
        Raises `GaitshiftError`.
        """
        with located(f"transition {number}"):
            table = Table(data, keys=_KEYS)
            source, target = table.text("from"), table.text("to")
        with located(f"transition {number} ({source} -> {target})"):
            guard = Guard(
                down=table.feet("down"),
                up=table.feet("up"),
                dwell=table.whole("dwell", default=dwell),
                swing_height=table.number("swing_height", default=swing_height),
            )
            bonus = table.number("bonus", default=1.0)
            return cls(source=source, target=target, guard=guard, bonus=bonus)
