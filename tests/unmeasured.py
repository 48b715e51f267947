"""Robots that measure no velocity: what they sense, made from perfect proprioception."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.world import World
from worlds import GRAVITY, attitude_of, velocity_w


class Unmeasured(World):
    """A world whose robots have a noisy inertial unit in place of their velocity."""

    def __init__(self, terrain, n, *, robot=ANYMAL_B, gyro=0.0, accelerometer=0.0, seed=0):
        self._rng = np.random.default_rng(seed)
        self._gyro, self._accelerometer = gyro, accelerometer
        super().__init__(robot, terrain, n)

    def place(self, ids, **where):
        super().place(ids, **where)
        self._sense(attitude_of(self.truth), np.zeros((self.n, 3)))

    def step(self, target):
        before, attitude = velocity_w(self.truth), attitude_of(self.truth)
        super().step(target)
        turn = attitude.inv() * attitude_of(self.truth)
        middle = attitude * Rotation.from_rotvec(0.5 * turn.as_rotvec())
        self._sense(middle, (velocity_w(self.truth) - before) / self.sensed.period)
        return self.sensed, self.truth

    def _sense(self, attitude, acceleration_w):
        force = attitude.inv().apply(acceleration_w + np.array([0.0, 0.0, GRAVITY]))
        gyro, accelerometer = (
            deviation * self._rng.normal(size=(self.n, 3))
            for deviation in (self._gyro, self._accelerometer)
        )
        self.sensed = replace(
            self.sensed,
            velocity_b=None,
            specific_force_b=force + accelerometer,
            angular_velocity_b=self.sensed.angular_velocity_b + gyro,
        )
