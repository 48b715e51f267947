"""Touchdown phases within the stride of FL: circular means and resultant lengths.

A foot with p touchdowns per stride of its gait gives p-axial data: angles are multiplied by p,
their mean and resultant length are computed, and the mean is divided by p (Fisher, Statistical
Analysis of Circular Data, 1993, 2.3). Otherwise two touchdowns half a stride apart have no mean.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Complex, Float, Int

from gaitshift.gait import RewardMachine

SHORTEST, LONGEST = 0.2, 2.5
"""Strides [s] that count. Ours: faster is vibration, slower is standing; gaits here take 0.3 to
1.2 s."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Phases:
    """Touchdowns within strides of FL, each from one touchdown of FL to the next.

    Touchdowns end a swing (`Sample.touchdowns`), so that a bounce of FL does not split its stride.
    `touchdowns_per_cycle` measures the bounces. Robots are pooled.
    """

    fractions: tuple[Float[np.ndarray, " _"], ...]
    """Of each foot: its touchdowns as fractions of the stride they fall into, in [0, 1)."""
    strides: int
    """Strides of FL that count."""

    @classmethod
    def of(cls, touchdowns: Bool[np.ndarray, "L N 4"], period: float) -> "Phases":
        """Phases of the touchdowns of N robots; `period` [s] is the time of a control step."""
        steps = touchdowns.shape[0]
        rows = touchdowns.transpose(1, 0, 2).reshape(-1, 4)
        reference = np.flatnonzero(rows[:, 0])
        length = np.diff(reference)
        one_robot = np.diff(reference // max(steps, 1)) == 0
        counts = one_robot & (length * period >= SHORTEST) & (length * period <= LONGEST)
        if not counts.any():
            return cls(fractions=(np.zeros(0),) * 4, strides=0)
        fractions = tuple(
            _fractions(np.flatnonzero(rows[:, leg]), reference, length, counts) for leg in range(4)
        )
        return cls(fractions=fractions, strides=int(counts.sum()))

    def moments(self, axial: tuple[int, ...]) -> Complex[np.ndarray, " 4"]:
        """Mean of exp(2πi p · fraction) of each foot, p from `axial`; 0 where it never came."""
        return np.array(
            [
                np.exp(2j * np.pi * p * fraction).mean() if fraction.size else 0.0
                for fraction, p in zip(self.fractions, axial, strict=True)
            ],
            dtype=complex,
        )

    def per_stride(self) -> Float[np.ndarray, " 4"]:
        """Touchdowns of each foot a stride of FL."""
        return np.array([fraction.size for fraction in self.fractions]) / max(self.strides, 1)


def axial_of(machine: RewardMachine) -> tuple[int, ...]:
    """Touchdowns of each foot per stride of FL by its machine; at least 1."""
    reference = max(machine.touchdowns[0], 1)
    return tuple(max(1, count // reference) for count in machine.touchdowns)


def ideal_of(machine: RewardMachine) -> Float[np.ndarray, " 4"]:
    """Ideal phase of each foot after FL [fraction of the stride of FL]."""
    ideal = np.array(machine.ideal_phase)
    return ideal - ideal[0]


def phase_errors(phase: Float[np.ndarray, " 4"], machine: RewardMachine) -> Float[np.ndarray, " 4"]:
    """Distance of each foot's phase from the ideal, on its circle of 1/p strides [stride]."""
    axial = np.array(axial_of(machine))
    turns = (phase - ideal_of(machine)) * axial
    return np.abs(turns - np.rint(turns)) / axial


def _fractions(
    at: Int[np.ndarray, " E"],
    reference: Int[np.ndarray, " S"],
    length: Int[np.ndarray, " M"],
    counts: Bool[np.ndarray, " M"],
) -> Float[np.ndarray, " _"]:
    """Touchdowns as fractions of the stride they fall into, if it counts."""
    stride = np.searchsorted(reference, at, side="right") - 1
    inside = (stride >= 0) & (stride < len(length))
    at, stride = at[inside], stride[inside]
    at, stride = at[counts[stride]], stride[counts[stride]]
    return (at - reference[stride]) / length[stride]
