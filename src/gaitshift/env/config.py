"""What an environment is made of, as data."""

from dataclasses import dataclass, field

from gaitshift.command import PAPER_SPEED, HeadingLoop
from gaitshift.errors import GaitshiftError
from gaitshift.observation import DEFAULT_SLICES, PAPER_SLICES
from gaitshift.reward import RewardConfig
from gaitshift.world import PushConfig


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Everything about the environment but the gait, the ground and the number of robots."""

    reward: RewardConfig = field(default_factory=RewardConfig)
    """Weights of the one shared reward."""
    push: PushConfig = field(default_factory=PushConfig)
    """Disturbances; none by default."""
    observed: tuple[str, ...] = DEFAULT_SLICES
    """Slices of the observation, in order."""
    gains: str = "default"
    """Preset of the robot's joint gains."""
    episode_steps: int = 1000
    """Control steps until an episode is cut (10 s); ours, the paper gives none."""
    forward_speed: float = PAPER_SPEED
    """Commanded speed along body x [m/s] (paper III-C)."""
    heading_range: float = 0.8
    """Wanted headings are drawn within ± this of the present line [rad]; 0 leaves the yaw-rate
    command at zero, as in the paper. Ours."""
    heading_interval: int = 300
    """Control steps between two draws of the wanted heading; ours."""
    heading_loop: HeadingLoop = field(default_factory=HeadingLoop)
    """Turns the wanted heading into the yaw-rate command."""
    joint_noise: float = 0.1
    """Joints start within ± this of the stance [rad]; ours."""
    velocity_noise: float = 0.3
    """The base starts with a velocity within ± this along x and y [m/s]; ours."""
    terrain_margin: float = 0.8
    """A robot nearer than this to the border of its terrain starts anew elsewhere [m]; ours."""

    def __post_init__(self) -> None:
        if self.episode_steps < 1:
            raise GaitshiftError(f"episode of {self.episode_steps} steps: at least 1 is needed")
        if not 0 <= self.forward_speed <= 3:
            raise GaitshiftError(
                f"commanded speed {self.forward_speed} m/s: 0 to 3 m/s would be right"
            )

    @classmethod
    def paper(cls) -> "EnvConfig":
        """The paper's environment: Table I and b alone, its S, its gains, no heading command."""
        return cls(
            reward=RewardConfig.paper(), observed=PAPER_SLICES, gains="paper", heading_range=0.0
        )
