"""The way of joint targets to the joints: late, by a time that varies, and some are lost."""

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.sensor_config import SensorConfig


class Latency:
    """Which targets the joints of N robots follow, in units of physics steps.

    A target that is sent at the start of a control step arrives after the robot's own delay, which
    jitter changes from target to target, rounded to whole physics steps. Joints follow the newest
    target that has arrived: one that a later target overtakes is never used.
    """

    def __init__(
        self, config: SensorConfig, n: int, *, physics_step: float, rng: np.random.Generator
    ) -> None:
        """Call `restart` for all robots before the first `send`; `physics_step` is in seconds."""
        self.config, self.n = config, n
        self.rng = rng
        """Of all draws; may be replaced."""
        self._physics_step = physics_step
        self._substeps = round(CONTROL_PERIOD / physics_step)
        latest = int(np.ceil((config.delay[1] + config.jitter) / physics_step))
        kept = latest // self._substeps + 1
        self._held = np.zeros((n, 12))
        self._delay = np.zeros(n)
        self._targets = np.zeros((kept, n, 12))
        """Targets on their way, the oldest first."""
        self._due: Int[np.ndarray, "K N"] = np.full((kept, n), -1)
        """Physics steps until they arrive, from the start of the control step; negative: they have
        arrived, were lost or never sent."""

    def restart(self, ids: Int[np.ndarray, " K"], held: Float[np.ndarray, "K 12"]) -> None:
        """Robots start to follow the targets `held` [rad]; nothing is on its way.

        Their delay is drawn anew.
        """
        self._delay[ids] = self.rng.uniform(*self.config.delay, len(ids))
        self._held[ids] = held
        self._due[:, ids] = -1

    def send(
        self, target: Float[np.ndarray, "N 12"]
    ) -> list[tuple[int, Float[np.ndarray, "N 12"]]]:
        """Sends targets [rad]; gives those of the control step that begins.

        Each entry has a number of physics steps, and the targets that joints follow in them.
        """
        self._targets = np.concatenate([self._targets[1:], target[None]])
        self._due = np.concatenate([self._due[1:] - self._substeps, self._steps_until_due()[None]])
        followed: list[tuple[int, Float[np.ndarray, "N 12"]]] = []
        for now in range(self._substeps):
            if self._take(self._due == now) or not followed:
                followed.append((0, self._held.copy()))
            steps, held = followed[-1]
            followed[-1] = (steps + 1, held)
        return followed

    def _steps_until_due(self) -> Int[np.ndarray, " N"]:
        """Physics steps until new targets arrive, -1 where they never do."""
        delay = self._delay + self.config.jitter * self.rng.uniform(-1.0, 1.0, self.n)
        steps = np.round(np.maximum(delay, 0.0) / self._physics_step).astype(np.int64)
        return np.where(self.rng.random(self.n) < self.config.loss, -1, steps)

    def _take(self, arrived: Bool[np.ndarray, "K N"]) -> bool:
        """Whether joints follow new targets, among those that have arrived."""
        robots = np.flatnonzero(arrived.any(axis=0))
        newest = len(arrived) - 1 - arrived[::-1, robots].argmax(axis=0)
        self._held[robots] = self._targets[newest, robots]
        overtaken = np.arange(len(arrived))[:, None] <= newest
        self._due[:, robots] = np.where(overtaken, -1, self._due[:, robots])
        return robots.size > 0
