"""Commands in training: random speeds, stride frequencies and headings."""

from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float, Int

from gaitshift.gait import RewardMachine
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.sim.env.config import EnvConfig


class Commander:
    """The commands of N robots, redrawn at intervals."""

    def __init__(
        self, machine: RewardMachine, config: EnvConfig, n: int, rng: np.random.Generator
    ) -> None:
        self._machine, self._config, self._rng = machine, config, rng
        self._line: Float[np.ndarray, " N"] = np.zeros(n)
        self.heading: Float[np.ndarray, " N"] = np.zeros(n)
        """Wanted heading of each robot [rad]."""
        self.command = self._own(n)
        """The present command."""

    def restart(
        self, ids: Int[np.ndarray, " K"], yaw: Float[np.ndarray, " K"], scale: float
    ) -> None:
        """Draws commands for new episodes of these robots, on lines along `yaw` [rad].

        `scale` is the share of the gait's ranges from which commands are drawn, here and in
        `update`.
        """
        self._line[ids] = self.heading[ids] = yaw
        self._draw(ids, scale)

    def update(
        self, age: Int[np.ndarray, " N"], yaw: Float[np.ndarray, " N"], scale: float
    ) -> None:
        """Draws the commands that are due, and commands every robot to turn to its heading.

        Args:
            age: steps since each episode began.
            yaw: present headings [rad].
            scale: as in `restart`.
        """
        config = self._config
        due = np.flatnonzero(age % config.command_interval == config.command_interval - 1)
        if due.size and config.heading_range > 0:
            turn = self._rng.uniform(-config.heading_range, config.heading_range, due.size)
            self.heading[due] = self._line[due] + turn
        if due.size:
            self._draw(due, scale)
        if config.heading_range > 0:
            yaw_rate = config.heading_loop.yaw_rate(yaw, self.heading)
            self.command = replace(self.command, yaw_rate=yaw_rate)

    def ranges(self) -> dict[str, Any]:
        """Nominal value and range of forward speed and stride frequency."""
        own, machine = self._own(1), self._machine
        speed, frequency = float(own.forward_speed[0]), float(own.stride_frequency[0])
        slow, fast = (1.0 / (machine.stride(d) * CONTROL_PERIOD) for d in machine.dwell_range[::-1])
        varied = self._config.command_share > 0
        return {
            "forward_speed": speed,
            "speed_range": list(machine.speed_range) if varied else [speed, speed],
            "stride_frequency": frequency,
            "stride_frequency_range": [slow, fast] if varied else [frequency, frequency],
        }

    def _own(self, n: int) -> Command:
        """Straight ahead at the config's speed, or the gait's, and the gait's frequency."""
        machine, speed = self._machine, self._config.forward_speed
        frequency = 1.0 / (machine.stride() * CONTROL_PERIOD)
        return Command.straight(n, machine.speed if speed is None else speed, frequency)

    def _draw(self, ids: Int[np.ndarray, " K"], scale: float) -> None:
        """Gives these robots a speed and a stride frequency, each drawn or nominal."""
        share = self._config.command_share
        if share == 0 or scale == 0:
            return
        machine, rng, own = self._machine, self._rng, self._own(len(ids))
        drawn = rng.random((2, len(ids))) < share
        home = own.forward_speed
        speed = rng.uniform(*machine.speed_range, len(ids))
        low, high = machine.dwell_range
        dwell = machine.dwell + scale * (rng.uniform(low, high, len(ids)) - machine.dwell)
        strides = np.array([machine.stride(d) for d in np.rint(dwell).astype(int).tolist()])
        speeds, frequencies = (
            getattr(self.command, name).copy() for name in ("forward_speed", "stride_frequency")
        )
        speeds[ids] = np.where(drawn[0], home + scale * (speed - home), home)
        frequencies[ids] = np.where(
            drawn[1], 1.0 / (strides * CONTROL_PERIOD), own.stride_frequency
        )
        self.command = replace(self.command, forward_speed=speeds, stride_frequency=frequencies)
