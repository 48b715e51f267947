"""One edge of a machine: the way from a state to another, with its guard and its bonus."""

import math
from dataclasses import dataclass

from gaitshift.data import Table, located
from gaitshift.errors import GaitshiftError
from gaitshift.gait.feet import in_leg_order, mirrored_name
from gaitshift.gait.guard import Guard

MOST_SWING_HEIGHT = 0.3
"""Greatest swing height a file may ask for [m]. Ours: half of ANYmal's leg."""

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

    swing_height: float = 0.0
    """Height [m] over the ground that the soles of the feet that come down should have reached in
    their swing; 0: any. It bars no edge: a lower swing is paid a smaller bonus. Ours, with the
    3 cm of RMLL in mind: without it feet drag."""

    def __post_init__(self):
        if self.source == self.target:
            raise GaitshiftError(
                f"'from' and 'to' must be different states, got {self.source!r} for both"
            )
        if not math.isfinite(self.bonus):
            raise GaitshiftError(f"bonus must be a finite number, got {self.bonus}")
        check_swing_height(self.swing_height)

    def mirrored(self) -> "Edge":
        """Return the edge of the robot seen in a mirror."""
        return Edge(
            source=mirrored_name(self.source),
            target=mirrored_name(self.target),
            guard=self.guard.mirrored(),
            bonus=self.bonus,
            swing_height=self.swing_height,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the table [[transition]] of a gait file, with nothing left to a default."""
        return {
            "from": self.source,
            "to": self.target,
            "down": in_leg_order(self.guard.down),
            "up": in_leg_order(self.guard.up),
            "dwell": self.guard.dwell,
            "swing_height": self.swing_height,
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
            )
            return cls(
                source=source,
                target=target,
                guard=guard,
                bonus=table.number("bonus", default=1.0),
                swing_height=table.number("swing_height", default=swing_height),
            )


def check_swing_height(height: float) -> None:
    """Refuse a negative or absurd swing height [m], with a `GaitshiftError`."""
    if not 0 <= height <= MOST_SWING_HEIGHT:
        raise GaitshiftError(f"swing_height must be 0 to {MOST_SWING_HEIGHT} m, got {height:g}")
