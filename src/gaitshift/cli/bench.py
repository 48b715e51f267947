"""`gaitshift bench`: how fast the environment is against bare physics, and training on top."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np
from mujoco.batch import Batch

from gaitshift import gaits
from gaitshift.cli.output import Report, emit_json, emit_table, progress, say
from gaitshift.command import CONTROL_PERIOD
from gaitshift.env import GaitEnv
from gaitshift.errors import GaitshiftError
from gaitshift.terrain import from_spec

ROUNDS = 7
"""Rounds in which both are measured in turn; medians over them are quoted."""


@dataclass(frozen=True, kw_only=True)
class Bench:
    """Measure the environment against bare physics in the same run, and one training iteration.

    Both do the same motion: the robots step through the same small random actions.
    """

    robots: int = 128
    """Robots in parallel."""
    steps: int = 100
    """Control steps a round."""
    terrain: str = "flat"
    """Ground, as in `evaluate`."""
    seed: int = 0
    """Seed of the actions."""
    json: bool = False
    """One JSON object on stdout."""

    def run(self) -> None:
        """Measures and prints."""
        if not (1 <= self.robots <= 65536 and 1 <= self.steps <= 100_000):
            raise GaitshiftError("bench: robots from 1 to 65536 and steps from 1 to 100000, please")
        with progress("measuring") as report:
            figures = self._measure(report)
        if self.json:
            emit_json(figures)
            return
        rows = [
            (name, f"{value:,.2f}" if value < 10 else f"{value:,.0f}")
            for name, value in figures.items()
        ]
        emit_table(f"bench: {self.robots} robots on {self.terrain}", rows)

    def _measure(self, report: Report) -> dict[str, float]:
        ground = from_spec(self.terrain, seed=self.seed, length=20.0, width=20.0)
        env = GaitEnv(gaits.load("trot"), ground, self.robots)
        env.reset(seed=self.seed)
        rng = np.random.default_rng(self.seed)
        actions = rng.normal(scale=0.5, size=(self.steps, self.robots, 12))
        bare = _Bare(env, actions)
        seconds: dict[str, list[float]] = {"env": [], "bare": []}
        for index in range(ROUNDS):
            seconds["env"].append(_time(lambda: [env.step(action) for action in actions]))
            seconds["bare"].append(_time(bare.run))
            report(index + 1, ROUNDS + 1)
        total = self.robots * self.steps
        env_rate, bare_rate = (total / median(seconds[name]) for name in ("env", "bare"))
        ratios = [b / e for e, b in zip(seconds["env"], seconds["bare"], strict=True)]
        return {
            "bare_steps_per_s": bare_rate,
            "env_steps_per_s": env_rate,
            "env_over_bare": median(ratios),
            **self._training(),
        }

    def _training(self) -> dict[str, float]:
        """Steps a second of training, and what the flat stage then takes; nothing without torch."""
        try:
            from gaitshift.training.learner import Learner
            from gaitshift.training.recipe import Recipe
        except ImportError as error:
            say(f"training is not measured: the package '{error.name}' is missing")
            return {}
        import torch

        recipe = Recipe()
        torch.set_num_threads(recipe.threads)
        ground = from_spec("flat", seed=0, length=20.0, width=20.0)
        env = GaitEnv(gaits.load("trot"), ground, recipe.robots, config=recipe.env)
        learner = Learner(env, recipe)
        learner.start_episodes(self.seed)
        learner.iterate()
        per_iteration = median([_time(learner.iterate) for _ in range(ROUNDS)])
        flat = recipe.stages[0].iterations
        return {
            "training_steps_per_s": recipe.robots * recipe.steps / per_iteration,
            "flat_stage_iterations": float(flat),
            "flat_stage_minutes": flat * per_iteration / 60,
        }


class _Bare:
    """MuJoCo's own batch on the same model, driven to the same targets, and nothing else."""

    def __init__(self, env: GaitEnv, actions: np.ndarray) -> None:
        world = env.world
        self._batch = Batch(world.model, env.num_envs)
        self._batch.bind("qpos")[:], self._batch.bind("qvel")[:] = world.state()
        self._ctrl = self._batch.bind("ctrl")
        self._targets = env.robot.stance_angles + env.robot.action_scale * actions
        self._substeps = round(CONTROL_PERIOD / world.model.opt.timestep)

    def run(self) -> None:
        for target in self._targets:
            self._ctrl[:] = target
            self._batch.step(nstep=self._substeps)


def _time(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start
