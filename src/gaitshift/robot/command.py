"""What a robot is asked to do: speed, yaw rate, stride frequency; and two loops about it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

CONTROL_PERIOD = 0.01
"""One control step [s]: the paper's 100 Hz (IV-A)."""

ACTION_LIMIT = 10.0
"""Actions are clipped to ± this, in training as after it; ours: 3 rad of joint target, beyond
anything a walking leg asks for."""

PAPER_SPEED = 1.2
"""Commanded forward speed v_d [m/s] (paper III-C)."""

MOST_SPEED = 3.0
"""Greatest speed that may be asked for [m/s]; ours: a joint at its limit swings a leg this fast."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """What each of N robots is asked to do at one instant."""

    forward_speed: Float[np.ndarray, " N"]
    """Wanted base velocity along body x [m/s]."""
    yaw_rate: Float[np.ndarray, " N"]
    """Wanted base angular velocity about body z [rad/s]."""
    stride_frequency: Float[np.ndarray, " N"]
    """Wanted cycles of the gait's machine a second [Hz]."""

    @property
    def stride(self) -> Float[np.ndarray, " N"]:
        """Wanted time of a cycle [control steps]."""
        return 1.0 / (self.stride_frequency * CONTROL_PERIOD)

    def of(self, ids: Int[np.ndarray, " K"]) -> "Command":
        """The command of some of the robots, in the order of `ids`."""
        return Command(
            forward_speed=self.forward_speed[ids],
            yaw_rate=self.yaw_rate[ids],
            stride_frequency=self.stride_frequency[ids],
        )

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


@dataclass(frozen=True, kw_only=True)
class HeadingLoop:
    """A proportional loop from heading and lateral error to a yaw-rate command.

    Ours: neither the reward nor the observation of the paper knows a heading, so without it robots
    wander off their line.
    """

    heading_gain: float = 1.5
    """Yaw rate per heading error [1/s]; ours: settles within 2 s at the yaw-rate limit."""
    lateral_gain: float = 0.5
    """Wanted heading per lateral error [rad/m]; ours."""
    heading_limit: float = 0.6
    """Largest heading towards the line [rad]; ours."""
    yaw_rate_limit: float = 0.5
    """Largest commanded yaw rate [rad/s]; ours: what the policies are trained for."""

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
        error = heading + towards - yaw
        wrapped = np.arctan2(np.sin(error), np.cos(error))
        return np.clip(self.heading_gain * wrapped, -self.yaw_rate_limit, self.yaw_rate_limit)


@dataclass(frozen=True, kw_only=True, eq=False)
class SpeedState:
    """What `SpeedLoop` remembers of N robots."""

    mean: Float[np.ndarray, " N"]
    """Running mean of the forward speed [m/s]."""
    trim: Float[np.ndarray, " N"]
    """What is added to the wanted speed [m/s]."""


@dataclass(frozen=True, kw_only=True)
class SpeedLoop:
    """An integral loop from the forward speed to the speed that a policy is asked for.

    Ours: within a stride the speed of a bound swings by half a metre a second, and a reward of each
    instant leaves the mean of a policy off by up to a tenth. Only small errors are trimmed away: a
    robot that the ground holds up is not asked to run.
    """

    gain: float = 0.8
    """Trim per error and second [1/s]; ours: settles within two or three seconds."""
    window: float = 0.5
    """The mean forgets by e in this time [s]; ours: about a stride."""
    reach: float = 0.25
    """Errors of the mean up to this are trimmed away [m/s]."""
    limit: float = 0.15
    """Largest trim [m/s]."""

    def start(self, n: int) -> SpeedState:
        """State of n robots at rest."""
        return SpeedState(mean=np.zeros(n), trim=np.zeros(n))

    def step(
        self,
        state: SpeedState,
        wanted: Float[np.ndarray, " N"],
        speed: Float[np.ndarray, " N"],
    ) -> tuple[SpeedState, Float[np.ndarray, " N"]]:
        """State after a control step, and the speed to ask for [m/s].

        `speed` is the velocity along body x, `wanted` what it should be in the mean [m/s].
        """
        mean = state.mean + CONTROL_PERIOD / self.window * (speed - state.mean)
        grown = state.trim + self.gain * CONTROL_PERIOD * (wanted - speed)
        near = np.abs(wanted - mean) < self.reach
        trim = np.where(near, np.clip(grown, -self.limit, self.limit), state.trim)
        return SpeedState(mean=mean, trim=trim), np.maximum(wanted + trim, 0.0)
