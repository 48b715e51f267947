"""Simulations that diverge: what shows it, and the last second before it, for replay."""

import logging
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Float32, Int

from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.measurement import POSE, TWIST
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


_LOG = logging.getLogger(__name__)


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
        self.divergences: list[Divergence] = []
        """The first `MOST_KEPT` divergences; may be cleared."""
        self._logged = 0
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

    def keep(self, robot: int, terrain: Terrain) -> None:
        """Logs and keeps the divergence of a robot on its terrain, if it is one of the first."""
        steps = self._added - int(self._since[robot])
        if self._logged < MOST_KEPT:
            self._logged += 1
            _LOG.warning(
                "robot %d: its simulation diverged after %.2f s; it counts as failed and is "
                "restarted",
                robot,
                steps * CONTROL_PERIOD,
            )
        if len(self.divergences) < MOST_KEPT:
            self.divergences.append(self._divergence(robot, terrain, min(steps, _STEPS)))

    def _divergence(self, robot: int, terrain: Terrain, steps: int) -> Divergence:
        """The last steps of a robot."""
        entries = np.arange(self._added - steps, self._added) % _STEPS
        states = self._states[entries, robot]
        return Divergence(
            robot=robot,
            terrain=terrain,
            qpos=states[:, : POSE + 12],
            qvel=states[:, POSE + 12 :],
        )
