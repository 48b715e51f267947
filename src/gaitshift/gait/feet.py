"""Sets of feet by name: what a state shows and what a guard asks for."""

from gaitshift.errors import GaitshiftError
from gaitshift.robot.legs import LEGS, MIRRORED_LEGS

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
