"""The environment: a control step in the order of the paper."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from jaxtyping import Bool, Float, Float32, Int

from gaitshift.control.estimator import Estimation
from gaitshift.control.observation import Observation
from gaitshift.control.walker import Walker
from gaitshift.gait import RewardMachine
from gaitshift.robot.command import ACTION_LIMIT, Command
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.state import Proprioception
from gaitshift.sim.env.border import has_left, starting_points
from gaitshift.sim.env.commander import Commander
from gaitshift.sim.env.config import Curriculum, EnvConfig
from gaitshift.sim.env.mixed_start import MixedStart, mix
from gaitshift.sim.env.privileged import privileged
from gaitshift.sim.push import Pusher
from gaitshift.sim.reward import Swings, earned_bonus, walk_reward, with_bonus
from gaitshift.sim.terrain import Terrain
from gaitshift.sim.world import Fidelity, World

Observations = Float32[np.ndarray, "N D"]


class GaitEnv(VectorEnv[Observations, np.ndarray, np.ndarray]):
    """N robots that learn one gait: the product of a `World` and a `RewardMachine`.

    An episode ends when the body touches the ground, the machine accepts or the simulation of the
    robot diverges (`info["diverged"]`). It is truncated after `episode_steps` or at the border of
    the terrain. Robots restart in the same step (`AutoresetMode.SAME_STEP`); the observation that
    ended an episode is in `info["final_obs"]`, where `info["_final_obs"]` is true.
    `info["reward_terms"]` has each weighted term of R_walk, `info["bonus"]` the machine's bonus,
    and `info["changed"]` whether the machine changed its state. Where the config asks for it,
    `privileged()` is what only a simulation knows, and `info["final_privileged"]` belongs to
    `info["final_obs"]`.
    """

    def __init__(
        self,
        machine: RewardMachine,
        terrain: Terrain | Sequence[Terrain],
        num_envs: int = 1,
        *,
        config: EnvConfig | None = None,
        robot: Robot = ANYMAL_B,
        threads: int = 0,
    ) -> None:
        self.config = EnvConfig() if config is None else config
        self.machine = machine = _with_heights(machine, self.config.height_span)
        self.robot = robot
        self.num_envs = num_envs
        self.walker = Walker(
            machine=machine,
            observation=Observation(machine, robot.stance, self.config.observed),
            action_scale=robot.action_scale,
        )
        """Observation, meaning of actions, and steps of the machine."""
        self.world = World(
            robot,
            terrain,
            num_envs,
            gains=self.config.gains,
            randomisation=self.config.randomisation,
            threads=threads,
            sensors=self.config.sensors,
        )
        self._estimation = Estimation(robot, num_envs)
        self.curriculum = Curriculum()
        """The present difficulty; may be replaced between two steps."""
        self.metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}
        self.single_observation_space = gym.spaces.Box(
            -np.inf, np.inf, (self.walker.observation.size,), np.float32
        )
        self.single_action_space = gym.spaces.Box(-ACTION_LIMIT, ACTION_LIMIT, (12,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._stance = robot.stance_angles
        self._start(np.random.default_rng())

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Restarts every episode. All later steps are the same, to the bit, for the same seed."""
        if seed is not None:
            self.world.reseed(seed)
            self._start(np.random.default_rng(seed))
        self._restart(np.arange(self.num_envs))
        return self._observation(), {}

    def step(
        self, actions: Float[np.ndarray, "N 12"]
    ) -> tuple[
        Observations,
        Float[np.ndarray, " N"],
        Bool[np.ndarray, " N"],
        Bool[np.ndarray, " N"],
        dict[str, Any],
    ]:
        """One control step of 10 ms; `actions` scale to joint targets about the stance."""
        action, target = self.walker.target(actions)
        self.world.push(self._pusher.step())
        _, truth = self.world.step(target)
        self._estimation.restart(np.flatnonzero(truth.diverged))  # which are set down again
        sensed = self._estimation.see(self.world.sensed)
        ideal, contact = self.world.ideal, truth.foot_contact
        command, before = self._commander.command, self._state
        self._state, step = self.walker.step(before, action, sensed, command)
        left, waited = before.machine_state, before.steps_in_state
        on_time = self.machine.punctuality(left, waited, self.machine.dwell_for(command.stride))
        asked = self.curriculum
        chatter, swing_share = self._swings.see(
            left, step, contact, truth.clearance, asked.swing_factor
        )
        agreement = self.machine.agreement(step.state, contact)
        terms = walk_reward(
            self.config.reward,
            ideal,
            truth,
            command,
            stance=self._stance,
            steps_aside=self.machine.lateral_speed > 0,
            height_error=self._height_error(ideal, command),
            agreement=agreement,
            in_time=self._in_time(command),
            chatter=asked.strictness * chatter,
            action_change=action - before.last_action,
            stance_factor=asked.stance_factor,
            penalty_scale=asked.penalty_scale,
        )
        is_real = self.machine.suiting(left, contact) == step.edge
        bonus = earned_bonus(
            self.config.reward,
            step.bonus * is_real,  # else a walk stands and waits for feet that are not felt
            swing_share=swing_share,
            on_time=on_time,
            strictness=asked.strictness,
        )
        walk = np.sum(list(terms.values()), axis=0)
        reward = with_bonus(self.config.reward, walk, bonus)
        self._age += 1
        info = {
            "reward_terms": terms,
            "bonus": reward - walk,
            "changed": step.changed,
            "shows_stance": agreement == 1.0,
            "forward_speed": truth.forward_speed,
            "diverged": truth.diverged,
        }
        terminated = truth.body_contact | truth.diverged
        if self.config.stall > 0 and asked.strictness == 1 and not self.machine.stands:
            terminated |= self._state.steps_in_state > self.config.stall * command.stride
        if self.machine.accepting:
            terminated |= np.isin(step.state, self.machine.accepting)
        left = has_left(
            self.world.terrains, self.config.terrain_margin, truth.base_position_w[:, :2]
        )
        truncated = ((self._age >= self.config.episode_steps) | left) & ~terminated
        observation = self._next_observation(terminated | truncated, info)
        return observation, reward, terminated, truncated, info

    def set_terrain(
        self, terrain: Terrain | Sequence[Terrain], fidelity: Fidelity = "exact"
    ) -> None:
        """Replaces the ground under the robots, which keep their motion, and its fidelity.

        Robots are divided among several grounds as in `World`; all cover the same rectangle.
        """
        self.world.set_terrain(terrain, fidelity)

    def push_at_most(self, force: float) -> None:
        """Sets the largest push on a base [N] from now on; 0 ends the pushes."""
        self.config = replace(self.config, push=replace(self.config.push, force=force))
        self._pusher = Pusher(self.config.push, self.num_envs, self._rng)

    def spread_ages(self) -> None:
        """Draws the age of every episode, so that they are truncated at different times."""
        self._age = self._rng.integers(0, self.config.episode_steps, self.num_envs)

    def commands(self) -> dict[str, Any]:
        """Nominal value and range of the forward-speed and stride-frequency commands."""
        return self._commander.ranges()

    def observed_commands(self) -> dict[int, tuple[float, float]]:
        """Ends of the ranges of all parts of the command, by their places in the observation.

        `speed_margin` does not widen them.
        """
        ends = self.walker.observation.of_commands(self._commander.ends())
        return {place: (float(first), float(last)) for place, (first, last) in ends.items()}

    def privileged(self) -> Float32[np.ndarray, "N P"]:
        """What only a simulation knows of the robots now (`gaitshift.sim.env.privileged`)."""
        return privileged(self.world.ideal, self.world.truth, self.world.bodies)

    def _start(self, rng: np.random.Generator) -> None:
        n = self.num_envs
        self._rng = rng
        self._pusher = Pusher(self.config.push, n, rng)
        self._state = self.walker.begin(self._sensed)
        self._swings = Swings(self.machine, n)
        self._age: Int[np.ndarray, " N"] = np.zeros(n, dtype=np.int64)
        self._commander = Commander(self.machine, self.config, n, rng)

    def _next_observation(self, done: Bool[np.ndarray, " N"], info: dict[str, Any]) -> Observations:
        self._update_command()
        observation = self._observation()
        ids = np.flatnonzero(done)
        if ids.size == 0:
            return observation
        info["final_obs"], info["_final_obs"] = observation, done
        if self.config.privileged:
            info["final_privileged"] = self.privileged()
        self._restart(ids)
        return self._observation()

    def _restart(self, ids: Int[np.ndarray, " K"]) -> None:
        rng, config, count = self._rng, self.config, len(ids)
        self.world.redraw(ids, rng, self.curriculum.randomisation)
        moving, start = self._draw_mixed(ids)
        yaw = rng.choice((0.0, np.pi), count)  # edges lie across x: up and down, head on
        velocity = np.zeros((count, 3))
        velocity[:, :2] = rng.uniform(-config.velocity_noise, config.velocity_noise, (count, 2))
        noise = rng.uniform(-config.joint_noise, config.joint_noise, (count, 12))
        self.world.place(
            ids,
            xy=starting_points(self.world.terrains, config.terrain_margin, count, rng),
            yaw=yaw,
            joint_position=self._stance + noise,
            base_velocity_w=velocity,
        )
        self._pusher.clear(ids)
        self._estimation.restart(ids)
        begun = self.walker.begin(self.world.sensed.robots(ids))
        self._state = self._state.with_robots(ids, begun)
        self._swings.restart(ids)
        self._age[ids] = 0
        if start is not None:
            start.place(self.world, moving, yaw[np.isin(ids, moving)])
            going = start.gait_state(self.machine)
            self._state = self._state.with_robots(moving, going)
        self._commander.restart(ids, yaw, self.curriculum.command_scale)
        self._update_command()

    def _draw_mixed(
        self, ids: Int[np.ndarray, " K"]
    ) -> tuple[Int[np.ndarray, " M"], MixedStart | None]:
        """Which of the restarting robots start in mid-stride, and their states."""
        moving = ids[:0]
        share = self.curriculum.mixed_starts
        if share > 0 and len(ids) < self.num_envs:
            moving = ids[self._rng.random(len(ids)) < share]
        if moving.size == 0:
            return moving, None
        others = np.setdiff1d(np.arange(self.num_envs), ids)
        return moving, mix(
            self.world.ideal,
            self.world.truth,
            self._state,
            among=others,
            count=len(moving),
            rng=self._rng,
        )

    def _in_time(self, command: Command) -> Float[np.ndarray, " N"] | float:
        """Factor on the stance terms, below 1 where a stance has been held for too long."""
        share = self.curriculum.strictness * self.config.reward.stance_punctuality
        if share == 0:
            return 1.0
        machine, state = self.machine, self._state
        dwell = machine.dwell_for(command.stride)
        punctuality = machine.punctuality(state.machine_state, state.steps_in_state, dwell)
        return 1.0 - share * (1.0 - punctuality)

    def _height_error(
        self, ideal: Proprioception, command: Command
    ) -> Float[np.ndarray, " N"] | None:
        """Height of the base minus the commanded height [m], where the gait takes a command."""
        if not self.machine.has_height:
            return None
        return ideal.base_height - (self.robot.stance_height + command.body_height)

    @property
    def _sensed(self) -> Proprioception:
        """What the robots sense now, with an estimate of a velocity that they do not."""
        return self._estimation.seen(self.world.sensed)

    def _update_command(self) -> None:
        scale = self.curriculum.command_scale
        self._commander.update(self._age, self._sensed.yaw, scale)

    def _observation(self) -> Observations:
        return self.walker.observe(self._state, self._sensed, self._commander.command)


def _with_heights(machine: RewardMachine, span: float) -> RewardMachine:
    """The gait with body heights within ± this of its own [m], if it has no range of heights."""
    if span == 0 or machine.has_height:
        return machine
    return replace(machine, height_range=(machine.height - span, machine.height + span))
