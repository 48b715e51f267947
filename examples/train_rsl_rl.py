"""Trains a trot with rsl_rl's `OnPolicyRunner`, and saves it: trot_rsl_rl.pt.

Usage: python examples/train_rsl_rl.py [ITERATIONS]
"""

import sys
from typing import Any

import gymnasium
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

ROBOTS = 64
CONFIG: dict[str, Any] = {
    "num_steps_per_env": 24,
    "save_interval": 100,
    "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
    "actor": {
        "class_name": "MLPModel",
        "hidden_dims": [128, 128],
        "activation": "elu",
        "obs_normalization": True,
        "distribution_cfg": {"class_name": "GaussianDistribution", "init_std": 0.5},
    },
    "critic": {
        "class_name": "MLPModel",
        "hidden_dims": [128, 128],
        "activation": "elu",
        "obs_normalization": True,
    },
    "algorithm": {"class_name": "PPO", "num_learning_epochs": 5, "num_mini_batches": 4},
}


class RslRlEnv(VecEnv):
    """A vector environment of Gymnasium as rsl_rl wants it, on the CPU."""

    def __init__(self, env: gymnasium.vector.VectorEnv, seed: int) -> None:
        self.env = env
        self.cfg: dict[str, Any] = {}
        self.device = "cpu"
        self.num_envs = env.num_envs
        self.num_actions = env.single_action_space.shape[0]
        self.max_episode_length = 1000  # 10 s, the default of the environment
        self.episode_length_buf = torch.zeros(env.num_envs, dtype=torch.long)
        self._observation, _ = env.reset(seed=seed)

    def get_observations(self) -> TensorDict:
        """What the robots observe now."""
        return TensorDict(
            {"policy": torch.from_numpy(self._observation)}, batch_size=[self.num_envs]
        )

    def step(
        self, actions: torch.Tensor
    ) -> tuple[TensorDict, torch.Tensor, torch.Tensor, dict[str, Any]]:
        """One control step; episodes that ended begin anew within it."""
        self._observation, reward, terminated, truncated, _ = self.env.step(actions.numpy())
        done = torch.from_numpy(terminated | truncated)
        self.episode_length_buf = torch.where(done, 0, self.episode_length_buf + 1)
        # rsl_rl adds the value of what follows to the reward where an episode was cut.
        extras = {"time_outs": torch.from_numpy(truncated)}
        return self.get_observations(), torch.from_numpy(reward).float(), done, extras


def main(iterations: int) -> None:
    """Trains for so many iterations."""
    torch.set_num_threads(1)  # networks this small gain nothing by more
    torch.manual_seed(0)
    env = RslRlEnv(
        gymnasium.make_vec("gaitshift.sim.env:gaitshift/trot-v0", num_envs=ROBOTS), seed=0
    )
    runner = OnPolicyRunner(env, CONFIG, log_dir=None, device="cpu")
    runner.learn(iterations)
    torch.save(runner.alg.actor.state_dict(), "trot_rsl_rl.pt")
    print(f"{iterations} iterations; trot_rsl_rl.pt")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 300)
