"""Who changes the gaits: the foot-height condition, or a schedule."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from gaitshift.command import CONTROL_PERIOD
from gaitshift.errors import GaitshiftError
from gaitshift.motion import Motion
from gaitshift.switching.driver import Driver
from gaitshift.switching.height_difference import HeightDifference

_ROUNDING = 1e-9
"""Times are multiples of 10 ms, give or take this [s]."""


@dataclass(frozen=True, kw_only=True)
class Decision:
    """What a switcher saw in one step, for logs: zero where it has no such notion."""

    k: Float[np.ndarray, " N"]
    """The condition's counter, before a firing sets it back to 0."""
    threshold: Float[np.ndarray, " N"]
    """What k was held against."""
    foot_height: Float[np.ndarray, "N 4"]
    """h_i: height of each foot at its last touch, in the condition's frame [m]."""


@runtime_checkable
class Switcher(Protocol):
    """Looks at the motion once a control step and changes gaits through the driver."""

    def step(self, time: float, motion: Motion, driver: Driver) -> Decision:
        """Decides for all robots at `time` [s]."""
        ...


class Autonomous:
    """The paper's higher controller: one gait for flat ground, one for rough, and a condition.

    While a robot is in the flat gait the rule k > β runs, in the rough gait the reverse rule.
    """

    def __init__(self, condition: HeightDifference, n: int, *, flat: str, rough: str) -> None:
        if flat == rough:
            raise GaitshiftError(f"the gaits for flat and for rough ground are both '{flat}'")
        self.condition = condition
        self.flat = flat
        self.rough = rough
        self._state = condition.start(n)

    def step(self, time: float, motion: Motion, driver: Driver) -> Decision:
        """Runs the condition; where it fires, the robot changes to the other gait."""
        condition = self.condition
        shifted = driver.gait == driver.gaits.index(self.rough)
        before = self._state
        self._state, fire = condition.step(
            before,
            contact=motion.contact,
            foot_position_b=motion.foot_position_b,
            gravity_b=motion.gravity_b,
            shifted=shifted,
        )
        threshold = np.where(shifted, condition.beta_back, condition.beta)
        driver.switch(np.flatnonzero(fire & ~shifted), self.rough, motion)
        driver.switch(np.flatnonzero(fire & shifted), self.flat, motion)
        return Decision(
            k=self._state.counted,
            threshold=threshold,
            foot_height=self._state.height,
        )


@dataclass(frozen=True)
class Scheduled:
    """Gaits changed at given times, for all robots at once: the paper's seven in a row."""

    plan: tuple[tuple[float, str], ...]
    """Times [s] and the gait that begins there, in order."""

    def step(self, time: float, motion: Motion, driver: Driver) -> Decision:
        """Carries out what fell due in the control step that ends at `time`."""
        late = time + _ROUNDING
        for start, gait in self.plan:
            if late - CONTROL_PERIOD < start <= late:
                driver.switch(np.arange(driver.n), gait, motion)
        nothing = np.zeros(driver.n)
        return Decision(k=nothing, threshold=nothing, foot_height=np.zeros((driver.n, 4)))
