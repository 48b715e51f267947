"""The Gymnasium ids of the gaits, such as `gaitshift/trot-v0`, of N robots or one."""

from typing import Any

import gymnasium as gym
import numpy as np
from jaxtyping import Float, Float32

from gaitshift.gait import RewardMachine, gaits
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.sim.env.config import EnvConfig
from gaitshift.sim.env.gait_env import GaitEnv
from gaitshift.sim.terrain import Terrain, from_spec


class SingleGaitEnv(gym.Env[np.ndarray, np.ndarray]):
    """A `GaitEnv` of one robot, without the axis of robots and without autoreset."""

    metadata = {"render_modes": []}  # noqa: RUF012  (Gymnasium wants a plain dict here)

    def __init__(
        self,
        machine: RewardMachine,
        terrain: Terrain,
        *,
        config: EnvConfig | None = None,
        robot: Robot = ANYMAL_B,
    ) -> None:
        self.vector = GaitEnv(machine, terrain, 1, config=config, robot=robot, threads=1)
        self.observation_space = self.vector.single_observation_space
        self.action_space = self.vector.single_action_space

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Float32[np.ndarray, " D"], dict[str, Any]]:
        """Starts an episode."""
        super().reset(seed=seed)
        observation, info = self.vector.reset(seed=seed, options=options)
        return observation[0], info

    def step(
        self, action: Float[np.ndarray, " 12"]
    ) -> tuple[Float32[np.ndarray, " D"], float, bool, bool, dict[str, Any]]:
        """One control step of 10 ms."""
        observation, reward, terminated, truncated, info = self.vector.step(action[None])
        ended = bool(terminated[0] or truncated[0])
        last = info["final_obs"][0] if ended else observation[0]
        terms = {name: float(term[0]) for name, term in info["reward_terms"].items()}
        return (
            last,
            float(reward[0]),
            bool(terminated[0]),
            bool(truncated[0]),
            {
                "reward_terms": terms,
                "changed": bool(info["changed"][0]),
                "diverged": bool(info["diverged"][0]),
            },
        )


_FIELD = 20.0
"""Side of the ground of a registered environment [m]; ours: an episode of 10 s stays on it."""


def register_gaits() -> None:
    """Registers `gaitshift/<gait>-v0` for every shipped gait.

    `gymnasium.make` and `make_vec` take the keywords of `make_vector` below.
    """
    for name in gaits.names():
        gym.register(
            id=f"gaitshift/{name}-v0",
            entry_point="gaitshift.sim.env.registry:make_single",
            vector_entry_point="gaitshift.sim.env.registry:make_vector",
            kwargs={"gait": name},
        )


def make_vector(
    gait: str,
    num_envs: int = 1,
    *,
    terrain: str = "flat",
    terrain_seed: int = 0,
    config: EnvConfig | None = None,
) -> GaitEnv:
    """The environment of a shipped gait, or of a machine file, on a terrain given by its spec."""
    ground = from_spec(terrain, seed=terrain_seed, length=_FIELD, width=_FIELD)
    return GaitEnv(gaits.load(gait), ground, num_envs, config=config)


def make_single(
    gait: str,
    *,
    terrain: str = "flat",
    terrain_seed: int = 0,
    config: EnvConfig | None = None,
) -> SingleGaitEnv:
    """`make_vector` for one robot, as a plain `gymnasium.Env`."""
    ground = from_spec(terrain, seed=terrain_seed, length=_FIELD, width=_FIELD)
    return SingleGaitEnv(gaits.load(gait), ground, config=config)
