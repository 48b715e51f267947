"""A shift condition: a statistic of the ground, the paper's counter over it, and the way back.

Any controller can carry one, learned or model-based (paper III-F): see `Signals` for its food.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.errors import GaitshiftError
from gaitshift.shift.modulation import Modulation
from gaitshift.shift.rule import Rule
from gaitshift.shift.signals import Signals
from gaitshift.shift.statistic import AnyStatistic, begun_anew
from gaitshift.shift.statistics.height_difference import HeightDifference


@dataclass(frozen=True, kw_only=True, eq=False)
class ConditionState:
    """What a condition remembers of N robots between two steps."""

    statistic: Any
    """What its statistic remembers."""
    statistic_back: Any = None
    """What that of the way back remembers; None where it is the same."""
    k: Float[np.ndarray, " N"]
    """Counter [counts] of the rule in force."""
    counted: Float[np.ndarray, " N"]
    """k as the last step held it against β, before a firing set it back: for logs."""
    time_in_gait: Float[np.ndarray, " N"]
    """Since the last firing [s]."""


@dataclass(frozen=True, kw_only=True)
class Condition:
    """When to leave the gait for flat ground, and when to come back to it.

    The paper's Algorithm 1 (III-E) and its reverse (IV-C) over any statistic. The defaults are
    ours; `paper()` has the paper's numbers. α may change between steps (III-E): go on with the same
    state and a replaced config, or give a `modulation`.
    """

    statistic: AnyStatistic = field(default_factory=HeightDifference)
    """What is watched."""
    statistic_back: AnyStatistic | None = None
    """What is watched on the way back; None: the same; the paper's is the same. Ours: what tells
    soonest that ground is rough need not be what tells soonest that it no longer is."""
    alpha: float = 0.04
    """α, in the statistic's unit: above it counts as rough; paper 0.2 m, ours: flat ground stays
    below."""
    beta: float = 200.0
    """β [counts], fire when k exceeds it; paper 1000, ours: some 1.2 s of `perlin:0.10`."""
    epsilon: float = 1.0
    """ε [counts], increment of k (III-E: one, or in general some small number)."""
    leak: float = 0.0
    """What k loses in each step [counts]; the paper's never shrinks."""
    alpha_back: float = 0.035
    """α', in the unit of the way back: all below it counts as flat; ours: most of bound's steps on
    flat."""
    beta_back: float = 350.0
    """β' [counts], fire back when k exceeds it; ours: 3.5 s of flat steps, over twice what 10 m of
    `perlin:0.10` count."""
    leak_back: float = 0.0
    """What k loses in each step while the way back is waited for [counts]; ours."""
    hold: float = 0.0
    """Least time in either gait [s]; ours, the paper has none."""
    reset: bool = True
    """Whether a robot begins anew on firing, with k at 0 and nothing remembered; ours: the rule now
    in force would start from the count of the other, and from what the old gait's touches said."""
    modulation: Modulation | None = None
    """How α and α' follow time or speed; None: not at all."""

    def __post_init__(self) -> None:
        try:
            _ = self.rough
        except GaitshiftError as error:
            raise GaitshiftError(f"shift to the rough gait: {error}") from None
        try:
            _ = self.flat
        except GaitshiftError as error:
            raise GaitshiftError(f"shift back to the flat gait: {error}") from None

    @property
    def rough(self) -> Rule:
        """What ends the gait for flat ground."""
        return Rule(
            alpha=self.alpha,
            beta=self.beta,
            epsilon=self.epsilon,
            leak=self.leak,
            hold=self.hold,
        )

    @property
    def flat(self) -> Rule:
        """What ends the gait for rough ground."""
        return Rule(
            when="below",
            alpha=self.alpha_back,
            beta=self.beta_back,
            epsilon=self.epsilon,
            leak=self.leak_back,
            hold=self.hold,
        )

    def soonest(self, *, shifted: bool) -> float:
        """What β, or β' where `shifted`, is in time [s] (`Rule.soonest`)."""
        if shifted:
            return self.flat.soonest((self.statistic_back or self.statistic).width)
        return self.rough.soonest(self.statistic.width)

    @classmethod
    def paper(cls) -> "Condition":
        """The paper's setting (IV-C): α = 0.2 m, β = 1000, ε = 1, body frame.

        The paper prints no numbers for the way back: ours, the same two, the largest α' at which
        no step counts as both rough and flat.
        """
        return cls(
            statistic=HeightDifference(frame="body"),
            alpha=0.2,
            beta=1000.0,
            alpha_back=0.2,
            beta_back=1000.0,
        )

    def start(self, n: int) -> ConditionState:
        """State of n robots that have not been seen yet."""
        return ConditionState(
            statistic=self.statistic.start(n),
            statistic_back=None if self.statistic_back is None else self.statistic_back.start(n),
            k=np.zeros(n),
            counted=np.zeros(n),
            time_in_gait=np.zeros(n),
        )

    def step(
        self, state: ConditionState, signals: Signals, shifted: Bool[np.ndarray, " N"]
    ) -> tuple[ConditionState, Bool[np.ndarray, " N"]]:
        """Takes in one control step: the state after it, and which robots are to shift now.

        `shifted` names the rule in force: the way to the rough gait where False, back where True;
        the caller flips it when it obeys. Nothing given is written to.
        """
        memory, values = self.statistic.step(state.statistic, signals)
        memory_back, values_back = None, values
        if self.statistic_back is not None:
            memory_back, values_back = self.statistic_back.step(state.statistic_back, signals)
        factor = 1.0 if self.modulation is None else self.modulation.factor(signals)
        rough, flat = self.rough, self.flat
        time = state.time_in_gait + signals.period
        k = np.where(
            shifted, flat.step(state.k, values_back, factor), rough.step(state.k, values, factor)
        )
        fire = np.where(shifted, flat.fires(k, time), rough.fires(k, time))
        if self.reset:
            memory = begun_anew(self.statistic, memory, fire)
            if self.statistic_back is not None:
                memory_back = begun_anew(self.statistic_back, memory_back, fire)
        after = ConditionState(
            statistic=memory,
            statistic_back=memory_back,
            k=np.where(fire & self.reset, 0.0, k),
            counted=k,
            time_in_gait=np.where(fire, 0.0, time),
        )
        return after, fire
