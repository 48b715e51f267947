"""The baseline: stable-baselines3's PPO at its defaults, on the same environment (paper IV-A)."""

from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from gaitshift.gait import RewardMachine
from gaitshift.learn.export import describe, write
from gaitshift.learn.ground import FIELD
from gaitshift.learn.recipe import Recipe
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import flat


class GaitVecEnv(VecEnv):
    """The same robots as a stable-baselines3 environment.

    Where an episode ended, `infos` has its last observation and whether it was truncated, from
    which PPO bootstraps.
    """

    def __init__(self, env: GaitEnv) -> None:
        self.env = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self._actions = np.zeros((env.num_envs, 12))

    def reset(self) -> np.ndarray:
        """Restarts all episodes, from the seed given to `seed`, if any."""
        observation, _ = self.env.reset(seed=self._seeds[0])
        self._reset_seeds()
        return observation

    def step_async(self, actions: np.ndarray) -> None:
        """Keeps the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        """One control step of all robots."""
        observation, reward, terminated, truncated, info = self.env.step(self._actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        done = terminated | truncated
        for robot in np.flatnonzero(done):
            infos[robot] = {
                "terminal_observation": info["final_obs"][robot],
                "TimeLimit.truncated": bool(truncated[robot]),
            }
        return observation, reward, done, infos

    def close(self) -> None:
        """Does nothing."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The attribute of the whole environment, once for each robot."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raises `TypeError`: robots share one environment."""
        raise TypeError(f"robots share one environment: '{attr_name}' of some cannot be set")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **_: Any
    ) -> list[Any]:
        """Raises `TypeError`: robots share one environment."""
        raise TypeError(f"robots share one environment: '{method_name}' of some cannot be called")

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """No robot has a wrapper."""
        return [False for _ in self._get_indices(indices)]


ROBOTS = 30
"""Robots in parallel (paper IV-A)."""


class Baseline:
    """PPO("MlpPolicy") on the flat environment of a recipe, with the recipe's curriculum.

    At each number of control steps the curriculum is that of the recipe, so that both learners have
    the same task.
    """

    def __init__(
        self, machine: RewardMachine, recipe: Recipe, seed: int, folder: Path, *, rollout: int
    ) -> None:
        """Trains by `rollout` control steps per robot at a time; the policy goes to `folder`."""
        torch.set_num_threads(recipe.threads)
        self._recipe = recipe
        self._seed = seed
        self._path = folder / "policy.onnx"
        self._env = GaitEnv(machine, flat(FIELD, FIELD), ROBOTS, config=recipe.env)
        self._ppo = PPO(
            "MlpPolicy", GaitVecEnv(self._env), n_steps=rollout, seed=seed, device="cpu"
        )

    @property
    def steps(self) -> int:
        """Control steps of all robots so far."""
        return self._ppo.num_timesteps

    def advance(self) -> None:
        """One rollout and the updates from it."""
        iteration = self.steps // (self._recipe.robots * self._recipe.steps)
        self._env.curriculum = self._recipe.curriculum(iteration)
        self._ppo.learn(self._ppo.n_steps * ROBOTS, reset_num_timesteps=False)

    def export(self) -> Path:
        """Writes the present policy."""
        network = self._ppo.policy
        layers = [*network.mlp_extractor.policy_net, network.action_net]
        training = {"learner": "stable-baselines3", "seed": self._seed, "steps": self.steps}
        write(layers, describe(self._env, training), self._path)
        return self._path
