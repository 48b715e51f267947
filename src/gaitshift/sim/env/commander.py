"""The commands of robots in training, drawn at random."""

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
        self._turn: Float[np.ndarray, " N"] = np.full(n, np.nan)
        # [rad/s]; NaN: the robot has a wanted heading
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
        turns = config.heading_range > 0 and not self._machine.stands
        if due.size and turns:
            turn = self._rng.uniform(-config.heading_range, config.heading_range, due.size)
            self.heading[due] = self._line[due] + turn
        if due.size:
            self._draw(due, scale)
        if turns:
            yaw_rate = config.heading_loop.yaw_rate(yaw, self.heading)
            if config.turn_share > 0:
                is_turning = ~np.isnan(self._turn)
                yaw_rate = np.where(is_turning, self._turn, yaw_rate)
                self._line = np.where(is_turning, yaw, self._line)
                self.heading = np.where(is_turning, yaw, self.heading)
            self.command = replace(self.command, yaw_rate=yaw_rate)

    def ranges(self) -> dict[str, Any]:
        """Nominal value and range of every part of the command."""
        own, machine = self._own(1), self._machine
        speed, frequency = float(own.forward_speed[0]), float(own.stride_frequency[0])
        slow, fast = (1.0 / (machine.stride(d) * CONTROL_PERIOD) for d in machine.dwell_range[::-1])
        varied = self._config.command_share > 0
        return {
            "forward_speed": speed,
            "speed_range": list(machine.speed_range) if varied else [speed, speed],
            "stride_frequency": frequency,
            "stride_frequency_range": [slow, fast] if varied else [frequency, frequency],
            "lateral_speed": machine.lateral_speed if varied else 0.0,
            "body_height": machine.height,
            "height_range": list(machine.height_range if varied else [machine.height] * 2),
        }

    def ends(self) -> Command:
        """Two commands, with the lowest and with the highest value of every part."""
        ranges, config = self.ranges(), self._config
        turn = config.heading_loop.yaw_rate_limit
        turns = not self._machine.stands and max(config.heading_range, config.turn_share) > 0
        side = ranges["lateral_speed"]
        return Command(
            forward_speed=np.array(ranges["speed_range"]),
            stride_frequency=np.array(ranges["stride_frequency_range"]),
            yaw_rate=turns * np.array([-turn, turn]),
            lateral_speed=np.array([-side, side]),
            body_height=np.array(ranges["height_range"]),
        )

    def _own(self, n: int) -> Command:
        """Straight ahead at the config's speed, or the gait's, and the gait's frequency."""
        machine, speed = self._machine, self._config.forward_speed
        frequency = 1.0 / (machine.stride() * CONTROL_PERIOD)
        straight = Command.straight(n, machine.speed if speed is None else speed, frequency)
        return replace(straight, body_height=np.full(n, machine.height))

    def _draw(self, ids: Int[np.ndarray, " K"], scale: float) -> None:
        """Gives these robots a command, of which each part is drawn or nominal."""
        share = self._config.command_share
        if share == 0 or scale == 0:
            return
        machine, rng, own = self._machine, self._rng, self._own(len(ids))
        drawn = rng.random((2, len(ids))) < share
        home = own.forward_speed
        slow, fast = machine.speed_range
        margin = self._config.speed_margin * (fast - slow)
        speed = rng.uniform(max(slow - margin, 0.0), fast + margin, len(ids))
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
        if machine.lateral_speed > 0:
            self._draw_one(
                ids, "lateral_speed", (-machine.lateral_speed, machine.lateral_speed), scale
            )
        if machine.has_height:
            self._draw_one(ids, "body_height", machine.height_range, scale)
        if self._config.turn_share > 0:
            is_turning = rng.random(len(ids)) < self._config.turn_share
            most = scale * self._config.heading_loop.yaw_rate_limit
            turn = rng.uniform(-most, most, len(ids))
            self._turn[ids] = np.where(is_turning, turn, np.nan)

    def _draw_one(
        self, ids: Int[np.ndarray, " K"], name: str, ends: tuple[float, float], scale: float
    ) -> None:
        """Gives these robots a part of the command that is drawn or nominal."""
        home, rng = getattr(self._own(len(ids)), name), self._rng
        drawn = rng.random(len(ids)) < self._config.command_share
        asked = getattr(self.command, name).copy()
        asked[ids] = np.where(drawn, home + scale * (rng.uniform(*ends, len(ids)) - home), home)
        self.command = replace(self.command, **{name: asked})
