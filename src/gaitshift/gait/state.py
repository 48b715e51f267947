"""One state of a machine: the stance set that was shown last."""

import re
from dataclasses import dataclass

from gaitshift.data import Table, located
from gaitshift.errors import GaitshiftError
from gaitshift.gait.feet import (
    Feet,
    check_feet,
    feet_text,
    in_leg_order,
    mirrored_feet,
    mirrored_name,
)

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")


@dataclass(frozen=True, kw_only=True)
class State:
    """A state u of U, or of F where it is accepting (paper III-B)."""

    name: str
    """Letters, digits and underscores, unique in its machine."""

    stance: Feet
    """Feet on the ground in the stance that the state stands for; empty for a flight."""

    accepting: bool = False
    """Whether the run ends here; such a state has no way out and stands for no stance."""

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
