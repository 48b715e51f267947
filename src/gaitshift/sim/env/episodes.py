"""What training draws at random for an episode: commands, and starts in mid-stride."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control.observation import GaitState
from gaitshift.gait import RewardMachine
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.robot.state import Privileged, Proprioception, rotation_of
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


@dataclass(frozen=True, kw_only=True, eq=False)
class MixedStart:
    """State of K robots in mid-stride."""

    joint_position: Float[np.ndarray, "K 12"]
    """[rad]"""
    joint_velocity: Float[np.ndarray, "K 12"]
    """[rad/s]"""
    attitude: Float[np.ndarray, "K 4"]
    """Of the base, with its heading (w, x, y, z)."""
    base_velocity_w: Float[np.ndarray, "K 3"]
    """[m/s]"""
    base_angular_velocity_b: Float[np.ndarray, "K 3"]
    """[rad/s]"""
    yaw: Float[np.ndarray, " K"]
    """The heading [rad]."""
    last_action: Float[np.ndarray, "K 12"]
    """Of the robots from which the legs are copied."""
    touch_height: Float[np.ndarray, "K 4"]
    """Height above the base at which those feet last touched [m]."""
    contact: Bool[np.ndarray, "K 4"]
    """Which of those feet are down."""


def mix(
    sensed: Proprioception,
    truth: Privileged,
    state: GaitState,
    *,
    among: Int[np.ndarray, " M"],
    count: int,
    rng: np.random.Generator,
) -> MixedStart:
    """Combines the base of one walking robot with each leg of another.

    A gait is a relation between the phases of the four legs. Legs with random phases therefore
    cover the states after a shift in mid-stride from any other gait.

    Args:
        sensed: proprioception of all robots at this instant.
        truth: privileged state at the same instant.
        state: gait state of all robots.
        among: robots that may be copied from.
        count: number of states to make.
        rng: draws the robots.
    """
    base, leg = rng.choice(among, count), rng.choice(among, (count, 4))
    of_leg = (leg, np.arange(4))

    def legs_of(joints: Float[np.ndarray, "N 12"]) -> Float[np.ndarray, "K 12"]:
        return joints.reshape(-1, 4, 3)[of_leg].reshape(count, 12)

    attitude = truth.base_quaternion_w[base]
    return MixedStart(
        joint_position=legs_of(sensed.need("joint_position", "a mixed start")),
        joint_velocity=legs_of(sensed.need("joint_velocity", "a mixed start")),
        attitude=attitude,
        base_velocity_w=np.einsum("kij,kj->ki", rotation_of(attitude), truth.velocity_b[base]),
        base_angular_velocity_b=sensed.need("angular_velocity_b", "a mixed start")[base],
        yaw=sensed.yaw[base],
        last_action=legs_of(state.last_action),
        touch_height=state.touch_height[of_leg],
        contact=sensed.contact[of_leg],
    )
