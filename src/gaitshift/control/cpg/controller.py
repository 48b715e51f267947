"""Oscillators to joint targets: foot paths that follow the command, feet placed for balance.

It has the face of `switching.Driver`, so that rollouts, conditions and switchers take either.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control.cpg.gait import GAITS
from gaitshift.control.cpg.kinematics import FORE, SIDE, joint_angles, lift_torques
from gaitshift.control.cpg.oscillators import HopfNetwork, phase_of
from gaitshift.errors import GaitshiftError
from gaitshift.gait.gaits import load
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.motion import GRAVITY, Motion


@dataclass(frozen=True, kw_only=True)
class CpgConfig:
    """What is not of a gait."""

    height: float = 0.46
    """Of the base origin above the feet [m]."""
    placement: float = 0.12
    """Feet are put down further out by this times the speed that is too much [s] (Raibert 1986)."""
    reach_time: float = 0.05
    """A swinging foot takes this long to get there [s]."""
    levelling: float = 0.3
    """Share of roll and pitch that standing legs push against."""
    mass: float = ANYMAL_B.mass
    """Of the robot [kg]; standing legs are given the torques that bear it."""
    loading: float = 0.15
    """Share of a stance over which a leg takes its load on, and at its end off."""
    smoothing: float = 0.1
    """The measured velocity forgets by e in this time [s]."""


class CpgController:
    """N robots on foot paths, each in the gait of the moment: a change is a new coupling."""

    def __init__(
        self,
        gaits: Sequence[str],
        n: int,
        *,
        start: str,
        config: CpgConfig | None = None,
        network: HopfNetwork | None = None,
    ) -> None:
        """All n robots begin in the gait `start`."""
        unknown = [name for name in (*gaits, start) if name not in GAITS]
        if unknown:
            raise GaitshiftError(f"no oscillators for '{unknown[0]}'; known: {', '.join(GAITS)}")
        self.config = CpgConfig() if config is None else config
        self.network = HopfNetwork() if network is None else network
        self.gaits = tuple(gaits)
        self.n = n
        self.machine_state: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        """For logs: oscillators have no machine, and go through its states at an even pace, from
        one touchdown of the first leg that is asked of them to the next."""
        self._of = [GAITS[name] for name in self.gaits]
        self._machines = [load(name) for name in self.gaits]
        self._offset = -np.array([machine.ideal_phase for machine in self._machines])
        self._parts = np.array([len(machine.states) for machine in self._machines])
        self._duty = np.array([gait.duty for gait in self._of])
        self._sweep = np.array([gait.sweep for gait in self._of])
        self._home = np.stack(
            [np.stack([FORE * g.stance_x, SIDE * g.stance_y], axis=1) for g in self._of]
        )
        self._clearance = np.array([gait.clearance for gait in self._of])
        self.gait: Int[np.ndarray, " N"] = np.full(n, self.gaits.index(start))
        self._state = self.network.start(n, self._offset[self.gait])
        self._velocity: Float[np.ndarray, "N 2"] = np.zeros((n, 2))
        self._angles: Float[np.ndarray, "N 12"] | None = None
        self._out: Float[np.ndarray, "N 4 2"] = np.zeros((n, 4, 2))

    @property
    def robot(self) -> Robot:
        """The robot whose legs it knows."""
        return ANYMAL_B

    @property
    def gains(self) -> str:
        """The preset of joint gains."""
        return "default"

    def see(self, motion: Motion, command: Command) -> None:
        """Takes in the motion that came of `command`."""
        share = CONTROL_PERIOD / self.config.smoothing
        seen = motion.base_linear_velocity_b[:, :2]
        self._velocity = self._velocity + share * (seen - self._velocity)

    def switch(self, ids: Int[np.ndarray, " K"], gait: str, motion: Motion) -> None:
        """Couples the oscillators of robots `ids` for another gait."""
        self.gait[ids] = self.gaits.index(gait)

    def act(self, motion: Motion, command: Command) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] for the next control step."""
        offset, frequency = self._offset[self.gait], command.stride_frequency
        self._state = self.network.step(self._state, offset, frequency, CONTROL_PERIOD)
        phase = phase_of(self._state)
        self.machine_state = np.floor(phase[:, 0] * self._parts[self.gait]).astype(np.int64)
        angles = joint_angles(self._feet(phase, motion, command))
        rate = np.zeros_like(angles) if self._angles is None else angles - self._angles
        self._angles = angles
        gains = self.robot.gains_of(self.gains)
        # The joints' own law, kp (target − q) − kd q̇, then damps towards the path, not to rest.
        torque = gains.kd * rate / CONTROL_PERIOD + lift_torques(angles, self._loads(phase))
        return angles + torque / gains.kp

    def value(self) -> None:
        """Oscillators expect nothing."""

    def own_command(self) -> Command:
        """Straight ahead, at the nominal speed and frequency of each robot's gait."""
        speed = np.array([gait.speed for gait in self._of])
        frequency = np.array([gait.frequency for gait in self._of])
        return Command(
            forward_speed=speed[self.gait],
            yaw_rate=np.zeros(self.n),
            stride_frequency=frequency[self.gait],
        )

    def stance_shown(self, motion: Motion) -> Bool[np.ndarray, " N"]:
        """Whether the feet in contact are a stance set of the machine of each robot's gait."""
        shown = np.empty(self.n, dtype=bool)
        for index in np.unique(self.gait).tolist():
            ids = np.flatnonzero(self.gait == index)
            shown[ids] = self._machines[index].shows_stance(motion.contact[ids])
        return shown

    def _loads(self, phase: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 4"]:
        """What each leg is to bear now [N]: the legs that stand share the weight."""
        duty, loading = self._duty[self.gait][:, None], self.config.loading
        part = phase / duty
        share = np.clip(np.minimum(part, 1.0 - part) / loading, 0.0, 1.0)
        total = np.maximum(share.sum(axis=1, keepdims=True), 1.0)
        return self.config.mass * GRAVITY * share / total

    def _feet(
        self, phase: Float[np.ndarray, "N 4"], motion: Motion, command: Command
    ) -> Float[np.ndarray, "N 4 3"]:
        """Where the middle of each foot is to be, body frame [m]."""
        config = self.config
        duty = self._duty[self.gait][:, None]
        stance_time = duty / command.stride_frequency[:, None]
        home = self._home[self.gait]
        # What the ground does under the feet while they stand: the command, seen from the base.
        velocity = np.stack(
            [
                command.forward_speed[:, None] - command.yaw_rate[:, None] * home[..., 1],
                command.yaw_rate[:, None] * home[..., 0],
            ],
            axis=2,
        )
        wanted = np.stack([command.forward_speed, np.zeros(self.n)], axis=1)
        too_much = config.placement * (self._velocity - wanted)
        stands = phase < duty
        along = np.where(stands, 0.5 - phase / duty, _ease((phase - duty) / (1.0 - duty)) - 0.5)
        sweep = self._sweep[self.gait][:, None, None] * stance_time[..., None] * velocity
        xy = home + along[..., None] * sweep
        # A foot that swings goes further out by what is too much, and stays there while it stands.
        moves = np.where(stands, 0.0, CONTROL_PERIOD / config.reach_time)[..., None]
        self._out = self._out + moves * (too_much[:, None] - self._out)
        xy = xy + self._out
        swing = np.clip((phase - duty) / (1.0 - duty), 0.0, 1.0)
        lift = self._clearance[self.gait][:, None] * np.square(np.sin(np.pi * swing))
        gx, gy = motion.gravity_b[:, :1], motion.gravity_b[:, 1:2]
        level = config.levelling * np.where(stands, gx * home[..., 0] + gy * home[..., 1], 0.0)
        z = -config.height + self.robot.foot_radius + lift - level
        return np.concatenate([xy, z[..., None]], axis=2)


def _ease(part: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 4"]:
    """0 to 1, at rest at both ends."""
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(part, 0.0, 1.0))
