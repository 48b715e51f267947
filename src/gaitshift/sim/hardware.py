"""What stands between a simulator and a controller: the sensors, and the link to the joints."""

import numpy as np
from jaxtyping import Float, Int

from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import Robot
from gaitshift.robot.state import Privileged, Proprioception
from gaitshift.sim.latency import Latency
from gaitshift.sim.sensor_config import SensorConfig
from gaitshift.sim.sensors import Sensors


class Hardware:
    """Sensors and link of N robots, for any simulator; perfect ones compute nothing."""

    def __init__(self, config: SensorConfig, robot: Robot, n: int, *, seed: int) -> None:
        """Call `run_at` before anything else, and `restart` for all robots before `sense`."""
        self._config, self._n = config, n
        measuring, self._sending = _streams(seed)
        self._sensors = None if config.is_perfect else Sensors(config, robot, n, measuring)
        self._latency: Latency | None = None
        self._substeps = 1

    def run_at(self, physics_step: float) -> None:
        """Sets the time of a step of the physics [s]; targets on their way are lost."""
        self._substeps = round(CONTROL_PERIOD / physics_step)
        late = Latency(self._config, self._n, physics_step=physics_step, rng=self._sending)
        self._latency = None if self._config.is_immediate else late

    def reseed(self, seed: int) -> None:
        """Begins all errors anew with this seed, from the next `restart` on."""
        measuring, self._sending = _streams(seed)
        if self._sensors:
            self._sensors.rng = measuring
        if self._latency:
            self._latency.rng = self._sending

    def followed(
        self, target: Float[np.ndarray, "N 12"]
    ) -> list[tuple[int, Float[np.ndarray, "N 12"]]]:
        """What the joints follow in a control step that begins when `target` [rad] is sent.

        Each entry has a number of physics steps, and the targets that joints follow in them.
        """
        return self._latency.send(target) if self._latency else [(self._substeps, target)]

    def restart(
        self,
        ids: Int[np.ndarray, " K"],
        ideal: Proprioception,
        truth: Privileged,
        held: Float[np.ndarray, "K 12"],
    ) -> Proprioception:
        """What all robots sense when `ids` were set down, whose joints are driven to `held`.

        Arguments are those of `Sensors.restart` and `Latency.restart`.
        """
        if self._latency:
            self._latency.restart(ids, held)
        return self._sensors.restart(ids, ideal, truth) if self._sensors else ideal

    def sense(self, ideal: Proprioception, truth: Privileged) -> Proprioception:
        """What the robots sense a control step after the last call."""
        return self._sensors.step(ideal, truth) if self._sensors else ideal


def _streams(seed: int) -> tuple[np.random.Generator, np.random.Generator]:
    """Random generators of the sensors and of the link."""
    measuring, sending = map(np.random.default_rng, np.random.SeedSequence(seed).spawn(2))
    return measuring, sending
