"""Commands of a robot: velocity, yaw rate, stride frequency, body height; and two loops."""

from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float, Int

CONTROL_PERIOD = 0.01
"""One control step [s]: the paper's 100 Hz (IV-A)."""

ACTION_LIMIT = 10.0
"""Actions are clipped to ± this, in training and after it; ours: 3 rad of joint target, more than
a walking leg needs."""

PAPER_SPEED = 1.2
"""Commanded forward speed v_d [m/s] (paper III-C)."""

MOST_SPEED = 3.0
"""Greatest speed command [m/s]; ours: a joint at its speed limit swings a leg this fast."""

MOST_YAW_RATE = 3.0
"""Greatest yaw-rate command [rad/s]; ours."""

MOST_HEIGHT = 0.3
"""Furthest from the stance that a body height may be commanded [m]; ours: half of ANYmal's leg."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """The commands of N robots at one instant."""

    forward_speed: Float[np.ndarray, " N"]
    """Commanded base velocity along body x [m/s]."""
    yaw_rate: Float[np.ndarray, " N"]
    """Commanded base angular velocity about body z [rad/s]."""
    stride_frequency: Float[np.ndarray, " N"]
    """Commanded cycles of the gait's machine per second [Hz]."""
    lateral_speed: Float[np.ndarray, " N"] = None  # pyright: ignore[reportAssignmentType]
    """Commanded base velocity along body y [m/s]; 0 where it is not given."""
    body_height: Float[np.ndarray, " N"] = None  # pyright: ignore[reportAssignmentType]
    """Commanded height of the base above that of the robot's stance [m]; 0 where not given."""

    def __post_init__(self) -> None:
        for name in ("lateral_speed", "body_height"):
            if getattr(self, name) is None:
                object.__setattr__(self, name, np.zeros(len(self.forward_speed)))

    @property
    def stride(self) -> Float[np.ndarray, " N"]:
        """Commanded time of a cycle [control steps]."""
        return 1.0 / (self.stride_frequency * CONTROL_PERIOD)

    def of(self, ids: Int[np.ndarray, " K"]) -> "Command":
        """The command of some of the robots, in the order of `ids`."""
        return Command(**{name: getattr(self, name)[ids] for name in COMMAND_PARTS})

    def sensed(self) -> dict[str, Float[np.ndarray, " N"]]:
        """The command as fields of a `Proprioception`."""
        return {f"{name}_command": getattr(self, name) for name in COMMAND_PARTS}

    @classmethod
    def straight(
        cls, n: int, forward_speed: float = PAPER_SPEED, stride_frequency: float = 2.5
    ) -> "Command":
        """Straight ahead for n robots at one speed [m/s] and stride frequency [Hz]."""
        return cls(
            forward_speed=np.full(n, float(forward_speed)),
            yaw_rate=np.zeros(n),
            stride_frequency=np.full(n, float(stride_frequency)),
        )


COMMAND_PARTS = tuple(field.name for field in fields(Command))
"""Names of the parts of a command."""


TURN_HEADROOM = 1.5
"""Greatest yaw rate given to a policy over the one that is wanted; ours: shipped policies turn at
two thirds of what they are given, up to 0.75 rad/s."""


