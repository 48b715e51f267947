"""What one robot behind a link is commanded, and how long its silence is borne."""

from dataclasses import dataclass

from gaitshift.data import check_ranges
from gaitshift.robot.command import MOST_HEIGHT, MOST_SPEED, MOST_YAW_RATE

WATCHDOG_RANGE = (0.02, 10.0)
"""Shortest and longest silence that a watchdog allows [s]; ours: two control steps, and far more
than a robot bears, for a machine that is shared."""


@dataclass(frozen=True, kw_only=True)
class DeploymentConfig:
    """How one robot is driven."""

    speed: float | None = None
    """Commanded forward speed [m/s]; None: that of the present gait."""
    lateral_speed: float = 0.0
    """Commanded lateral speed, to the left [m/s]."""
    yaw_rate: float = 0.0
    """Commanded yaw rate, to the left [rad/s]; at 0 the robot keeps its heading."""
    body_height: float | None = None
    """Commanded body height, from that of the stance [m]; None: that of the present gait."""
    watchdog: float = 0.05
    """Longest time without valid sensors before the soft stop [s]; ours: five control steps, in
    which a leg moves by less than a fifth of a stride."""

    def __post_init__(self) -> None:
        check_ranges(
            self,
            lateral_speed=(-MOST_SPEED, MOST_SPEED),
            yaw_rate=(-MOST_YAW_RATE, MOST_YAW_RATE),
            watchdog=WATCHDOG_RANGE,
        )
        if self.speed is not None:
            check_ranges(self, speed=(0.0, MOST_SPEED))
        if self.body_height is not None:
            check_ranges(self, body_height=(-MOST_HEIGHT, MOST_HEIGHT))
