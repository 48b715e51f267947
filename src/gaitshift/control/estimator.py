"""The velocity of the base from inertial unit, encoders and standing feet, by a Kalman filter.

Robots do not measure the velocity of their base. The filter follows Bloesch et al. ("State
Estimation for Legged Robots: Consistent Fusion of Leg Kinematics and IMU", RSS 2012) in the linear
form of Bledt et al. ("MIT Cheetah 3", IROS 2018), which takes the attitude as given. The
accelerometer is integrated, and standing feet show where the base goes. The states are the base
velocity v and the positions p of the four feet from the base, all in the body frame, so that
neither heading nor place is needed:

    dv/dt = f + g - ω × v        dp/dt = -v - ω × p + ω_shank × r n

with the specific force f and the upward normal n of level ground. p is measured by kinematics. All
noise is equal along x, y and z, so one 5 × 5 covariance serves the three axes, and rotations leave
it as it is. A foot begins anew where it is measured when it is in the air, when it has just come
down, and when the χ² gate rejects it because it slips or does not touch at all.

The last term is the rolling of a spherical foot of radius r: where it touches the ground it stands
still, v_contact = v_centre - ω_shank × r n = 0. `foot_position_b` is always r below the centre, so
in the level frame it moves as the centre does. Without the term, a trot of 1.2 m/s is estimated
0.06 m/s too slow.

filterpy, robot_localization, InEKF and the like estimate for one robot at a time; this estimates
for N in one pass of NumPy.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.data import check_ranges
from gaitshift.robot.description import Robot
from gaitshift.robot.state import GRAVITY, Batch, Proprioception

_UNKNOWN = 1.0
"""Standard deviation of a foot's position before it is measured [m]; ours: far above `foot`."""

