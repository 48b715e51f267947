"""Controllers by their names on the command line: one file each, and a line here."""

from collections.abc import Sequence
from pkgutil import resolve_name
from typing import Protocol, runtime_checkable

from gaitshift.control.controller import Controller
from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import Robot


@runtime_checkable
class ControllerMaker(Protocol):
    """Makes a controller of n robots, all in the first of the gaits."""

    def __call__(self, gaits: Sequence[str], n: int, *, robot: Robot | None = None) -> Controller:
        """`gaits` are names, or files that the controller reads; `robot` is ANYmal B by default.

        Raises:
            GaitshiftError: a gait is unknown, or the controller cannot drive this robot.
        """
        ...


CONTROLLERS = {
    "policy": "gaitshift.control.driver:Driver.load",
    "cpg": "gaitshift.control.cpg:CpgController",
}
"""Makers of controllers: trained policies, and oscillators without learning. A maker is imported at
its first use."""


def controller_maker(name: str) -> ControllerMaker:
    """The maker of this name.

    Raises:
        GaitshiftError: there is none.
    """
    if name not in CONTROLLERS:
        raise GaitshiftError(known_names("controller", name, tuple(CONTROLLERS)))
    return resolve_name(CONTROLLERS[name])
