"""The public URDF of a robot of the package, in the wheel `example-robot-data`."""

from importlib import metadata
from pathlib import Path

from gaitshift.robot.description import Robot

WHEEL = "example-robot-data"
"""The wheel's name."""

_ROBOTS = "cmeel.prefix/share/example-robot-data/robots"
_FILES = {"anymal_b": "anymal_b_simple_description/robots/anymal.urdf"}
"""Robots whose URDF is in the wheel, by name."""

LEGS_BY_URDF = {"LF": "FL", "RF": "FR", "LH": "BL", "RH": "BR"}
"""Names of the legs here, by those in the URDF."""


def urdf_of(robot: Robot) -> Path | None:
    """The robot's URDF; None where the wheel is not installed or has none for this robot."""
    if robot.name not in _FILES:
        return None
    try:
        path = metadata.distribution(WHEEL).locate_file(f"{_ROBOTS}/{_FILES[robot.name]}")
    except metadata.PackageNotFoundError:
        return None
    return Path(str(path)) if Path(str(path)).is_file() else None
