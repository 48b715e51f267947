"""Sensors with errors: what robots sense of what perfect sensors would show."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.robot.description import Robot
from gaitshift.robot.kinematics import LegKinematics
from gaitshift.robot.state import GRAVITY, Privileged, Proprioception, rotation_of
from gaitshift.sim.attitude_filter import filtered, turn_between
from gaitshift.sim.sensor_config import SensorConfig

_REST_W = np.array([0.0, 0.0, GRAVITY])
"""Specific force at rest, in the world [m/s²]."""


class Sensors:
    """The sensors of N robots with the errors of a `SensorConfig`, for any simulator.

    State: biases, the attitude filter, contact errors that last, and the true motion at the last
    step. Torques and the mass are given as they are.

    The filter's gyro integrates the true turn of each step, because inertial units sample far
    faster than a control step. The accelerometer is at the base origin.
    """

    def __init__(
        self, config: SensorConfig, robot: Robot, n: int, rng: np.random.Generator
    ) -> None:
        """All draws come from `rng`. Call `restart` for all robots before the first `step`."""
        self.config, self.n = config, n
        self.rng = rng
        """Of all draws; may be replaced."""
        self._legs, self._foot_radius = LegKinematics.of(robot), robot.foot_radius
        self._gyro_bias, self._force_bias = np.zeros((n, 3)), np.zeros((n, 3))
        self._orientation, self._true_orientation = np.zeros((n, 4)), np.zeros((n, 4))
        self._velocity_w = np.zeros((n, 3))
        self._missed: Bool[np.ndarray, "N 4"] = np.zeros((n, 4), dtype=bool)
        self._false: Bool[np.ndarray, "N 4"] = np.zeros((n, 4), dtype=bool)

    def restart(
        self, ids: Int[np.ndarray, " K"], ideal: Proprioception, truth: Privileged
    ) -> Proprioception:
        """What all robots sense when the robots `ids` were set down and no others have moved.

        Biases of these robots are drawn anew. Their filter starts at the true orientation, and
        their accelerometer shows rest.

        Args:
            ids: which, in rising order; in the first call all.
            ideal: perfect proprioception of all robots, with joints and angular velocity.
            truth: their privileged state at the same instant.
        """
        config, count = self.config, len(ids)
        self._gyro_bias[ids] = self._noise(config.gyro_bias, count, 3)
        self._force_bias[ids] = self._noise(config.accelerometer_bias, count, 3)
        self._missed[ids] = self.rng.random((count, 4)) < config.contact_missed
        self._false[ids] = self.rng.random((count, 4)) < config.contact_false
        placed = truth.robots(ids)
        self._orientation[ids] = self._true_orientation[ids] = placed.base_quaternion_w
        rotation = rotation_of(placed.base_quaternion_w)
        self._velocity_w[ids] = np.einsum("nij,nj->ni", rotation, placed.velocity_b)
        gyro_error = self._gyro_bias[ids] + self._noise(config.gyro_noise, count, 3)
        force_b = rotation[:, 2] * GRAVITY + self._force_error(ids)
        part = self._read(ids, ideal.robots(ids), placed, gyro_error, force_b)
        self._sensed = part if count == self.n else self._sensed.with_robots(ids, part)
        return self._sensed

    def step(self, ideal: Proprioception, truth: Privileged) -> Proprioception:
        """What the robots sense a control step after the last call; arguments as in `restart`."""
        config, n, period = self.config, self.n, ideal.period
        self._gyro_bias += self._noise(config.gyro_bias_walk * np.sqrt(period), n, 3)
        gyro_error = self._gyro_bias + self._noise(config.gyro_noise, n, 3)
        turn = turn_between(self._true_orientation, truth.base_quaternion_w)
        self._true_orientation = truth.base_quaternion_w.copy()
        rotation = rotation_of(truth.base_quaternion_w)
        velocity_w = np.einsum("nij,nj->ni", rotation, truth.velocity_b)
        force_w = (velocity_w - self._velocity_w) / period + _REST_W
        self._velocity_w = velocity_w
        everyone = np.arange(n)
        force_b = np.einsum("nij,ni->nj", rotation, force_w) + self._force_error(everyone)
        self._orientation = filtered(
            self._orientation,
            turn / period + gyro_error,
            force_b,
            time_constant=config.attitude_time,
            period=period,
        )
        lasting = config.contact_error_time / period
        self._missed = self._last(self._missed, config.contact_missed, lasting)
        self._false = self._last(self._false, config.contact_false, lasting)
        across = np.cross(0.5 * turn, force_b)  # to the frame half a step ago, to second order
        mean_force_b = force_b + across + 0.5 * np.cross(0.5 * turn, across)
        self._sensed = self._read(everyone, ideal, truth, gyro_error, mean_force_b)
        return self._sensed

    def _read(
        self,
        ids: Int[np.ndarray, " K"],
        ideal: Proprioception,
        truth: Privileged,
        gyro_error: Float[np.ndarray, "K 3"],
        force_b: Float[np.ndarray, "K 3"],
    ) -> Proprioception:
        """What the robots `ids` sense, of which `ideal` and `truth` are."""
        config, count = self.config, len(ids)
        angle: Float[np.ndarray, "K 12"] = ideal.need("joint_position", "encoders") + self._noise(
            config.encoder_noise, count, 12
        )
        if config.encoder_step > 0:
            angle = np.round(angle / config.encoder_step) * config.encoder_step
        velocity = ideal.need("joint_velocity", "encoders")
        orientation = self._orientation[ids]
        up_b = rotation_of(orientation)[:, 2]
        lowest = self._legs.foot_centre_b(angle) - self._foot_radius * up_b[:, None]
        touching = truth.foot_force > config.contact_threshold
        return replace(
            ideal,
            contact=np.where(touching, ~self._missed[ids], self._false[ids]),
            foot_position_b=lowest,
            orientation=orientation,
            joint_position=angle,
            joint_velocity=velocity + self._noise(config.joint_velocity_noise, count, 12),
            velocity_b=ideal.velocity_b if config.measures_velocity else None,
            angular_velocity_b=ideal.need("angular_velocity_b", "gyro") + gyro_error,
            specific_force_b=force_b,
        )

    def _force_error(self, ids: Int[np.ndarray, " K"]) -> Float[np.ndarray, "K 3"]:
        noise = self._noise(self.config.accelerometer_noise, len(ids), 3)
        return self._force_bias[ids] + noise

    def _noise(self, deviation: float, *shape: int) -> Float[np.ndarray, "K C"]:
        return deviation * self.rng.standard_normal(shape)

    def _last(
        self, wrong: Bool[np.ndarray, "N 4"], share: float, steps: float
    ) -> Bool[np.ndarray, "N 4"]:
        """Errors a step later: they last `steps` on average and take up this share of all steps.

        A Markov chain of two states, whose stationary distribution is the share.
        """
        begins = share / (1.0 - share) / steps
        return self.rng.random(wrong.shape) < np.where(wrong, 1.0 - 1.0 / steps, begins)
