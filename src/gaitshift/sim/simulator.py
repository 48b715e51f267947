"""The interface of simulators, what they all have in common, and simulators by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float, Int

from gaitshift.data import known_names
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import Robot
from gaitshift.robot.state import Privileged, Proprioception
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.terrain import Terrain

FRICTION = 0.8
"""Sliding friction between a robot and the ground, as in the robot's URDF."""


@runtime_checkable
class Simulator(Protocol):
    """N robots, each alone on its terrain; with K terrains, robot i stands on terrain i mod K.

    Nothing moves between calls. `sensed` and `truth` describe the present state without delay;
    `sensed` has the errors of the sensors.
    """

    n: int
    """Robots."""
    robot: Robot
    """Whose model is simulated."""
    terrains: tuple[Terrain, ...]
    """The grounds, at most N."""
    sensed: Proprioception
    """What the robots sense."""
    truth: Privileged
    """What only a simulator knows."""

    def place(
        self,
        ids: Int[np.ndarray, " K"],
        *,
        xy: Float[np.ndarray, "K 2"],
        yaw: Float[np.ndarray, " K"],
        joint_position: Float[np.ndarray, "K 12"] | None = None,
    ) -> None:
        """Sets robots down at rest at `xy` [m] and `yaw` [rad], the lowest foot on the ground.

        Joints are at `joint_position` [rad], or in the stance.
        """
        ...

    def push(self, force_w: Float[np.ndarray, "N 3"]) -> None:
        """Forces on the base origins, world frame [N], until the next call or `place`."""
        ...

    def step(self, target: Float[np.ndarray, "N 12"]) -> tuple[Proprioception, Privileged]:
        """One control step of 10 ms in which the joints are driven to `target` [rad].

        Returns `sensed` and `truth`. A robot whose simulation diverges is set down again, and
        `truth.diverged` marks it.
        """
        ...


@runtime_checkable
class SimulatorMaker(Protocol):
    """Makes a simulator of n robots in their stance at the origin."""

    def __call__(
        self,
        robot: Robot,
        terrain: Terrain | Sequence[Terrain],
        n: int,
        *,
        gains: str = "default",
        sensors: SensorConfig = PERFECT,
        seed: int = 0,
    ) -> Simulator:
        """`gains` is a preset of `robot.gains`, `seed` that of the errors of the sensors.

        Raises:
            GaitshiftError: the simulator is not installed, or cannot simulate this robot.
        """
        ...


SimulatorName = Literal["mujoco", "pybullet"]
"""Names of simulators."""


@dataclass(frozen=True, kw_only=True)
class SimulatorChoice:
    """For settings of runs that either simulator can do."""

    simulator: SimulatorName = "mujoco"
    """What simulates the robots: `mujoco`, in which policies are trained, or `pybullet`, with
    contacts of its own and ANYmal B's public URDF (extra `sim2sim`)."""


SIMULATORS: dict[str, str] = {
    "mujoco": "gaitshift.sim.world:World",
    "pybullet": "gaitshift.sim.bullet:BulletWorld",
}
"""Makers of simulators; each is imported at its first use."""


def simulator_maker(name: str) -> SimulatorMaker:
    """The maker of this name.

    Raises:
        GaitshiftError: there is none.
    """
    if name not in SIMULATORS:
        raise GaitshiftError(known_names("simulator", name, tuple(SIMULATORS)))
    return resolve_name(SIMULATORS[name])
