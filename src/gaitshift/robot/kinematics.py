"""Kinematics of the legs of any robot: where its feet are at given joint angles."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import Robot
from gaitshift.robot.legs import LEGS

_AGREES = 1e-6
"""Largest difference from the model's own kinematics [m]; ours: rounding is far below."""


@dataclass(frozen=True, kw_only=True, eq=False)
class LegKinematics:
    """Four legs, each a chain of three hinges, by the pose of their joints at angle 0.

    Each joint turns what hangs on it about its axis: a product of exponentials (Brockett 1984).
    """

    axis: Float[np.ndarray, "4 3 3"]
    """Unit vectors along the axes, legs × (HAA, HFE, KFE), body frame."""
    anchor: Float[np.ndarray, "4 3 3"]
    """A point on each axis, body frame [m]."""
    foot: Float[np.ndarray, "4 3"]
    """Middle of each foot, body frame [m]."""

    @classmethod
    def of(cls, robot: Robot) -> "LegKinematics":
        """The legs of a robot's model.

        Raises:
            GaitshiftError: a leg is no chain of three hinges.
        """
        import mujoco  # not needed by a robot whose legs are known

        model = robot.spec(robot.gains_of("default")).compile()
        data = mujoco.MjData(model)

        def feet_at(angles: Float[np.ndarray, " 12"]) -> Float[np.ndarray, "4 3"]:
            data.qpos[:] = [0, 0, 0, 1, 0, 0, 0, *angles]
            mujoco.mj_kinematics(model, data)
            return np.array([data.site(f"{leg}_foot").xpos for leg in LEGS])

        foot = feet_at(np.zeros(12))
        axis, anchor = data.xaxis[1:].reshape(4, 3, 3), data.xanchor[1:].reshape(4, 3, 3)
        legs = cls(axis=axis.copy(), anchor=anchor.copy(), foot=foot)
        posed = robot.stance_angles + np.linspace(-0.3, 0.3, 12)
        if not np.abs(legs.foot_centre_b(posed) - feet_at(posed)).max() < _AGREES:
            raise GaitshiftError(
                f"robot {robot.name}: each leg must be a chain of three hinges from base to foot"
            )
        return legs

    def foot_centre_b(
        self, joint_position: Float[np.ndarray, "*batch 12"]
    ) -> Float[np.ndarray, "*batch 4 3"]:
        """Middle of each foot, body frame [m], at these joint angles [rad]."""
        angle = joint_position.reshape(*joint_position.shape[:-1], 4, 3, 1)
        sine, versine = np.sin(angle), 1.0 - np.cos(angle)
        cross, point = self._cross, self.foot
        for joint in (2, 1, 0):
            arm = point - self.anchor[:, joint]
            across = np.einsum("lij,...lj->...li", cross[:, joint], arm)
            back = np.einsum("lij,...lj->...li", cross[:, joint], across)
            turned = arm + sine[..., joint, :] * across + versine[..., joint, :] * back
            point = self.anchor[:, joint] + turned
        return point

    @cached_property
    def _cross(self) -> Float[np.ndarray, "4 3 3 3"]:
        """Matrices of the cross products with the axes."""
        return np.cross(self.axis[..., None, :], np.eye(3)).swapaxes(-1, -2)
