"""Robots that are not all alike: friction, payload, motors, gains and softness of the ground.

Each robot has a model of its own, which is drawn anew in place, so that the physics goes on with
it. Delay and noise belong to the sensors (`gaitshift.sim.sensors`).
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, fields

import mujoco
import numpy as np
from jaxtyping import Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.sim.simulator import FRICTION

BASE = 1
"""Index of the base among the bodies of a model: the first after the world."""

RESISTANCE, KP, KD = 0, 4, 6
"""Entries of the gains of MuJoCo's DC motor: R/K², and the gains of its position controller."""

Range = tuple[float, float]
"""Least and greatest value; a robot's own is drawn uniformly between them."""

ALLOWED: dict[str, Range] = {
    "friction": (0.01, 5.0),
    "payload": (-20.0, 100.0),
    "payload_x": (-1.0, 1.0),
    "payload_y": (-1.0, 1.0),
    "strength": (0.05, 10.0),
    "kp": (0.05, 10.0),
    "kd": (0.0, 10.0),
    "softness": (1.0, 20.0),
}
"""Values that may be drawn; ours: far beyond those that a robot meets."""


@dataclass(frozen=True, kw_only=True)
class Randomisation:
    """Ranges of what differs from robot to robot; by default nothing does."""

    friction: Range = (FRICTION, FRICTION)
    """Sliding friction between robot and ground; the default leaves that of the robot's model."""
    payload: Range = (0.0, 0.0)
    """Mass on the base, a point at the height of its centre of mass; below 0 the base is lighter
    [kg]."""
    payload_x: Range = (0.0, 0.0)
    """Place of the payload, forward of the centre of mass of the base [m]."""
    payload_y: Range = (0.0, 0.0)
    """Place of the payload, to the left of the centre of mass of the base [m]."""
    strength: Range = (1.0, 1.0)
    """Factor on the torque of the motors, at the limit and at rest."""
    kp: Range = (1.0, 1.0)
    """Factor on kp."""
    kd: Range = (1.0, 1.0)
    """Factor on kd."""
    softness: Range = (1.0, 1.0)
    """Factor on the time constant of contacts: at 1 the ground is as hard as the physics step
    allows."""

    def __post_init__(self) -> None:
        for name, value in self.ranges().items():
            low, high = ALLOWED[name]
            if not (len(value) == 2 and low <= value[0] <= value[1] <= high):
                raise GaitshiftError(
                    f"{name} must be two numbers, rising, within {low:g} to {high:g}, got "
                    f"{list(value)}"
                )

    def ranges(self) -> dict[str, Range]:
        """The ranges by name."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @property
    def varies(self) -> bool:
        """Whether any robot may differ from its model."""
        return bool(self != SAME)


SAME = Randomisation()
"""Robots that are all alike."""

ALIKE: Float[np.ndarray, " 8"] = np.array([least for least, _ in SAME.ranges().values()])
"""What a robot has that differs in nothing, in the order of the ranges."""


class Models:
    """A model for each robot, drawn anew in place."""

    def __init__(
        self,
        nominal: Sequence[mujoco.MjModel],
        n: int,
        config: Randomisation,
        before: "Models | None" = None,
    ) -> None:
        """Robot i has a copy of model i mod K of the K nominal ones.

        What was drawn for the robots `before`, on another ground, stays; else nothing differs yet.
        """
        self.config = config
        self._nominal = [nominal[i % len(nominal)] for i in range(n)]
        self.each = [copy(model) for model in self._nominal]
        """The model of each robot."""
        self.drawn = np.tile(ALIKE, (n, 1))
        """What was drawn for each robot, as (n, 8) in the order of the ranges."""
        self._is_drawn = np.zeros(n, dtype=bool)
        self._data = mujoco.MjData(nominal[0])
        (self._own,) = np.nonzero(nominal[0].geom_bodyid)
        if before is not None:
            for robot in map(int, np.flatnonzero(before._is_drawn)):
                self._set(robot, before.drawn[robot])

    def draw(
        self, ids: Int[np.ndarray, " K"], rng: np.random.Generator, share: float = 1.0
    ) -> None:
        """Draws the robots `ids` anew, in this order.

        `share` shrinks all ranges towards the values of a robot that differs in nothing, 0 to 1.
        """
        ranges: Float[np.ndarray, "8 2"] = np.array(list(self.config.ranges().values()))
        for robot in map(int, ids):
            drawn = rng.uniform(ranges[:, 0], ranges[:, 1])
            self._set(robot, ALIKE + share * (drawn - ALIKE))

    def _set(self, robot: int, values: Float[np.ndarray, " 8"]) -> None:
        self.drawn[robot], self._is_drawn[robot] = values, True
        drawn = dict(zip(self.config.ranges(), values, strict=True))
        model, nominal = self.each[robot], self._nominal[robot]
        if self.config.friction != SAME.friction:
            model.geom_friction[self._own, 0] = drawn["friction"]
        model.geom_solref[self._own, 0] = drawn["softness"] * nominal.geom_solref[self._own, 0]
        model.actuator_gainprm[:, KP] = drawn["kp"] * nominal.actuator_gainprm[:, KP]
        model.actuator_gainprm[:, KD] = drawn["kd"] * nominal.actuator_gainprm[:, KD]
        strength = drawn["strength"]
        model.actuator_gainprm[:, RESISTANCE] = nominal.actuator_gainprm[:, RESISTANCE] / strength
        model.actuator_forcerange[:] = strength * nominal.actuator_forcerange
        place = np.array([drawn["payload_x"], drawn["payload_y"], 0.0])
        _load(model, nominal, drawn["payload"], place)
        mujoco.mj_setConst(model, self._data)


def _load(
    model: mujoco.MjModel,
    nominal: mujoco.MjModel,
    mass: float,
    place: Float[np.ndarray, " 3"],
) -> None:
    """Adds a point mass [kg] to the base, at a place from its centre of mass [m].

    By the parallel-axis theorem for two bodies, with the reduced mass.
    """
    if mass == 0:
        for name in ("body_mass", "body_ipos", "body_inertia", "body_iquat"):
            getattr(model, name)[BASE] = getattr(nominal, name)[BASE]
        return
    own = float(nominal.body_mass[BASE])
    if own + mass <= 0:
        raise GaitshiftError(f"payload must leave the base a mass above 0, got {mass:g} kg")
    turn = np.zeros(9)
    mujoco.mju_quat2Mat(turn, nominal.body_iquat[BASE])
    axes = turn.reshape(3, 3)
    reduced = own * mass / (own + mass)
    inertia = axes @ np.diag(nominal.body_inertia[BASE]) @ axes.T
    inertia += reduced * (place @ place * np.eye(3) - np.outer(place, place))
    principal, directions = np.linalg.eigh(inertia)
    if principal[0] <= 0 or principal[2] > principal[0] + principal[1]:
        raise GaitshiftError(
            f"payload must leave the base a possible inertia, got {mass:g} kg at {place[0]:g}, "
            f"{place[1]:g} m"
        )
    directions[:, 2] *= np.linalg.det(directions)  # right-handed
    quaternion = np.zeros(4)
    mujoco.mju_mat2Quat(quaternion, directions.ravel())
    model.body_mass[BASE] = own + mass
    model.body_ipos[BASE] = nominal.body_ipos[BASE] + place * mass / (own + mass)
    model.body_inertia[BASE] = principal
    model.body_iquat[BASE] = quaternion
