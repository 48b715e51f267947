"""The present difficulty of training."""

from dataclasses import dataclass

from gaitshift.errors import GaitshiftError


@dataclass(frozen=True, kw_only=True)
class Curriculum:
    """Difficulty of `GaitEnv` at one time of a training; by default full, as in a trial.

    Raises:
        GaitshiftError: a share is not in 0 to 1, or the factor on swing heights is not above 0.
    """

    strictness: float = 1.0
    """How strictly a clean gait is demanded, 0 to 1: how far the bonus depends on swing heights and
    punctuality, and the factor on the chatter penalty."""
    swing_factor: float = 1.0
    """Factor on the machine's swing heights."""
    command_scale: float = 1.0
    """Share of the gait's ranges from which commands are drawn, 0 to 1."""
    penalty_scale: float = 1.0
    """The factor λ on all penalties, 0 to 1 (paper III-D, where it is always 1)."""
    mixed_starts: float = 0.0
    """Share of the restarts during a step that begin mid-stride with legs out of phase
    (`gaitshift.sim.env.mixed_start`), 0 to 1."""

    def __post_init__(self) -> None:
        for name in ("strictness", "command_scale", "penalty_scale", "mixed_starts"):
            if not 0 <= getattr(self, name) <= 1:
                raise GaitshiftError(f"{name} must be 0 to 1, got {getattr(self, name)}")
        if not self.swing_factor > 0:
            raise GaitshiftError(f"swing_factor must be above 0, got {self.swing_factor}")
