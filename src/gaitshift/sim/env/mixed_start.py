"""An episode that begins in the midst of a stride that is no gait's: legs of several robots."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.robot.motion import Motion


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
    motion: Motion,
    last_action: Float[np.ndarray, "N 12"],
    touch_height: Float[np.ndarray, "N 4"],
    *,
    among: Int[np.ndarray, " M"],
    count: int,
    rng: np.random.Generator,
) -> MixedStart:
    """Puts robots together: the base of one that is on its way, and each leg of another.

    Any gait is one relation between the phases of four legs, so such starts hold what a robot finds
    whose gait was changed in the midst of a stride, whatever the gait before.

    Args:
        motion: of all robots at this instant.
        last_action: of all robots.
        touch_height: of all robots [m].
        among: robots that may be taken from.
        count: how many to put together.
        rng: draws whom.
    """
    base, leg = rng.choice(among, count), rng.choice(among, (count, 4))
    of_leg = (leg, np.arange(4))

    def legs_of(joints: Float[np.ndarray, "N 12"]) -> Float[np.ndarray, "K 12"]:
        return joints.reshape(-1, 4, 3)[of_leg].reshape(count, 12)

    return MixedStart(
        joint_position=legs_of(motion.joint_position),
        joint_velocity=legs_of(motion.joint_velocity),
        attitude=motion.base_quaternion_w[base],
        base_velocity_w=motion.base_linear_velocity_w[base],
        base_angular_velocity_b=motion.base_angular_velocity_b[base],
        yaw=motion.yaw[base],
        last_action=legs_of(last_action),
        touch_height=touch_height[of_leg],
        contact=motion.contact[of_leg],
    )
