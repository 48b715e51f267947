"""A controller without learning: coupled oscillators move feet on paths that follow the command.

Feet are placed for balance, and inverse kinematics gives joint targets. It is a `Controller` like
`Driver`, so that rollouts, conditions and switchers work with both.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float, Int

from gaitshift.control.controller import Repertoire
from gaitshift.errors import GaitshiftError
from gaitshift.gait.gaits import load
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.legs import FORE, SIDE, joint_angles, lift_torques
from gaitshift.robot.state import GRAVITY, Proprioception


@dataclass(frozen=True, kw_only=True)
class CpgGait:
    """A gait of oscillators; the phases of its touchdowns are those of the machine of its name."""

    name: str
    """Of the machine."""
    frequency: float
    """Strides a second [Hz]."""
    duty: float
    """Share of a stride that each foot is down."""
    speed: float
    """Nominal forward speed [m/s]."""
    clearance: float = 0.07
    """Height of the swing [m]."""
    stance_x: float = 0.34
    """How far ahead of or behind the base origin feet stand in the middle of a stance [m]."""
    stance_y: float = 0.24
    """How far to the side [m]."""
    sweep: float = 1.0
    """Feet sweep back faster than the command by this factor, where they lose as much by slip."""


GAITS = {
    gait.name: gait
    for gait in (
        CpgGait(name="trot", frequency=2.2, duty=0.55, speed=0.6, clearance=0.09),
        CpgGait(name="pace", frequency=4.2, duty=0.5, speed=0.2, stance_y=0.15, sweep=3.0),
        CpgGait(name="bound", frequency=4.2, duty=0.5, speed=0.4, stance_x=0.25),
        CpgGait(name="walk", frequency=1.2, duty=0.75, speed=0.3, clearance=0.09),
    )
}
"""By name; ours: the numbers were tuned on flat ground. Feet of one side or one end tip the body
like a pendulum, so that only fast, short steps near its middle keep it level."""


@dataclass(frozen=True, kw_only=True)
class HopfNetwork:
    """ż = γ (1 − |z|²) z + i ω z + κ Σ_j (exp(i (φ_i − φ_j)) z_j − z_i), a z for each leg.

    Its limit cycle is the unit circle, completed once per stride; φ are the phases of the gait's
    touchdowns, to which offsets between legs converge from almost all states.
    """

    pull: float = 10.0
    """γ [1/s]"""
    coupling: float = 4.0
    """κ [1/s]; a change of gait takes about 1 / (4 κ)."""

    def start(self, n: int, phase: Float[np.ndarray, "N 4"]) -> Complex[np.ndarray, "N 4"]:
        """State of n robots whose legs are at these phases [stride]."""
        return np.exp(2j * np.pi * np.broadcast_to(phase, (n, 4)))

    def step(
        self,
        state: Complex[np.ndarray, "N 4"],
        offset: Float[np.ndarray, "N 4"],
        frequency: Float[np.ndarray, " N"],
        period: float,
    ) -> Complex[np.ndarray, "N 4"]:
        """State after `period` [s].

        Args:
            state: z.
            offset: φ of each leg [stride].
            frequency: of the strides [Hz].
            period: of a step [s]; the rotation is exact, the rest is Euler's.
        """
        turned = state * np.exp(2j * np.pi * frequency * period)[:, None]
        wanted = np.exp(2j * np.pi * offset)
        together = (turned / wanted).sum(axis=1, keepdims=True) * wanted
        size = np.square(np.abs(turned))
        grown = self.pull * (1.0 - size) * turned + self.coupling * (together - 4.0 * turned)
        return turned + period * grown


def phase_of(state: Complex[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 4"]:
    """Phases [stride], in [0, 1)."""
    return (np.angle(state) / (2.0 * np.pi)) % 1.0


@dataclass(frozen=True, kw_only=True)
class CpgConfig:
    """Settings common to all gaits."""

    height: float = 0.46
    """Height of the base origin above the feet [m]."""
    placement: float = 0.12
    """Foot placement offset per error of the base velocity [s] (Raibert 1986)."""
    reach_time: float = 0.05
    """Time in which a swinging foot moves to that offset [s]."""
    levelling: float = 0.3
    """Share of roll and pitch that standing legs correct."""
    loading: float = 0.15
    """Share of a stance over which the load of a leg grows, and over which it falls at the end."""
    smoothing: float = 0.1
    """Time constant of the filter of the measured velocity [s]."""


class CpgController:
    """N robots on foot paths, each in its present gait: a gait change is a new coupling."""

    def __init__(
        self,
        gaits: Sequence[str],
        n: int,
        *,
        robot: Robot | None = None,
        start: str | None = None,
        config: CpgConfig | None = None,
        network: HopfNetwork | None = None,
    ) -> None:
        """All n robots begin in the gait `start`; None: in the first of the gaits.

        Raises:
            GaitshiftError: there are no oscillators for the gait, or the robot is not ANYmal B.
        """
        if robot is not None and robot != ANYMAL_B:
            raise GaitshiftError(f"the oscillators know ANYmal B alone, got '{robot.name}'")
        unknown = [name for name in gaits if name not in GAITS]
        if unknown:
            raise GaitshiftError(
                f"gait of the oscillators must be one of {', '.join(GAITS)}, got '{unknown[0]}'"
            )
        self.config = CpgConfig() if config is None else config
        self.network = HopfNetwork() if network is None else network
        self.n = n
        self.machine_state: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        """For logs only: oscillators have no machine. Their phase runs through its states at a
        constant rate, from one nominal touchdown of the first leg to the next."""
        names = tuple(dict.fromkeys(gaits))
        self._of = [GAITS[name] for name in names]
        machines = tuple(load(name) for name in names)
        self.repertoire = Repertoire(
            gaits=names,
            machines=machines,
            forward_speed=np.array([gait.speed for gait in self._of]),
            stride_frequency=np.array([gait.frequency for gait in self._of]),
        )
        self._offset = -np.array([machine.ideal_phase for machine in machines])
        self._parts = np.array([len(machine.states) for machine in machines])
        self._duty = np.array([gait.duty for gait in self._of])
        self._sweep = np.array([gait.sweep for gait in self._of])
        self._home = np.stack(
            [np.stack([FORE * g.stance_x, SIDE * g.stance_y], axis=1) for g in self._of]
        )
        self._clearance = np.array([gait.clearance for gait in self._of])
        self.gait: Int[np.ndarray, " N"] = np.full(n, self.repertoire.index(start or names[0]))
        self._state = self.network.start(n, self._offset[self.gait])
        self._velocity: Float[np.ndarray, "N 2"] = np.zeros((n, 2))
        self._angles: Float[np.ndarray, "N 12"] | None = None
        self._out: Float[np.ndarray, "N 4 2"] = np.zeros((n, 4, 2))

    @property
    def robot(self) -> Robot:
        """The robot that it drives."""
        return ANYMAL_B

    @property
    def gains(self) -> str:
        """The preset of joint gains."""
        return "default"

    def see(self, sensed: Proprioception, command: Command) -> None:
        """Updates the state by proprioception after a step under `command`."""
        share = CONTROL_PERIOD / self.config.smoothing
        seen = sensed.need("velocity_b", "oscillators")[:, :2]
        self._velocity = self._velocity + share * (seen - self._velocity)

    def switch(self, ids: Int[np.ndarray, " K"], gait: str, sensed: Proprioception) -> None:
        """Couples the oscillators of robots `ids` for another gait."""
        self.gait[ids] = self.repertoire.index(gait)

    def act(self, sensed: Proprioception, command: Command) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] for the next control step."""
        offset, frequency = self._offset[self.gait], command.stride_frequency
        self._state = self.network.step(self._state, offset, frequency, CONTROL_PERIOD)
        phase = phase_of(self._state)
        self.machine_state = np.floor(phase[:, 0] * self._parts[self.gait]).astype(np.int64)
        angles = joint_angles(self._feet(phase, sensed, command))
        rate = np.zeros_like(angles) if self._angles is None else angles - self._angles
        self._angles = angles
        gains = self.robot.gains_of(self.gains)
        # The joints' own law, kp (target − q) − kd q̇, then damps towards the path, not to rest.
        torque = gains.kd * rate / CONTROL_PERIOD + lift_torques(angles, self._loads(phase))
        return angles + torque / gains.kp

    def value(self) -> None:
        """Oscillators have no critic."""

    def _loads(self, phase: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 4"]:
        """Present load of each leg [N]: the standing legs share the weight."""
        duty, loading = self._duty[self.gait][:, None], self.config.loading
        part = phase / duty
        share = np.clip(np.minimum(part, 1.0 - part) / loading, 0.0, 1.0)
        total = np.maximum(share.sum(axis=1, keepdims=True), 1.0)
        return self.robot.mass * GRAVITY * share / total

    def _feet(
        self, phase: Float[np.ndarray, "N 4"], sensed: Proprioception, command: Command
    ) -> Float[np.ndarray, "N 4 3"]:
        """Target of the centre of each foot, body frame [m]."""
        config = self.config
        duty = self._duty[self.gait][:, None]
        stance_time = duty / command.stride_frequency[:, None]
        home = self._home[self.gait]
        # Commanded velocity of the body at each foot, with which standing feet sweep back.
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
        # A swinging foot moves to its placement offset, and keeps it in the stance.
        moves = np.where(stands, 0.0, CONTROL_PERIOD / config.reach_time)[..., None]
        self._out = self._out + moves * (too_much[:, None] - self._out)
        xy = xy + self._out
        swing = np.clip((phase - duty) / (1.0 - duty), 0.0, 1.0)
        lift = self._clearance[self.gait][:, None] * np.square(np.sin(np.pi * swing))
        gx, gy = sensed.gravity_b[:, :1], sensed.gravity_b[:, 1:2]
        level = config.levelling * np.where(stands, gx * home[..., 0] + gy * home[..., 1], 0.0)
        z = -config.height + self.robot.foot_radius + lift - level
        return np.concatenate([xy, z[..., None]], axis=2)


def _ease(part: Float[np.ndarray, "N 4"]) -> Float[np.ndarray, "N 4"]:
    """0 to 1, at rest at both ends."""
    return 0.5 - 0.5 * np.cos(np.pi * np.clip(part, 0.0, 1.0))
