"""The configuration of an environment, and the present difficulty of training."""

from dataclasses import dataclass, field

from gaitshift.control.observation import DEFAULT_SLICES, PAPER_SLICES, check_slices
from gaitshift.data import check_ranges
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import MOST_HEIGHT, MOST_SPEED, PAPER_SPEED, HeadingLoop
from gaitshift.sim.push import PushConfig
from gaitshift.sim.reward import RewardConfig
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.world import Randomisation


@dataclass(frozen=True, kw_only=True)
class EnvConfig:
    """Everything about the environment but the gait, the ground and the number of robots."""

    reward: RewardConfig = field(default_factory=RewardConfig)
    """Weights of the one shared reward."""
    push: PushConfig = field(default_factory=PushConfig)
    """Disturbances; none by default."""
    randomisation: Randomisation = field(default_factory=Randomisation)
    """What differs from robot to robot; drawn anew at the start of each episode."""
    sensors: SensorConfig = PERFECT
    """Errors of the sensors and of the link to the joints. Where they give no velocity, policies
    see an estimate."""
    observed: tuple[str, ...] = DEFAULT_SLICES
    """Slices of the observation, in order."""
    privileged: bool = False
    """Whether the critic sees what only a simulation knows beside the observation; ours."""
    gains: str = "default"
    """Preset of the robot's joint gains."""
    episode_steps: int = 1000
    """Control steps until an episode is truncated (10 s); ours, the paper gives none."""
    forward_speed: float | None = None
    """Commanded speed along body x where none is drawn [m/s]; None: the gait's nominal speed."""
    command_share: float = 0.6
    """Share of the draws of a command that are uniform in the gait's ranges of speed and stride
    frequency, independently; the others are the gait's nominal values. 0: always nominal. Ours."""
    speed_margin: float = 0.0
    """How far beyond each end of a gait's range speeds are drawn in training, as a share of the
    range; ours: a policy answers the ends of what it is trained with by speeds nearer to the
    middle, and the speed loop needs slower and faster commands to correct that."""
    heading_range: float = 0.8
    """Wanted headings are drawn within ± this of the present line [rad]; 0 leaves the yaw-rate
    command at zero, as in the paper. Ours."""
    height_span: float = 0.0
    """Body heights are commanded within ± this of a gait's nominal height where it has no range of
    its own [m]; ours: where no height is asked for, robots that differ crouch."""
    turn_share: float = 0.0
    """Share of the draws of a command in which the robot has no wanted heading and turns at a yaw
    rate drawn within ± that of `heading_loop` until the next draw; ours."""
    stall: float = 0.0
    """Commanded cycles in one state after which an episode ends like a fall, at full strictness; 0:
    never. Ours: where falls are likely, standing still is the safer way to earn a little."""
    command_interval: int = 300
    """Control steps between two draws of the wanted heading, speed and stride frequency; ours."""
    heading_loop: HeadingLoop = field(default_factory=HeadingLoop)
    """Turns the wanted heading into the yaw-rate command."""
    joint_noise: float = 0.1
    """Joints start within ± this of the stance [rad]; ours."""
    velocity_noise: float = 0.3
    """The base starts with a velocity within ± this along x and y [m/s]; ours."""
    terrain_margin: float = 0.8
    """A robot nearer than this to the border of its terrain restarts elsewhere [m]; ours."""

    def __post_init__(self) -> None:
        check_slices(self.observed)
        check_ranges(
            self,
            episode_steps=(1, 1_000_000),
            command_share=(0.0, 1.0),
            speed_margin=(0.0, 1.0),
            heading_range=(0.0, 3.2),
            height_span=(0.0, MOST_HEIGHT),
            turn_share=(0.0, 1.0),
            stall=(0.0, 1000.0),
            command_interval=(1, 1_000_000),
            joint_noise=(0.0, 1.0),
            velocity_noise=(0.0, 10.0),
            terrain_margin=(0.0, 100.0),
        )
        if self.forward_speed is not None and not 0 <= self.forward_speed <= MOST_SPEED:
            raise GaitshiftError(
                f"forward_speed must be 0 to {MOST_SPEED:g} m/s, got {self.forward_speed}"
            )

    @classmethod
    def paper(cls) -> "EnvConfig":
        """The paper's environment: Table I and b alone, its S, its gains, no heading command."""
        return cls(
            reward=RewardConfig.paper(),
            observed=PAPER_SLICES,
            gains="paper",
            forward_speed=PAPER_SPEED,
            command_share=0.0,
            heading_range=0.0,
        )


@dataclass(frozen=True, kw_only=True)
class Curriculum:
    """What `GaitEnv` asks for at one time of a training; by default everything, as in a trial.

    Raises:
        GaitshiftError: a share is not in 0 to 1, or a factor is not above 0.
    """

    strictness: float = 1.0
    """How much of what only a clean gait can give is asked for, 0 to 1: how far the bonus depends
    on swing heights and punctuality, and factor on the price of chatter."""
    swing_factor: float = 1.0
    """Factor on the machine's swing heights."""
    stance_factor: float = 1.0
    """Factor on the weight of the whole stance, `RewardConfig.stance_pattern`."""
    command_scale: float = 1.0
    """The share of the gait's ranges that commands are drawn from, 0 to 1."""
    penalty_scale: float = 1.0
    """The factor λ on all penalties, 0 to 1 (paper III-D, where it is always 1)."""
    randomisation: float = 1.0
    """How far the ranges of what differs from robot to robot reach, 0 to 1."""
    mixed_starts: float = 0.0
    """The share of episodes that begin in the midst of a stride that is no gait's
    (`gaitshift.sim.env.mixed_start`), of those that begin while others go on, 0 to 1."""

    def __post_init__(self) -> None:
        for name in (
            "strictness",
            "command_scale",
            "penalty_scale",
            "randomisation",
            "mixed_starts",
        ):
            if not 0 <= getattr(self, name) <= 1:
                raise GaitshiftError(f"{name} must be 0 to 1, got {getattr(self, name)}")
        for name in ("swing_factor", "stance_factor"):
            if not getattr(self, name) > 0:
                raise GaitshiftError(f"{name} must be above 0, got {getattr(self, name)}")
