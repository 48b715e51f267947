"""Four Hopf oscillators per robot, coupled to keep the phases of a gait."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Complex, Float


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
