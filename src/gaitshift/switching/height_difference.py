"""Algorithm 1: shift when the heights at which the feet last touched differ much, for long.

Any controller can carry it, learned or model-based (paper III-F): it is fed by the contacts, the
foot positions relative to the base and the direction of gravity, and knows nothing else.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.legs import LEG_PAIRS

FRAMES = ("body", "gravity")
"""Frames a foot's height can be taken in: see `height_in_frame`."""

_FIRST, _SECOND = np.array(LEG_PAIRS).T
_UNITS = {
    "alpha": "m",
    "beta": "counts",
    "epsilon": "counts",
    "alpha_back": "m",
    "beta_back": "counts",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class HeightState:
    """What the condition remembers of N robots between two steps."""

    height: Float[np.ndarray, "N 4"]
    """h_i [m], upwards from the base: height of each foot when it last touched; 0 before that."""

    touched: Bool[np.ndarray, "N 4"]
    """Whether the foot has touched since the start, so that its h_i is known."""

    k: Float[np.ndarray, " N"]
    """Counter [counts] of the rule in force, 0 at the start and after each firing."""

    counted: Float[np.ndarray, " N"]
    """k as the last step held it against β, before a firing set it back: for logs."""


@dataclass(frozen=True, kw_only=True)
class HeightDifference:
    """The paper's shift condition (Algorithm 1) and its way back (IV-C), for N robots at once.

    Forward rule: at each step k grows by ε for every unordered pair of feet with |h_i − h_j| > α,
    six pairs in all (III-E), and the condition fires when k > β.
    Reverse rule: k grows by ε, once, at each step at which |h_i − h_j| < α' holds for all six
    pairs, and the condition fires when k > β'. The paper prints this "∀ i,j" and no pseudocode; it
    is read as one statement about the step. Counted pair by pair, k would climb on rough ground
    too, where some two feet nearly always agree.

    Ours, where the paper is silent: a foot that has not touched yet takes part in no pair, so the
    reverse rule waits for all four feet; k returns to 0 on firing (h is kept), or the rule now in
    force would start from the count of the other. As in the paper, k never shrinks otherwise.
    α may change between steps (III-E): go on with the same state and a replaced config.
    """

    alpha: float = 0.04
    """α [m], |h_i − h_j| above it counts as rough; paper 0.2, ours: flat ground stays below."""

    beta: float = 200.0
    """β [counts], fire when k exceeds it; paper 1000, ours: some 1.2 s of `perlin:0.10`."""

    epsilon: float = 1.0
    """ε [counts], increment of k (paper III-E: one, or in general some small number)."""

    alpha_back: float = 0.035
    """α' [m], all |h_i − h_j| below it count as flat; ours: most of bound's steps on flat."""

    beta_back: float = 350.0
    """β' [counts], fire back when k exceeds it; ours: 3.5 s of flat steps, over twice what 10 m of
    `perlin:0.10` count."""

    frame: Literal["body", "gravity"] = "gravity"
    """Frame of h, body (paper III-E) or gravity; ours: the body frame takes pitch for terrain."""

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            value: float = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise GaitshiftError(f"{name} [{unit}] must be positive and finite, not {value}")
        if self.frame not in FRAMES:
            raise _unknown_frame(self.frame)

    @classmethod
    def paper(cls) -> "HeightDifference":
        """Build the paper's setting (IV-C): α = 0.2 m, β = 1000, ε = 1, body frame.

        The paper prints no numbers for the way back: ours, the same two, the largest α' at which
        no step counts as both rough and flat.
        """
        return cls(
            alpha=0.2, beta=1000.0, epsilon=1.0, alpha_back=0.2, beta_back=1000.0, frame="body"
        )

    def start(self, n: int) -> HeightState:
        """State of n robots of which no foot has touched yet."""
        return HeightState(
            height=np.zeros((n, 4)),
            touched=np.zeros((n, 4), dtype=bool),
            k=np.zeros(n),
            counted=np.zeros(n),
        )

    def step(
        self,
        state: HeightState,
        *,
        contact: Bool[np.ndarray, "N 4"],
        foot_position_b: Float[np.ndarray, "N 4 3"],
        gravity_b: Float[np.ndarray, "N 3"],
        shifted: Bool[np.ndarray, " N"],
    ) -> tuple[HeightState, Bool[np.ndarray, " N"]]:
        """Take in one control step: the state after it, and which robots are to shift now.

        `foot_position_b` [m] is relative to the base origin and `gravity_b` the unit vector along
        gravity, both in the body frame. `shifted` names the rule in force: forward where False,
        reverse where True; the caller flips it when it obeys. A position that is not a number
        counts for neither rule until that foot touches again. Nothing given is written to.
        """
        now = height_in_frame(foot_position_b, gravity_b, self.frame)
        height = np.where(contact, now, state.height)
        touched = state.touched | contact

        # NaN compares as False: a pair with an unknown height is neither above α nor below α'.
        known = np.where(touched, height, np.nan)
        difference = np.abs(known.take(_FIRST, axis=1) - known.take(_SECOND, axis=1))
        above: Int[np.ndarray, " N"] = np.count_nonzero(difference > self.alpha, axis=1)
        all_below: Bool[np.ndarray, " N"] = np.all(difference < self.alpha_back, axis=1)

        k = state.k + self.epsilon * np.where(shifted, all_below, above)
        fire = k > np.where(shifted, self.beta_back, self.beta)
        after = HeightState(height=height, touched=touched, k=np.where(fire, 0.0, k), counted=k)
        return after, fire


def height_in_frame(
    foot_position_b: Float[np.ndarray, "N 4 3"], gravity_b: Float[np.ndarray, "N 3"], frame: str
) -> Float[np.ndarray, "N 4"]:
    """Height [m] of each foot above the base origin (negative while below it), seen in `frame`.

    "body": along the body's own z axis (paper III-E). "gravity": along up, −p·g, at the base: roll
    and pitch are removed, and yaw does not enter. Arguments as in `HeightDifference.step`.
    Raises GaitshiftError for another frame.
    """
    x, y, z = (foot_position_b[:, :, axis] for axis in range(3))
    if frame == "body":
        return z.copy()
    if frame == "gravity":
        # Written out, for one robot to give the same bits alone and in a batch.
        return -(x * gravity_b[:, :1] + y * gravity_b[:, 1:2] + z * gravity_b[:, 2:])
    raise _unknown_frame(frame)


def _unknown_frame(frame: str) -> GaitshiftError:
    return GaitshiftError(f"unknown frame {frame!r}; known frames: {', '.join(FRAMES)}")
