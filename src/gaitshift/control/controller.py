"""The interface of a controller, learned or not, for rollouts, conditions and switchers."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from gaitshift.control.repertoire import Repertoire
from gaitshift.robot.command import Command
from gaitshift.robot.description import Robot
from gaitshift.robot.state import Proprioception


@runtime_checkable
class Controller(Protocol):
    """N robots, each in one of several gaits."""

    n: int
    """Robots."""
    repertoire: Repertoire
    """The gaits that it knows."""
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
