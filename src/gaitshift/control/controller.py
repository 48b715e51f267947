"""What drives robots, learned or not: the face that rollouts, conditions and switchers know."""

from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.robot.command import Command
from gaitshift.robot.description import Robot
from gaitshift.robot.motion import Motion


@runtime_checkable
class Controller(Protocol):
    """N robots, each in one of several gaits."""

    n: int
    """Robots."""
    gaits: tuple[str, ...]
    """Names of the gaits."""
    gait: Int[np.ndarray, " N"]
    """Index into `gaits` of the gait that each robot is in."""
    machine_state: Int[np.ndarray, " N"]
    """State of that gait's machine, for logs; 0 where there is none."""

    @property
    def robot(self) -> Robot:
        """The robot that it drives."""
        ...

    @property
    def gains(self) -> str:
        """The preset of joint gains that it counts on."""
        ...

    def act(self, motion: Motion, command: Command) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] for the next control step."""
        ...

    def see(self, motion: Motion, command: Command) -> None:
        """Takes in the motion after a step, and the command that robots acted on in it."""
        ...

    def switch(self, ids: Int[np.ndarray, " K"], gait: str, motion: Motion) -> None:
        """Robots `ids` take up another gait at once."""
        ...

    def value(self) -> Float[np.ndarray, " N"] | None:
        """What its critic expected from what robots acted on last; None where there is none."""
        ...

    def own_command(self) -> Command:
        """Straight ahead, at the nominal speed and stride frequency of each robot's gait."""
        ...

    def stance_shown(self, motion: Motion) -> Bool[np.ndarray, " N"]:
        """Whether the feet in contact are a stance set of each robot's present gait."""
        ...
