"""The reward: Table I term by term, our additions, the machine's bonus, and swings that earn it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, Step
from gaitshift.robot.command import Command
from gaitshift.robot.state import Privileged, Proprioception

BonusMode = Literal["add", "multiply_clipped", "multiply"]
BONUS_MODES: tuple[BonusMode, ...] = ("add", "multiply_clipped", "multiply")

TRACKING_WIDTH = 0.25
"""Width of `speed_tracking` [m/s]; ours: about the swing of v_x within a stride."""

HEIGHT_WIDTH = 0.05
"""Width of `height_tracking` [m]; ours: beyond it a step of the ground is no reason to fall."""

ADDITIONS = (
    "speed_tracking",
    "lateral_tracking",
    "height_tracking",
    "stance_feet",
    "stance_pattern",
    "slip",
    "power",
    "chatter",
    "action_rate",
)
"""The terms that are ours; all others are those of Table I."""

SHARES = ("stance_punctuality", "bonus_swing", "bonus_punctuality")
"""Settings by which stances and bonus depend on swing height and punctuality; ours."""

RewardTerms = dict[str, Float[np.ndarray, " N"]]
"""The weighted terms of R_walk by name, each (N,)."""


@dataclass(frozen=True, kw_only=True)
class RewardConfig:
    """Weights of the reward. One reward for all gaits (paper III-C)."""

    forward_velocity: float = 10.0
    """Times exp(-(v_d - v_x)²) [s²/m²] (Table I)."""
    lateral_velocity: float = -10.0
    """Times (v_y - commanded v_y)² + v_z² [s²/m²] (Table I, where the command is always 0)."""
    roll_pitch_rate: float = -0.1
    """Times ω_x² + ω_y² [s²] (Table I)."""
    yaw_rate: float = -25.0
    """Times (ω_z - commanded ω_z)² [s²] (Table I, where the command is always 0)."""
    torque: float = -4e-5
    """Times ‖τ‖² [1/(N·m)²] (Table I)."""
    joint_position: float = -0.1
    """Times ‖q - q_init‖² (Table I)."""
    joint_velocity: float = -0.01
    """Times ‖q̇‖² [s²] (Table I)."""
    speed_tracking: float = 15.0
    """Times exp(-((v_d - v_x) / 0.25 m/s)²); ours: the term of Table I is so wide that a walk at
    1 m/s in place of 1.2 m/s loses only 4 % of it."""
    lateral_tracking: float = 10.0
    """Times exp(-((commanded v_y - v_y) / 0.25 m/s)²), in gaits for which a lateral speed may be
    commanded; ours: the term of Table I alone is too small to be worth a step aside."""
    height_tracking: float = 8.0
    """Times exp(-((commanded height - height) / 0.05 m)²), the height of the base over the lowest
    foot, in gaits for which a height may be commanded; ours."""
    stance_feet: float = 12.0
    """Times the share of the feet whose contact agrees with the stance of the present state; ours:
    the bonus rewards only the instant of a change, this term each foot at every step."""
    stance_pattern: float = 12.0
    """Where that share is 1; ours: without it three correct feet out of four are good enough."""
    stance_punctuality: float = 0.0
    """Share of these two terms that depends on punctuality, times the environment's strictness;
    ours: at 1 a stance that is held for too long earns nothing, where a slow walk would stand."""
    slip: float = -0.5
    """Times Σ v_xy² of the feet in contact [s²/m²]; ours: feet that stand should stand still."""
    power: float = -0.0225
    """Times Σ|τ q̇| [1/W]; ours: the power in the cost of transport, unlike ‖τ‖² and ‖q̇‖²."""
    chatter: float = -80.0
    """Times the number of feet that come down out of place (twice in a swing, or states too early),
    times the environment's strictness; ours: one touchdown a swing costs nothing, at any
    frequency."""
    action_rate: float = -0.02
    """Times ‖a - a_last‖²; ours: smooth targets."""
    bonus: float = 200.0
    """b, paid when the machine changes its state (paper III-C)."""
    bonus_swing: float = 1.0
    """Share of the bonus that depends on the height of the swing, times the environment's
    strictness; ours: without it feet drag."""
    bonus_punctuality: float = 1.0
    """Share of the bonus that depends on punctuality, times the environment's strictness; ours: it
    keeps strides at the commanded frequency and their halves equally long."""
    bonus_mode: BonusMode = "add"
    """How b is combined with R_walk; ours is `add`, because `multiply` penalises a good change
    while R_walk is negative (docs/paper.md)."""

    def __post_init__(self) -> None:
        if self.bonus_mode not in BONUS_MODES:
            raise GaitshiftError(
                f"bonus_mode must be one of {', '.join(BONUS_MODES)}, got '{self.bonus_mode}'"
            )

    @classmethod
    def paper(cls, bonus_mode: BonusMode = "add") -> "RewardConfig":
        """Table I and b = 200 alone."""
        return cls(**dict.fromkeys((*ADDITIONS, *SHARES), 0.0), bonus_mode=bonus_mode)


def walk_reward(
    config: RewardConfig,
    sensed: Proprioception,
    truth: Privileged,
    command: Command,
    *,
    stance: Float[np.ndarray, " 12"],
    steps_aside: bool = False,
    height_error: Float[np.ndarray, " N"] | None = None,
    agreement: Float[np.ndarray, " N"],
    in_time: Float[np.ndarray, " N"] | float = 1.0,
    chatter: Float[np.ndarray, " N"],
    action_change: Float[np.ndarray, "N 12"],
    stance_factor: float = 1.0,
    penalty_scale: float = 1.0,
) -> RewardTerms:
    """R_walk, term by term (Table I and the additions).

    Args:
        config: the weights.
        sensed: proprioception after the step.
        truth: privileged state after the step.
        command: the command during the step.
        stance: q_init [rad].
        steps_aside: whether a lateral speed may be commanded.
        height_error: height of the base minus the commanded height [m]; None where none may be
            commanded.
        agreement: share of the feet whose contact agrees with the stance of the machine's state.
        in_time: factor on the terms of the stance, below 1 where it is held for too long.
        chatter: number of feet that came down out of place, times the present strictness.
        action_change: action minus the action before it.
        stance_factor: factor on the weight of the whole stance.
        penalty_scale: factor λ on the penalties, the terms of negative weight (paper III-D).
    """
    velocity = truth.velocity_b
    rate = sensed.need("angular_velocity_b", "the reward")
    torque, joint_position, joint_velocity = (
        sensed.need(f"joint_{name}", "the reward") for name in ("torque", "position", "velocity")
    )
    speed_error_squared = np.square(command.forward_speed - truth.forward_speed)
    side_error_squared = np.square(velocity[:, 1] - command.lateral_speed)
    foot_speed_squared = _squares(truth.foot_velocity_w[..., :2])
    terms = {
        "forward_velocity": config.forward_velocity * np.exp(-speed_error_squared),
        "lateral_velocity": config.lateral_velocity
        * (side_error_squared + np.square(velocity[:, 2])),
        "roll_pitch_rate": config.roll_pitch_rate * _squares(rate[:, :2]),
        "yaw_rate": config.yaw_rate * np.square(rate[:, 2] - command.yaw_rate),
        "torque": config.torque * _squares(torque),
        "joint_position": config.joint_position * _squares(joint_position - stance),
        "joint_velocity": config.joint_velocity * _squares(joint_velocity),
        "speed_tracking": config.speed_tracking * np.exp(-speed_error_squared / TRACKING_WIDTH**2),
        "lateral_tracking": config.lateral_tracking
        * steps_aside
        * np.exp(-side_error_squared / TRACKING_WIDTH**2),
        "height_tracking": np.zeros(len(velocity))
        if height_error is None
        else config.height_tracking * np.exp(-np.square(height_error / HEIGHT_WIDTH)),
        "stance_feet": config.stance_feet * in_time * agreement,
        "stance_pattern": stance_factor * config.stance_pattern * in_time * (agreement == 1.0),
        "slip": config.slip * (foot_speed_squared * sensed.contact).sum(axis=1),
        "power": config.power * sensed.power,
        "chatter": config.chatter * chatter,
        "action_rate": config.action_rate * _squares(action_change),
    }
    if penalty_scale == 1.0:
        return terms
    return {
        name: penalty_scale * term if getattr(config, name) < 0 else term
        for name, term in terms.items()
    }


def earned_bonus(
    config: RewardConfig,
    bonus: Float[np.ndarray, " N"],
    *,
    swing_share: Float[np.ndarray, " N"],
    on_time: Float[np.ndarray, " N"],
    strictness: float,
) -> Float[np.ndarray, " N"]:
    """The edges' factors of the bonus, reduced for low swings and late changes.

    Args:
        config: the weights.
        bonus: the edge's own factor, 0 where the machine stayed.
        swing_share: share of the swing height that was reached, in [0, 1].
        on_time: punctuality of the change, in [0, 1].
        strictness: how far the bonus depends on both, in [0, 1].
    """
    swing = 1.0 - strictness * config.bonus_swing * (1.0 - swing_share)
    return bonus * swing * (1.0 - strictness * config.bonus_punctuality * (1.0 - on_time))


def with_bonus(
    config: RewardConfig, walk: Float[np.ndarray, " N"], bonus: Float[np.ndarray, " N"]
) -> Float[np.ndarray, " N"]:
    """The reward after δr: R_walk combined with b times `bonus` where the machine changed state.

    `add` adds b, `multiply` multiplies R_walk by b, `multiply_clipped` multiplies max(R_walk, 0).
    `bonus` is the edge's own factor, 0 where the machine stayed.
    """
    paid = config.bonus * bonus
    if config.bonus_mode == "add":
        return walk + paid
    base = np.maximum(walk, 0.0) if config.bonus_mode == "multiply_clipped" else walk
    return np.where(bonus > 0, base * paid, walk)


def _squares(x: Float[np.ndarray, "*batch n"]) -> Float[np.ndarray, "*batch"]:
    return np.einsum("...i,...i->...", x, x)


class Swings:
    """The swings of N robots' feet: their heights, and touchdowns out of place.

    At the start of an episode every foot may land once, and its swing counts as high enough.
    """

    def __init__(self, machine: RewardMachine, n: int) -> None:
        self._machine = machine
        self._height: Float[np.ndarray, "N 4"] = np.empty((n, 4))
        self._touches: Bool[np.ndarray, "N 4"] = np.empty((n, 4), dtype=bool)
        self._may_land: Bool[np.ndarray, "N 4"] = np.empty((n, 4), dtype=bool)
        self.restart(np.arange(n))

    def restart(self, ids: Int[np.ndarray, " K"]) -> None:
        """Episodes of these robots begin."""
        self._height[ids] = np.inf
        self._touches[ids] = False
        self._may_land[ids] = True

    def see(
        self,
        left: Int[np.ndarray, " N"],
        step: Step,
        contact: Bool[np.ndarray, "N 4"],
        clearance: Float[np.ndarray, "N 4"],
        factor: float = 1.0,
    ) -> tuple[Int[np.ndarray, " N"], Float[np.ndarray, " N"]]:
        """Number of touchdowns out of place, and share of the swing height that was reached.

        A touchdown is in place if it is the first since the machine lifted the foot, and if the
        state or the next one has the foot in its stance. The share is that of the edge taken, 1
        without an edge.

        Args:
            left: state of the machine before the step.
            step: result of the machine's step.
            contact: which feet are down after the step.
            clearance: of the feet over the ground [m].
            factor: on the machine's swing heights.
        """
        lands = contact & ~self._touches
        in_place = lands & self._may_land & self._machine.expected(left)
        height = np.fmax(self._height, clearance)
        lifted = self._machine.lifted(left, step.state)
        self._touches = contact.copy()
        self._may_land = (self._may_land & ~in_place) | lifted
        self._height = np.where(lifted, clearance, height)
        return (lands & ~in_place).sum(axis=1), self._machine.swing_share(
            step.edge, height / factor
        )
