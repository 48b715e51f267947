"""Trains a trot with stable-baselines3's PPO, and saves it: trot_sb3.zip.

Each environment is one robot, a plain `gymnasium.Env`, so this is the short way, not the fast one.

Usage: python examples/train_stable_baselines3.py [ITERATIONS]
"""

import sys

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env

ROBOTS = 4
STEPS = 64  # of each robot in an iteration


def main(iterations: int) -> None:
    """Trains for so many iterations."""
    torch.set_num_threads(1)  # networks this small gain nothing by more
    env = make_vec_env("gaitshift.sim.env:gaitshift/trot-v0", n_envs=ROBOTS, seed=0)
    ppo = PPO("MlpPolicy", env, n_steps=STEPS, batch_size=64, n_epochs=4, seed=0, device="cpu")
    ppo.learn(iterations * ROBOTS * STEPS)
    ppo.save("trot_sb3.zip")
    print(f"{ppo.num_timesteps} steps in {iterations} iterations; trot_sb3.zip")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 500)
