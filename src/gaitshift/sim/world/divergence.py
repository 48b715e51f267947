"""Simulations that diverge: what shows it, and the last second before it, for replay."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Float32, Int

from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.sensors import POSE, TWIST
from gaitshift.sim.terrain import Terrain

DIVERGED = slice(int(mujoco.mjtWarning.mjWARN_BADQPOS), int(mujoco.mjtWarning.mjWARN_BADQACC) + 1)
"""MuJoCo's warnings of positions, velocities and accelerations that are not finite or above 1e10,
after which it resets a robot."""

FASTEST = 1000.0
"""Greatest velocity of a base or joint [m/s, rad/s]; ours: ten times what full torque gives a free
shank, and far below MuJoCo's own limit, so that no later step starts from such a state."""

MOST_KEPT = 8
"""Most divergences that are kept and logged; ours: enough to see a cause, 15 kB each."""

_STEPS = round(1.0 / CONTROL_PERIOD)
"""Length of what is kept: one second [control steps]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Divergence:
    """The last second of a robot before its simulation diverged."""

    robot: int
    """Number of the robot in its world."""
    terrain: Terrain
    """The ground that it stood on."""
    qpos: Float32[np.ndarray, "T 19"]
    """MuJoCo's positions before each control step, at most a second: m, quaternion, rad."""
    qvel: Float32[np.ndarray, "T 18"]
    """MuJoCo's velocities at the same times: m/s, rad/s."""


class History:
    """The states of N robots in the last second: a ring, in single precision."""

    def __init__(self, n: int) -> None:
        self._states: Float32[np.ndarray, "T N 37"] = np.zeros(
            (_STEPS, n, POSE + TWIST + 24), dtype=np.float32
        )
        self._added = 0
        self._since: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)

    def add(self, qpos: Float[np.ndarray, "N 19"], qvel: Float[np.ndarray, "N 18"]) -> None:
        """Adds the present states of all robots."""
        entry = self._states[self._added % _STEPS]
        entry[:, : POSE + 12], entry[:, POSE + 12 :] = qpos, qvel
        self._added += 1

    def forget(self, ids: Int[np.ndarray, " K"]) -> None:
        """Robots that are placed anew have no past."""
        self._since[ids] = self._added

    def steps_of(self, robot: int) -> int:
        """States added since the robot was placed."""
        return self._added - int(self._since[robot])

    def divergence(self, robot: int, terrain: Terrain) -> Divergence:
        """The last second of a robot, or what there is since it was placed."""
        steps = min(self.steps_of(robot), _STEPS)
        entries = np.arange(self._added - steps, self._added) % _STEPS
        states = self._states[entries, robot]
        return Divergence(
            robot=robot,
            terrain=terrain,
            qpos=states[:, : POSE + 12],
            qvel=states[:, POSE + 12 :],
        )
