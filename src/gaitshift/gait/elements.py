"""States, guards and transitions of a machine, and their sets of feet."""

import math
import re
from dataclasses import dataclass

from gaitshift.data import Table, located
from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import LABEL_COUNT, LEGS, MIRRORED_LEGS

Feet = frozenset[str]
"""Some of the four feet, by their names in `LEGS`."""

_IN_MIRROR = {leg: LEGS[mirrored] for leg, mirrored in zip(LEGS, MIRRORED_LEGS, strict=True)}


def check_feet(feet: Feet) -> None:
    """Refuse names that are not feet, with a `GaitshiftError`."""
    for foot in sorted(feet.difference(LEGS)):
        raise GaitshiftError(f"foot must be one of {', '.join(LEGS)}, got {foot!r}")


def in_leg_order(feet: Feet) -> list[str]:
    """Return the feet in the order of `LEGS`."""
    return [leg for leg in LEGS if leg in feet]


def feet_text(feet: Feet) -> str:
    """Name the feet as a person reads them: "FL BR", or "no foot"."""
    return " ".join(in_leg_order(feet)) or "no foot"


def feet_label(feet: Feet) -> int:
    """Return the number, as `legs.label_of` has it, of the pattern of these feet alone."""
    return sum(1 << LEGS.index(foot) for foot in feet)


def feet_of_label(label: int) -> Feet:
    """Return the feet that touch in this contact pattern."""
    return frozenset(leg for i, leg in enumerate(LEGS) if label >> i & 1)


def mirrored_feet(feet: Feet) -> Feet:
    """Return the same feet seen in a mirror: left and right change places."""
    return frozenset(_IN_MIRROR[foot] for foot in feet)


def mirrored_name(name: str) -> str:
    """Mirror a state's name: FL_BR becomes FR_BL, and a name without feet stays."""
    return "_".join(_IN_MIRROR.get(part, part) for part in name.split("_"))


MOST_DWELL = 1000
"""Longest dwell a file may ask for [control steps]: 10 s at the paper's 100 Hz. Ours."""


@dataclass(frozen=True, kw_only=True)
class Guard:
    """The condition of an edge on the contacts (paper III-C) and on time.

    The condition on contacts is the paper's. The dwell is ours, after the lock-out of the first
    author's earlier code: without it the policy learns to vibrate its feet.
    """

    down: Feet
    """Feet that must touch."""

    up: Feet
    """Feet that must not touch; feet neither down nor up are free."""

    dwell: int = 0
    """Least number of control steps in the source state, the present one included; 0, 1: any."""

    def __post_init__(self):
        check_feet(self.down | self.up)
        if both := self.down & self.up:
            raise GaitshiftError(
                f"a foot must be in 'down' or in 'up', got {feet_text(both)} in both"
            )
        check_dwell(self.dwell)

    def holds_in(self, feet: Feet) -> bool:
        """Whether the guard holds when exactly these feet touch."""
        return self.down <= feet and not self.up & feet

    @property
    def labels(self) -> tuple[int, ...]:
        """The contact patterns in which the guard holds, in the numbers of `legs.label_of`."""
        low, high = feet_label(self.down), feet_label(self.up)
        return tuple(n for n in range(LABEL_COUNT) if n & low == low and not n & high)

    def pattern_shared_with(self, other: "Guard") -> Feet | None:
        """Feet of one contact pattern in which both guards hold, None where there is none."""
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
        """List the demands of the guard, for people."""
        lines = [f"{feet_text(self.down)} down"] if self.down else []
        lines += [f"{feet_text(self.up)} up"] if self.up else []
        return lines + ([f"after {self.dwell} steps"] if self.dwell > 1 else [])


def check_dwell(dwell: int) -> None:
    """Refuse a dwell below 0 or above `MOST_DWELL`, with a `GaitshiftError`."""
    if not 0 <= dwell <= MOST_DWELL:
        raise GaitshiftError(f"dwell must be 0 to {MOST_DWELL} control steps, got {dwell}")


