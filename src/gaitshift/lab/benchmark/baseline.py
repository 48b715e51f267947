"""The baseline: stable-baselines3's PPO at its defaults, on the same environment (paper IV-A)."""

from pathlib import Path

import torch
from stable_baselines3 import PPO

from gaitshift.gait import RewardMachine
from gaitshift.lab.benchmark.vec_env import GaitVecEnv
from gaitshift.learn.export import describe, write
from gaitshift.learn.ground import FIELD
from gaitshift.learn.recipe import Recipe
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import flat

ROBOTS = 30
"""Robots in parallel (paper IV-A)."""


class Baseline:
    """PPO("MlpPolicy") and the flat environment of a recipe, with what it asks for growing alike.

    The curriculum is, at each number of control steps, the one that the recipe has there, so that
    both learners are asked for the same.
    """

    def __init__(
        self, machine: RewardMachine, recipe: Recipe, seed: int, folder: Path, *, rollout: int
    ) -> None:
        """Trains by `rollout` control steps a robot at a time; the policy goes into `folder`."""
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
        """Writes the policy as it stands."""
        network = self._ppo.policy
        layers = [*network.mlp_extractor.policy_net, network.action_net]
        training = {"learner": "stable-baselines3", "seed": self._seed, "steps": self.steps}
        write(layers, describe(self._env, training), self._path)
        return self._path
