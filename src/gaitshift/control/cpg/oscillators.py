"""Four Hopf oscillators per robot, coupled to the phases of a gait, and the known gaits."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float


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