_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, kw_only=True)
class State:
    """A state u of U, or of F where it is accepting (paper III-B)."""

    name: str
    """Letters, digits and underscores, unique in its machine."""

    stance: Feet
    """Feet on the ground in the stance that the state stands for; empty for a flight."""

    accepting: bool = False
    """Whether the run ends here; such a state has no outgoing edge and no stance."""

    def __post_init__(self):
        if not _NAME.fullmatch(self.name):
            raise GaitshiftError(
                f"name must be letters, digits and underscores, a letter first, got {self.name!r}"
            )
        check_feet(self.stance)
        if self.accepting and self.stance:
            raise GaitshiftError("an accepting state must not have a 'stance'; leave it out")

    def mirrored(self) -> "State":
        """Return the state of the robot seen in a mirror; feet in its name change too."""
        return State(
            name=mirrored_name(self.name),
            stance=mirrored_feet(self.stance),
            accepting=self.accepting,
        )

    def stance_text(self) -> str:
        """Say what the state stands for, for people."""
        return "the run ends" if self.accepting else f"{feet_text(self.stance)} down"

    def to_dict(self) -> dict[str, object]:
        """Return the table [[state]] of a gait file."""
        table: dict[str, object] = {"name": self.name}
        return table | (
            {"accepting": True} if self.accepting else {"stance": in_leg_order(self.stance)}
        )

    @classmethod
    def from_dict(cls, data: object, *, number: int) -> "State":
        """Read the table [[state]], the `number`-th of its file; raises `GaitshiftError`."""
        with located(f"state {number}"):
            table = Table(data, keys=("name", "stance", "accepting"))
            name = table.text("name")
        with located(f"state {number} ({name})"):
            accepting = table.flag("accepting", default=False)
            needs_stance = table.has("stance") or not accepting
            stance = table.feet("stance") if needs_stance else frozenset[str]()
            return cls(name=name, stance=stance, accepting=accepting)


MOST_SWING_HEIGHT = 0.3
"""Greatest swing height a file may ask for [m]. Ours: half of ANYmal's leg."""

_KEYS = ("from", "to", "down", "up", "dwell", "swing_height", "bonus")


@dataclass(frozen=True, kw_only=True)
class Transition:
    """One line of δu, from a state and the labels of a guard to a state (paper III-B)."""

    source: str
    """Name of the state that is left."""

    target: str
    """Name of the state that is reached."""

    guard: Guard
    """When the edge is taken."""

    bonus: float = 1.0
    """δr of the edge, as a multiplier of the bonus b that all edges share (paper III-C: 200)."""

    swing_height: float = 0.0
    """Height of the soles over the ground [m] that the feet that come down should reach in their
    swing; 0: any. A lower swing does not block the edge, but earns a smaller bonus. Ours, after the
    3 cm of RMLL: without it feet drag."""

    def __post_init__(self):
        if self.source == self.target:
            raise GaitshiftError(
                f"'from' and 'to' must be different states, got {self.source!r} for both"
            )
        if not math.isfinite(self.bonus):
            raise GaitshiftError(f"bonus must be a finite number, got {self.bonus}")
        check_swing_height(self.swing_height)

    def mirrored(self) -> "Transition":
        """Return the edge of the robot seen in a mirror."""
        return Transition(
            source=mirrored_name(self.source),
            target=mirrored_name(self.target),
            guard=self.guard.mirrored(),
            bonus=self.bonus,
            swing_height=self.swing_height,
        )

    def to_dict(self) -> dict[str, object]:
        """Return the table [[transition]] of a gait file, with all values explicit."""
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
    def from_dict(
        cls, data: object, *, number: int, dwell: int, swing_height: float
    ) -> "Transition":
        """Read the table [[transition]], the `number`-th of its file.

        Dwell [control steps] and swing height [m] are the file's defaults, for an edge without its
        own.
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
    """Refuse a swing height [m] below 0 or above `MOST_SWING_HEIGHT`, with a `GaitshiftError`."""
    if not 0 <= height <= MOST_SWING_HEIGHT:
        raise GaitshiftError(f"swing_height must be 0 to {MOST_SWING_HEIGHT} m, got {height:g}")
