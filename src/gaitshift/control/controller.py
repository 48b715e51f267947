"""The interface of controllers, learned or not, their gaits, and controllers by name."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.robot.command import Command
from gaitshift.robot.description import Robot
from gaitshift.robot.state import Proprioception


@dataclass(frozen=True, kw_only=True, eq=False)
class Repertoire:
    """G gaits in a fixed order; robots carry an index into it."""

    gaits: tuple[str, ...]
    """Their names."""
    machines: tuple[RewardMachine, ...]
    """Their machines."""
    forward_speed: Float[np.ndarray, " G"]
    """Their nominal speeds [m/s]."""
    stride_frequency: Float[np.ndarray, " G"]
    """Their nominal cycles a second [Hz]."""
    body_height: Float[np.ndarray, " G"] | None = None
    """Their nominal body heights, from that of the stance [m]; None: all 0."""

    def index(self, gait: str) -> int:
        """Index of a gait.

        Raises:
            GaitshiftError: it is not among them.
        """
        if gait not in self.gaits:
            raise GaitshiftError(known_names("gait", gait, self.gaits))
        return self.gaits.index(gait)

    def groups(self, gait: Int[np.ndarray, " N"]) -> Iterator[tuple[int, Int[np.ndarray, " K"]]]:
        """The gaits in use, each with the robots that are in it."""
        if (gait == gait[0]).all():
            yield int(gait[0]), np.arange(len(gait))
            return
        for index in np.unique(gait).tolist():
            yield index, np.flatnonzero(gait == index)

    def own_command(self, gait: Int[np.ndarray, " N"]) -> Command:
        """Straight ahead, at the nominal speed, frequency and height of each robot's gait."""
        height = np.zeros(len(self.gaits)) if self.body_height is None else self.body_height
        return Command(
            forward_speed=self.forward_speed[gait],
            yaw_rate=np.zeros(len(gait)),
            stride_frequency=self.stride_frequency[gait],
            body_height=height[gait],
        )

    def stance_shown(
        self, gait: Int[np.ndarray, " N"], contact: Bool[np.ndarray, "N 4"]
    ) -> Bool[np.ndarray, " N"]:
        """Whether the feet in contact are a stance set of each robot's gait."""
        shown = np.empty(len(gait), dtype=bool)
        for index, ids in self.groups(gait):
            shown[ids] = self.machines[index].shows_stance(contact[ids])
        return shown


@runtime_checkable
class Controller(Protocol):
    """N robots, each in one of several gaits."""

    n: int
    """Robots."""
    repertoire: Repertoire
    """The available gaits."""
    gait: Int[np.ndarray, " N"]
    """Index into the repertoire of the gait that each robot is in."""

    @property
    def machine_state(self) -> Int[np.ndarray, " N"]:
        """State of that gait's machine, for logs; 0 where there is none."""
        ...

    @property
    def robot(self) -> Robot:
        """The robot that it drives."""
        ...

    @property
    def gains(self) -> str:
        """The preset of joint gains that it needs."""
        ...

    def act(self, sensed: Proprioception, command: Command) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] for the next control step."""
        ...

    def see(self, sensed: Proprioception, command: Command) -> None:
        """Updates the state by proprioception after a step and the command during the step."""
        ...

    def switch(self, ids: Int[np.ndarray, " K"], gait: str, sensed: Proprioception) -> None:
        """Changes the gait of robots `ids` at once."""
        ...

    def value(self) -> Float[np.ndarray, " N"] | None:
        """Value of its critic at the observation of the last action; None without a critic."""
        ...


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
"""Makers of controllers: trained policies, and oscillators without learning. A new controller is a
file, and its line here. A maker is imported at its first use."""


def controller_maker(name: str) -> ControllerMaker:
    """The maker of this name.

    Raises:
        GaitshiftError: there is none.
    """
    if name not in CONTROLLERS:
        raise GaitshiftError(known_names("controller", name, tuple(CONTROLLERS)))
    return resolve_name(CONTROLLERS[name])
