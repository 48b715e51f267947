"""An episode that begins in the midst of a stride that is no gait's: legs of several robots."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control.observation import GaitState
from gaitshift.robot.state import Privileged, Proprioception, rotation_of


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedStart:
    """K robots on their way."""

    joint_position: Float[np.ndarray, "K 12"]
    """[rad]"""
    joint_velocity: Float[np.ndarray, "K 12"]
    """[rad/s]"""
    attitude: Float[np.ndarray, "K 4"]
    """Of the base, with its heading (w, x, y, z)."""
    base_velocity_w: Float[np.ndarray, "K 3"]
    """[m/s]"""
    base_angular_velocity_b: Float[np.ndarray, "K 3"]
    """[rad/s]"""
    yaw: Float[np.ndarray, " K"]
    """The heading [rad]."""
    last_action: Float[np.ndarray, "K 12"]
    """Of the robots that the legs are taken from."""
    touch_height: Float[np.ndarray, "K 4"]
    """At which those feet last touched, from the base [m]."""
    contact: Bool[np.ndarray, "K 4"]
    """Which of those feet are down."""


def mix(
    sensed: Proprioception,
    truth: Privileged,
    state: GaitState,
    *,
    among: Int[np.ndarray, " M"],
    count: int,
    rng: np.random.Generator,
) -> MixedStart:
    """Puts robots together: the base of one that is on its way, and each leg of another.

    Any gait is one relation between the phases of four legs, so such starts hold what a robot finds
    whose gait was changed in the midst of a stride, whatever the gait before.

    Args:
        sensed: what all robots sense at this instant.
        truth: what the simulator knows of it.
        state: where all robots are in their gait.
        among: robots that may be taken from.
        count: how many to put together.
        rng: draws whom.
    """
    base, leg = rng.choice(among, count), rng.choice(among, (count, 4))
    of_leg = (leg, np.arange(4))

    def legs_of(joints: Float[np.ndarray, "N 12"]) -> Float[np.ndarray, "K 12"]:
        return joints.reshape(-1, 4, 3)[of_leg].reshape(count, 12)

    attitude = truth.base_quaternion_w[base]
    return MixedStart(
        joint_position=legs_of(sensed.need("joint_position", "a mixed start")),
        joint_velocity=legs_of(sensed.need("joint_velocity", "a mixed start")),
        attitude=attitude,
        base_velocity_w=np.einsum("kij,kj->ki", rotation_of(attitude), truth.velocity_b[base]),
        base_angular_velocity_b=sensed.need("angular_velocity_b", "a mixed start")[base],
        yaw=sensed.yaw[base],
        last_action=legs_of(state.last_action),
        touch_height=state.touch_height[of_leg],
        contact=sensed.contact[of_leg],
    )
