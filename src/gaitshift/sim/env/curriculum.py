"""How much is asked of robots in training now."""

from dataclasses import dataclass

from gaitshift.errors import GaitshiftError


@dataclass(frozen=True, kw_only=True)
class Curriculum:
    """What `GaitEnv` asks for at one time of a training; by default everything, as in a trial.

    Raises:
        GaitshiftError: a share is not in 0 to 1, or the factor on swing heights is not above 0.
    """

    strictness: float = 1.0
    """How much of what only a clean gait can give is asked for, 0 to 1: how far the bonus depends
    on swing heights and punctuality, and factor on the price of chatter."""
    swing_factor: float = 1.0
    """Factor on the machine's swing heights."""
    command_scale: float = 1.0
    """The share of the gait's ranges that commands are drawn from, 0 to 1."""
    penalty_scale: float = 1.0
    """The factor λ on all penalties, 0 to 1 (paper III-D, where it is always 1)."""
    mixed_starts: float = 0.0
    """The share of episodes that begin in the midst of a stride that is no gait's
    (`gaitshift.sim.env.mixed_start`), of those that begin while others go on, 0 to 1."""

    def __post_init__(self) -> None:
        for name in ("strictness", "command_scale", "penalty_scale", "mixed_starts"):
            if not 0 <= getattr(self, name) <= 1:
                raise GaitshiftError(f"{name} must be 0 to 1, got {getattr(self, name)}")
        if not self.swing_factor > 0:
            raise GaitshiftError(f"swing_factor must be above 0, got {self.swing_factor}")
