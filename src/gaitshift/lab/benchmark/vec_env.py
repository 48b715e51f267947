"""A `GaitEnv` as stable-baselines3 wants its environments."""

from typing import Any

import numpy as np
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices

from gaitshift.sim.env import GaitEnv


class GaitVecEnv(VecEnv):
    """The same robots, step for step.

    Where an episode ended, `infos` hands over its last observation and whether it was cut: PPO
    bootstraps from there.
    """

    def __init__(self, env: GaitEnv) -> None:
        self.env = env
        super().__init__(env.num_envs, env.single_observation_space, env.single_action_space)
        self._actions = np.zeros((env.num_envs, 12))

    def reset(self) -> np.ndarray:
        """Starts all episodes anew, from the seed that `seed` was given, if it was."""
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
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """The attribute of the whole environment, once for each robot."""
        return [getattr(self.env, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refused with a `TypeError`: robots share one environment."""
        raise TypeError(f"robots share one environment: '{attr_name}' of some cannot be set")

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **_: Any
    ) -> list[Any]:
        """Refused with a `TypeError`: robots share one environment."""
        raise TypeError(f"robots share one environment: '{method_name}' of some cannot be called")

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """No robot has a wrapper."""
        return [False for _ in self._get_indices(indices)]
