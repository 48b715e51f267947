"""When a training has reached its gait: a deterministic check of the policy as it stands."""

from dataclasses import dataclass
from typing import cast

from gaitshift.control.policy import Policy
from gaitshift.lab.evaluation import EvaluationConfig, evaluate


@dataclass(frozen=True, kw_only=True)
class Figures:
    """What a check saw, after the evaluation's warm-up of 2 s."""

    survival: float
    """Share of the robots that did not fall."""
    speed: float | None
    """Mean forward speed [m/s]; None where all fell in the warm-up."""
    pattern_fraction: float | None
    """Share of the steps that show a stance of the gait's machine; None as well."""


@dataclass(frozen=True, kw_only=True)
class Check:
    """Robots on flat ground without exploration noise, and what they must reach there."""

    survival: float = 0.99
    """Least share of robots that do not fall."""
    speed_error: float = 0.1
    """Greatest |mean forward speed - the gait's own| [m/s]."""
    pattern_fraction: float = 0.6
    """Least share of steps that show a stance of the machine."""
    robots: int = 64
    """Robots at once, so that at 0.99 not one may fall."""
    seconds: float = 6.0
    """Length of the run [s]."""

    def see(self, policy: Policy) -> Figures:
        """Runs the policy at its own speed and stride frequency; the same figures every time."""
        config = EvaluationConfig(episodes=self.robots, seconds=self.seconds)
        seen, _ = evaluate(policy, config)
        return Figures(
            survival=cast(float, seen["survival"]),
            speed=cast("float | None", seen["speed_mean"]),
            pattern_fraction=cast("float | None", seen["pattern_fraction"]),
        )

    def is_passed(self, figures: Figures, own_speed: float) -> bool:
        """Whether the figures are those of the gait at `own_speed` [m/s]."""
        if figures.speed is None or figures.pattern_fraction is None:
            return False
        return (
            figures.survival >= self.survival
            and abs(figures.speed - own_speed) <= self.speed_error
            and figures.pattern_fraction >= self.pattern_fraction
        )
