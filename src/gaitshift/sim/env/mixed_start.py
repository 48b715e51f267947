"""Episodes that start in mid-stride, with the legs of different robots."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control.observation import GaitState
from gaitshift.gait import RewardMachine
from gaitshift.robot.state import Privileged, Proprioception, rotation_of
from gaitshift.sim.world import World


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedStart:
    """State of K robots in mid-stride."""

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
    """Of the robots from which the legs are copied."""
    touch_height: Float[np.ndarray, "K 4"]
    """Height above the base at which those feet last touched [m]."""
    contact: Bool[np.ndarray, "K 4"]
    """Which of those feet are down."""

    def place(self, world: World, ids: Int[np.ndarray, " K"], yaw: Float[np.ndarray, " K"]) -> None:
        """Puts robots `ids`, where they stand, into these states, with headings `yaw` [rad]."""
        turn = yaw - self.yaw
        c, s, (x, y, z) = np.cos(turn), np.sin(turn), self.base_velocity_w.T
        world.place(
            ids,
            xy=world.truth.base_position_w[ids, :2],
            yaw=turn,
            attitude=self.attitude,
            joint_position=self.joint_position,
            joint_velocity=self.joint_velocity,
            base_velocity_w=np.stack((c * x - s * y, s * x + c * y, z), axis=-1),
            base_angular_velocity_b=self.base_angular_velocity_b,
        )

    def gait_state(self, machine: RewardMachine) -> GaitState:
        """The state of a gait that begins here, in the state that fits the contacts best."""
        return GaitState(
            machine_state=machine.enter(self.contact),
            steps_in_state=np.zeros(len(self.contact), dtype=np.int64),
            last_action=self.last_action,
            touch_height=self.touch_height,
        )


def mix(
    sensed: Proprioception,
    truth: Privileged,
    state: GaitState,
    *,
    among: Int[np.ndarray, " M"],
    count: int,
    rng: np.random.Generator,
) -> MixedStart:
    """Combines the base of one walking robot with each leg of another.

    A gait is a relation between the phases of the four legs. Legs with random phases therefore
    cover the states after a shift in mid-stride from any other gait.

    Args:
        sensed: proprioception of all robots at this instant.
        truth: privileged state at the same instant.
        state: gait state of all robots.
        among: robots that may be copied from.
        count: number of states to make.
        rng: draws the robots.
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