_CROSS = np.array(
    [
        [0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ]
)
"""w @ _CROSS is a 3 × 3 matrix, row by row, with x @ matrix = x × w."""


@dataclass(frozen=True, kw_only=True)
class EstimatorConfig:
    """Noise of the estimator as standard deviations, equal on all axes.

    One set serves gyros of 0.005 to 0.1 rad/s, accelerometers of 0.05 to 0.3 m/s² and encoders of
    0.001 to 0.01 rad.
    """

    acceleration: float = 1.0
    """Of the base acceleration in a step [m/s²]; ours: an accelerometer shakes by 0.1 to 0.3, and a
    tilt that is wrong by 2° adds 0.3 that lasts."""
    foot: float = 0.005
    """Of foot positions by kinematics [m]; ours: encoders of 0.01 rad at legs of half a metre."""
    slip: float = 0.03
    """Of the speed of a standing foot over the ground [m/s]; ours: walking ANYmals show 0.01 to
    0.03, and a gyro of 0.05 rad/s shakes a foot at half a metre as much."""
    gate: float = 16.3
    """Squared distance, in standard deviations, beyond which a foot is rejected; χ² with three
    degrees of freedom exceeds it in one of a thousand steps."""
    start: float = 0.5
    """Of the velocity at the start, which is estimated as 0 [m/s]; ours: robots start at rest."""

    def __post_init__(self) -> None:
        check_ranges(
            self,
            acceleration=(1e-3, 100.0),
            foot=(1e-5, 0.1),
            slip=(0.0, 10.0),
            gate=(1.0, 1e6),
            start=(0.0, 10.0),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class EstimatorState(Batch):
    """Estimates of N robots, and what was measured a step ago."""

    velocity_b: Float[np.ndarray, "*batch 3"]
    """Velocity of the base origin [m/s]."""
    foot_b: Float[np.ndarray, "*batch 4 3"]
    """The lowest point of each foot from the base origin, body frame [m]."""
    covariance: Float[np.ndarray, "*batch 5 5"]
    """Of the velocity [m²/s²] and the feet [m²] along any one axis."""
    contact: Bool[np.ndarray, "*batch 4"]
    """Contacts a step ago."""
    angular_velocity_b: Float[np.ndarray, "*batch 3"]
    """Angular velocity a step ago [rad/s]."""
    joint_position: Float[np.ndarray, "*batch 12"]
    """Joint angles a step ago [rad]."""

    @property
    def velocity_deviation(self) -> Float[np.ndarray, "*batch"]:
        """Standard deviation of the velocity along any axis [m/s]."""
        return np.sqrt(self.covariance[..., 0, 0])


@dataclass(frozen=True, kw_only=True)
class Estimator:
    """Estimates the velocity of the base of N robots; their state is passed in and returned.

    `state.with_robots(ids, estimator.begin(len(ids)))` restarts single robots.
    """

    robot: Robot
    """Whose feet these are: spheres of its `foot_radius`. HAA turns about the body's x axis, HFE
    and KFE about the y axis that HAA turns."""
    config: EstimatorConfig = field(default_factory=EstimatorConfig)
    """Noise."""

    def begin(self, n: int) -> EstimatorState:
        """State of n robots a step before their first measurement."""
        covariance = np.zeros((n, 5, 5))
        covariance[:, 0, 0] = self.config.start**2
        return EstimatorState(
            velocity_b=np.zeros((n, 3)),
            foot_b=np.zeros((n, 4, 3)),
            covariance=covariance,
            contact=np.zeros((n, 4), dtype=bool),
            angular_velocity_b=np.zeros((n, 3)),
            joint_position=np.zeros((n, 12)),
        )

    def step(
        self, state: EstimatorState, sensed: Proprioception
    ) -> tuple[EstimatorState, Proprioception]:
        """State after a control step, and the proprioception with the estimate as `velocity_b`.

        Raises:
            GaitshiftError: `sensed` has no joint angles, angular velocity or specific force.
        """
        mean, covariance = self._predicted(state, sensed)
        measured, noise = sensed.foot_position_b, self._noise[0, 0]
        variance = covariance.reshape(-1, 25)[:, 6::6]  # of the feet; a view
        error = measured - mean[:, 1:]
        distance = np.einsum("nij,nij->ni", error, error) / (variance + noise)
        stands = sensed.contact & state.contact & (distance < self.config.gate)
        mean[:, 1:] = np.where(stands[:, :, None], mean[:, 1:], measured)
        known = np.ones((len(stands), 5))
        known[:, 1:] = stands
        covariance *= known[:, :, None] * known[:, None]
        variance += np.where(stands, 0.0, _UNKNOWN**2)
        across = covariance[:, :, 1:]
        gain = across @ np.linalg.inv(across[:, 1:] + self._noise)
        mean += gain @ (measured - mean[:, 1:])
        covariance -= gain @ covariance[:, 1:]
        after = EstimatorState(
            velocity_b=mean[:, 0],
            foot_b=mean[:, 1:],
            covariance=covariance,
            contact=sensed.contact,
            angular_velocity_b=sensed.need("angular_velocity_b", "the estimator"),
            joint_position=sensed.need("joint_position", "the estimator"),
        )
        return after, sensed.having(velocity_b=after.velocity_b)

    @cached_property
    def _noise(self) -> Float[np.ndarray, "4 4"]:
        """Covariance of the measured feet along any one axis [m²]."""
        return self.config.foot**2 * np.eye(4)

    def _predicted(
        self, state: EstimatorState, sensed: Proprioception
    ) -> tuple[Float[np.ndarray, "N 5 3"], Float[np.ndarray, "N 5 5"]]:
        """Velocity and feet after the step, by inertial unit and joints, and their covariance."""
        force = sensed.need("specific_force_b", "the estimator")
        rate = sensed.need("angular_velocity_b", "the estimator")
        joints = sensed.need("joint_position", "the estimator")
        period, n, up = sensed.period, len(force), -sensed.gravity_b
        turn = (0.5 * period) * (state.angular_velocity_b + rate)
        across = (turn @ _CROSS).reshape(n, 3, 3)  # x @ across = x × turn
        mean = np.concatenate((state.velocity_b[:, None], state.foot_b), axis=1)
        # To the body's frame at the end of the step: exp(-turn ×), up to the second order.
        turned = mean @ across
        mean += turned + 0.5 * turned @ across
        # The mean force is in the frame at the middle of the step.
        acceleration = force + 0.5 * (force[:, None] @ across)[:, 0] - GRAVITY * up
        mean[:, 0] += period * acceleration
        travel = period * (mean[:, 0] - (0.5 * period) * acceleration)
        mean[:, 1:] += self._rolled(state.joint_position, joints, turn, up) - travel[:, None]
        transition = np.eye(5)
        transition[1:, 0] = -period
        covariance = transition @ state.covariance @ transition.T + period**2 * self._drive
        return mean, covariance

    @cached_property
    def _drive(self) -> Float[np.ndarray, "5 5"]:
        """Covariance of what drives base [m²/s⁴] and feet [m²/s²], constant over a step."""
        return np.diag([self.config.acceleration**2, *[self.config.slip**2] * 4])

    def _rolled(
        self,
        before: Float[np.ndarray, "N 12"],
        after: Float[np.ndarray, "N 12"],
        turn: Float[np.ndarray, "N 3"],
        up: Float[np.ndarray, "N 3"],
    ) -> Float[np.ndarray, "N 4 3"]:
        """How far each foot rolls while the joints go to `after` and the base by `turn` [m]."""
        moved = (after - before).reshape(-1, 4, 3)
        abduction = 0.5 * (after + before)[:, ::3]
        flexion = moved[..., 1] + moved[..., 2]
        shank = np.empty((len(turn), 4, 3))
        shank[..., 0] = moved[..., 0]
        shank[..., 1] = np.cos(abduction) * flexion
        shank[..., 2] = np.sin(abduction) * flexion
        shank += turn[:, None]
        return self.robot.foot_radius * (shank @ (up @ _CROSS).reshape(-1, 3, 3))


class Estimation:
    """The estimated velocity of N robots, step after step, where it is not sensed but could be."""

    def __init__(self, robot: Robot, n: int) -> None:
        """Robots at rest; see `Estimator` for `robot`."""
        self._estimator = Estimator(robot=robot)
        self._state = self._estimator.begin(n)

    def restart(self, ids: Int[np.ndarray, " K"]) -> None:
        """These robots have been set down anew, at rest."""
        if ids.size:
            self._state = self._state.with_robots(ids, self._estimator.begin(len(ids)))

    def see(self, sensed: Proprioception) -> Proprioception:
        """What is sensed a step after the last call, with a velocity.

        One that is sensed stays. Without a specific force there is none.
        """
        if sensed.velocity_b is None and sensed.specific_force_b is not None:
            self._state, sensed = self._estimator.step(self._state, sensed)
        return sensed

    def seen(self, sensed: Proprioception) -> Proprioception:
        """The same before any time has passed since the last call, or since a restart."""
        if sensed.velocity_b is None and sensed.specific_force_b is not None:
            return sensed.having(velocity_b=self._state.velocity_b)
        return sensed
