"""Small rivals of the paper's statistic, and the commanded speed, for gait graphs."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from gaitshift.robot.state import GRAVITY, Proprioception
from gaitshift.shift.statistic import SIX_LEAKS, SearchRange, check_positive


@dataclass(frozen=True, kw_only=True)
class AttitudeVariance:
    """Standard deviation of roll and pitch together, about their own running means [rad].

    Means forget by e in `window`. NaN until a window has gone by.
    """

    window: float = 1.0
    """[s]"""

    unit = "rad"
    width = 1
    needs = ()
    search = SearchRange(low=0.003, high=0.3, note="spread of roll and pitch over time")

    def __post_init__(self) -> None:
        check_positive(self, "window")

    def start(self, n: int) -> Float[np.ndarray, "N 5"]:
        """Sum of weights, means of roll and pitch, and of their squared distances from them."""
        return np.zeros((n, 5))

    def step(
        self, state: Float[np.ndarray, "N 5"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 5"], Float[np.ndarray, "N 1"]]:
        """Means after this step, and the deviation."""
        x, y, z = sensed.gravity_b.T
        angle = np.stack([np.arctan2(-y, -z), np.arctan2(x, np.hypot(y, z))], axis=1)
        share = sensed.period / self.window
        weight = state[:, :1] + share * (1.0 - state[:, :1])
        gain = share / weight  # a plain mean at first, then a forgetting one
        off = angle - state[:, 1:3]
        mean = state[:, 1:3] + gain * off
        square = (1.0 - gain) * (state[:, 3:] + gain * off * off)
        value = np.sqrt(square.sum(axis=1, keepdims=True))
        after = np.concatenate([weight, mean, square], axis=1)
        return after, np.where(weight < 1.0 - np.exp(-1.0), np.nan, value)


@dataclass(frozen=True, kw_only=True)
class CostOfTransport:
    """Σ|τ q̇| / (m g v) over a running window; NaN until the window has gone by once."""

    window: float = 1.0
    """Power and speed are means that forget by e in this time [s]."""
    least_speed: float = 0.1
    """A slower robot counts as this fast [m/s]."""

    unit = ""
    width = 1
    needs = ("joint_torque", "joint_velocity", "velocity_b", "mass")
    search = SearchRange(low=0.1, high=10.0, note="mechanical power over weight and speed")

    def __post_init__(self) -> None:
        check_positive(self, "window", "least_speed")

    def start(self, n: int) -> Float[np.ndarray, "N 3"]:
        """Sum of weights, mean power [W] and mean forward speed [m/s], nothing seen yet."""
        return np.zeros((n, 3))

    def step(
        self, state: Float[np.ndarray, "N 3"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 1"]]:
        """Means after this step, and the cost."""
        mass = sensed.need("mass", "cost_of_transport")
        power = sensed.power
        speed = sensed.forward_speed
        now = np.stack([np.ones(len(power)), power, speed], axis=1)
        after = state + sensed.period / self.window * (now - state)
        weight, mean_power, mean_speed = after.T
        mean_speed = np.maximum(mean_speed / weight, self.least_speed)
        cost = mean_power / weight / (mass * GRAVITY * mean_speed)
        return after, np.where(weight < 1.0 - np.exp(-1.0), np.nan, cost)[:, None]


@dataclass(frozen=True, kw_only=True, eq=False)
class SlipState:
    """What `Slip` remembers."""

    position_b: Float[np.ndarray, "N 4 3"]
    """Feet a step ago [m]."""
    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""
    speed: Float[np.ndarray, "N 4"]
    """Running mean of the speed of each foot while it touches [m/s]; NaN before that."""


@dataclass(frozen=True, kw_only=True)
class Slip:
    """Speed of each foot over the ground while it touches [m/s], a running mean.

    v + ω × p + ṗ in the body frame: base velocity from the robot's state estimation, the foot's own
    from two steps in which it touched. The mean forgets by e in `window` of contact.
    """

    window: float = 0.2
    """[s of contact]"""

    unit = "m/s"
    width = 4
    needs = ("velocity_b", "angular_velocity_b")
    search = SearchRange(low=0.02, high=2.0, leaks=SIX_LEAKS, note="speed of the feet in contact")

    def __post_init__(self) -> None:
        check_positive(self, "window")

    def start(self, n: int) -> SlipState:
        """State of n robots that have not been seen."""
        return SlipState(
            position_b=np.zeros((n, 4, 3)),
            contact=np.zeros((n, 4), dtype=bool),
            speed=np.full((n, 4), np.nan),
        )

    def step(
        self, state: SlipState, sensed: Proprioception
    ) -> tuple[SlipState, Float[np.ndarray, "N 4"]]:
        """Mean speeds after this step."""
        velocity: np.ndarray = sensed.need("velocity_b", "slip")[:, None]
        angular: np.ndarray = sensed.need("angular_velocity_b", "slip")[:, None]
        position = sensed.foot_position_b
        own = (position - state.position_b) / sensed.period
        speed: np.ndarray = np.linalg.norm(velocity + np.cross(angular, position) + own, axis=2)
        share = min(1.0, sensed.period / self.window)
        mean = state.speed + share * (speed - state.speed)
        mean = np.where(np.isnan(state.speed), speed, mean)
        mean = np.where(sensed.contact & state.contact, mean, state.speed)
        return SlipState(position_b=position, contact=sensed.contact, speed=mean), mean


@dataclass(frozen=True, kw_only=True)
class SpeedCommand:
    """The commanded speed over the ground, in any direction [m/s]."""

    unit = "m/s"
    width = 1
    needs = ("forward_speed_command",)
    search = None

    def start(self, n: int) -> None:
        """Nothing to remember."""

    def step(self, state: None, sensed: Proprioception) -> tuple[None, Float[np.ndarray, "N 1"]]:
        """The command of this step; without a lateral command it is the forward speed."""
        forward, lateral = (
            sensed.need("forward_speed_command", "speed"),
            sensed.lateral_speed_command,
        )
        speed = forward if lateral is None else np.hypot(forward, lateral)
        return None, speed[:, None]


@dataclass(frozen=True, kw_only=True, eq=False)
class TimingState:
    """What `ContactTiming` remembers."""

    contact: Bool[np.ndarray, "N 4"]
    """Contacts a step ago."""
    touchdown: Float[np.ndarray, "N 4"]
    """When each foot last came down [s]; NaN before that."""
    error: Float[np.ndarray, "N 4"]
    """By how much its last stride was off [s]; NaN before two touchdowns."""


@dataclass(frozen=True, kw_only=True)
class ContactTiming:
    """By how much the last stride of each foot was shorter or longer than commanded [s].

    A stride lasts from touchdown to touchdown; the machine's cycle is as long as the commanded
    stride frequency says. A foot that is overdue shows it before it comes down.
    """

    unit = "s"
    width = 4
    needs = ("stride_frequency_command",)
    search = SearchRange(
        low=0.005, high=0.5, leaks=SIX_LEAKS, note="strides shorter or longer than commanded"
    )

    def start(self, n: int) -> TimingState:
        """State of n robots of which no foot has come down."""
        return TimingState(
            contact=np.ones((n, 4), dtype=bool),
            touchdown=np.full((n, 4), np.nan),
            error=np.full((n, 4), np.nan),
        )

    def step(
        self, state: TimingState, sensed: Proprioception
    ) -> tuple[TimingState, Float[np.ndarray, "N 4"]]:
        """Errors after this step."""
        stride = 1.0 / sensed.need("stride_frequency_command", "contact_timing")[:, None]
        down = sensed.contact & ~state.contact
        since = sensed.time - state.touchdown
        error = np.where(down, np.abs(since - stride), state.error)
        touchdown = np.where(down, sensed.time, state.touchdown)
        after = TimingState(contact=sensed.contact, touchdown=touchdown, error=error)
        return after, np.fmax(error, sensed.time - touchdown - stride)


@dataclass(frozen=True, kw_only=True)
class ValueDrop:
    """Slow running mean of the critic's value less the fast one; NaN for the first slow window."""

    fast: float = 0.5
    """Window of the fast mean [s]: a stride, over which values swing."""
    slow: float = 4.0
    """Window of the slow mean [s]."""

    unit = ""
    width = 1
    needs = ("value",)
    search = SearchRange(low=0.01, high=100.0, note="drop of the return that the critic expects")

    def __post_init__(self) -> None:
        check_positive(self, "fast", "slow")

    def start(self, n: int) -> Float[np.ndarray, "N 3"]:
        """Fast mean, slow mean, and the steps seen."""
        return np.zeros((n, 3))

    def step(
        self, state: Float[np.ndarray, "N 3"], sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 3"], Float[np.ndarray, "N 1"]]:
        """Means after this step, and the drop."""
        value = sensed.need("value", "value_drop")
        fast, slow, seen = state.T
        seen = seen + 1.0
        fast = fast + np.maximum(1.0 / seen, sensed.period / self.fast) * (value - fast)
        slow = slow + np.maximum(1.0 / seen, sensed.period / self.slow) * (value - slow)
        drop = np.where(seen * sensed.period < self.slow, np.nan, slow - fast)
        return np.stack([fast, slow, seen], axis=1), drop[:, None]