@dataclass(frozen=True, kw_only=True)
class HeadingLoop:
    """A proportional loop from heading and lateral error to a yaw-rate command.

    Ours: the paper's reward and observation have no heading, so without the loop robots leave their
    line.
    """

    heading_gain: float = 1.5
    """Yaw rate per heading error [1/s]; ours: settles within 2 s at the yaw-rate limit."""
    lateral_gain: float = 0.5
    """Target heading per lateral error [rad/m]; ours."""
    heading_limit: float = 0.6
    """Largest heading towards the line [rad]; ours."""
    yaw_rate_limit: float = 0.5
    """Largest commanded yaw rate [rad/s]; ours: the range of the training."""

    def yaw_rate(
        self,
        yaw: Float[np.ndarray, " N"],
        heading: Float[np.ndarray, " N"],
        lateral_error: Float[np.ndarray, " N"] | float = 0.0,
    ) -> Float[np.ndarray, " N"]:
        """Yaw rate [rad/s] that turns a robot at `yaw` [rad] towards the line along `heading`.

        `lateral_error` [m] is how far left of the line the robot stands.
        """
        towards = np.clip(
            -self.lateral_gain * lateral_error, -self.heading_limit, self.heading_limit
        )
        error = _wrapped(heading + towards - yaw)
        return np.clip(self.heading_gain * error, -self.yaw_rate_limit, self.yaw_rate_limit)

    def turning(
        self,
        yaw: Float[np.ndarray, " N"],
        heading: Float[np.ndarray, " N"],
        yaw_rate: float,
    ) -> tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]:
        """The next heading of robots that turn at `yaw_rate` [rad/s], and their yaw rates [rad/s].

        The heading turns at that rate, and a robot that is not at it gets a correction, up to
        `TURN_HEADROOM` times the rate. While it turns, the heading stays within `heading_limit` of
        the robot, which may be too slow.
        """
        error = _wrapped(heading + yaw_rate * CONTROL_PERIOD - yaw)
        ahead = heading
        if yaw_rate != 0.0:
            error = np.clip(error, -self.heading_limit, self.heading_limit)
            ahead = yaw + error
        most = max(self.yaw_rate_limit, TURN_HEADROOM * abs(yaw_rate))
        return ahead, np.clip(yaw_rate + self.heading_gain * error, -most, most)


def _wrapped(angle: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    return np.arctan2(np.sin(angle), np.cos(angle))


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedState:
    """State of `SpeedLoop` for N robots."""

    mean: Float[np.ndarray, " N"]
    """Running mean of the forward speed [m/s]."""
    trim: Float[np.ndarray, " N"]
    """Correction that is added to the target speed [m/s]."""


@dataclass(frozen=True, kw_only=True)
class SpeedLoop:
    """An integral loop from the forward speed to the commanded speed of a policy.

    Ours: the speed of a bound oscillates by 0.5 m/s within a stride, and a policy trained with a
    reward at each instant has a mean speed that is wrong by up to 0.1 m/s. Only small errors are
    corrected: a robot that the ground slows down is not commanded to run.
    """

    gain: float = 0.8
    """Trim per error and second [1/s]; ours: settles within two or three seconds. 0: no trim."""
    window: float = 0.5
    """Time constant of the mean [s]; ours: about a stride."""
    reach: float = 0.25
    """Largest error of the mean that is corrected [m/s]."""
    limit: float = 0.15
    """Largest trim upwards [m/s]."""
    slowing: float = 0.35
    """Largest trim downwards [m/s]; ours: policies that learn on rough ground are up to 0.25 m/s
    too fast at their slowest speeds, and a lower command is no danger."""

    def start(self, n: int) -> SpeedState:
        """State of n robots at rest."""
        return SpeedState(mean=np.zeros(n), trim=np.zeros(n))

    def step(
        self,
        state: SpeedState,
        wanted: Float[np.ndarray, " N"],
        speed: Float[np.ndarray, " N"],
    ) -> tuple[SpeedState, Float[np.ndarray, " N"]]:
        """State after a control step, and the speed to command [m/s].

        `speed` is the velocity along body x, `wanted` the target of its mean [m/s].
        """
        mean = state.mean + CONTROL_PERIOD / self.window * (speed - state.mean)
        grown = state.trim + self.gain * CONTROL_PERIOD * (wanted - speed)
        near = np.abs(wanted - mean) < self.reach
        trim = np.where(near, np.clip(grown, -self.slowing, self.limit), state.trim)
        return SpeedState(mean=mean, trim=trim), np.maximum(wanted + trim, 0.0)
