"""Speed of the environment, of bare physics, of training, and of replays of a rule on a grid."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from statistics import median
from typing import TYPE_CHECKING

import numpy as np
from mujoco.batch import Batch

from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.shift import Rule
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import from_spec

if TYPE_CHECKING:
    from gaitshift.learn.learner import Learner
    from gaitshift.learn.recipe import Recipe

ROUNDS = 7
"""Rounds in which both are measured alternately; the results are medians over them."""

GROWTH = (32, 128, 512, 2048, 4096)
"""Numbers of robots whose speed `growth` measures."""

EPISODES, EPISODE_SECONDS = 1000, 20.0
ALPHAS, BETAS = np.linspace(0.002, 0.2, 100), np.arange(1000.0)
"""Workload of a replay: episodes, their length [s], α and β [counts] of the grid."""


@dataclass(frozen=True, kw_only=True)
class SpeedConfig:
    """Workload of the speed measurement."""

    robots: int = 128
    """Robots in parallel."""
    steps: int = 100
    """Control steps per round."""
    terrain: str = "flat"
    """Terrain, as in `evaluate`."""
    seed: int = 0
    """Seed of the actions."""

    def __post_init__(self) -> None:
        if not (1 <= self.robots <= 65536 and 1 <= self.steps <= 100_000):
            raise GaitshiftError(
                f"robots must be 1 to 65536 and steps 1 to 100000, got {self.robots} "
                f"and {self.steps}"
            )
        if self.seed < 0:
            raise GaitshiftError(f"seed must be 0 or larger, got {self.seed}")


def environment_speed(
    config: SpeedConfig,
    report: Callable[[int, int], None] = lambda done, total: None,
    threads: int = 0,
) -> dict[str, float]:
    """Control steps per second, summed over all robots [1/s], and their ratio.

    Environment and bare physics compute the same motion, with the same small random actions, on
    this number of threads (0: one a core).
    """
    ground = from_spec(config.terrain, seed=config.seed, length=20.0, width=20.0)
    env = GaitEnv(gaits.load("trot"), ground, config.robots, threads=threads)
    env.reset(seed=config.seed)
    rng = np.random.default_rng(config.seed)
    actions = rng.normal(scale=0.5, size=(config.steps, config.robots, 12))
    bare = _Bare(env, actions, threads)
    seconds: dict[str, list[float]] = {"env": [], "bare": []}
    for index in range(ROUNDS):
        seconds["env"].append(seconds_of(lambda: [env.step(action) for action in actions]))
        seconds["bare"].append(seconds_of(bare.run))
        report(index + 1, ROUNDS + 1)
    total = config.robots * config.steps
    env_rate, bare_rate = (total / median(seconds[name]) for name in ("env", "bare"))
    ratios = [b / e for e, b in zip(seconds["env"], seconds["bare"], strict=True)]
    return {
        "bare_steps_per_s": bare_rate,
        "env_steps_per_s": env_rate,
        "env_over_bare": median(ratios),
    }


def growth(
    config: SpeedConfig, report: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, dict[str, float]]:
    """`environment_speed` for more and more robots, and for more and more threads.

    A round has as many control steps over all robots as `config` has.
    """
    total, cores = config.robots * config.steps, os.cpu_count() or 1
    cases = {f"{robots} robots": (robots, 0) for robots in GROWTH}
    cases |= {f"{threads} threads": (config.robots, threads) for threads in _doubled(cores)}
    found: dict[str, dict[str, float]] = {}
    for name, (robots, threads) in cases.items():
        one = replace(config, robots=robots, steps=max(2, total // robots))
        found[name] = environment_speed(one, threads=threads)
        report(len(found), len(cases))
    return found


def _doubled(most: int) -> list[int]:
    """1, 2, 4 … up to `most`, and `most` itself."""
    return sorted({most, *(1 << power for power in range(most.bit_length()))})


def training_speed(seed: int) -> dict[str, float]:
    """Control steps per second of training over all robots [1/s], and the time of the flat stage.

    `iteration_over_three_stage` is the time of an iteration over that of the preset `three-stage`,
    in exact physics and with updates as in rsl_rl, measured in turns.

    Raises:
        ImportError: torch or rsl_rl is not installed.
    """
    from gaitshift.learn.presets import three_stage
    from gaitshift.learn.recipe import Recipe

    recipe, before = Recipe(), three_stage()
    learners = [_learner(one, seed) for one in (recipe, before)]
    seconds = [[seconds_of(learner.iterate) for learner in learners] for _ in range(ROUNDS)]
    per_iteration = median([now for now, _ in seconds])
    flat = recipe.stages[0].iterations
    return {
        "training_steps_per_s": recipe.robots * recipe.steps / per_iteration,
        "iteration_over_three_stage": median([now / then for now, then in seconds]),
        "flat_stage_iterations": float(flat),
        "flat_stage_minutes": flat * per_iteration / 60,
    }


def _learner(recipe: "Recipe", seed: int) -> "Learner":
    """A learner in the first stage of a recipe, after one iteration."""
    from gaitshift.learn.learner import Learner

    ground = from_spec("flat", seed=0, length=20.0, width=20.0)
    env = GaitEnv(gaits.load("trot"), ground, recipe.robots, config=recipe.env)
    env.set_terrain((ground,), recipe.stages[0].fidelity)
    learner = Learner(env, recipe)
    learner.start_episodes(seed)
    learner.iterate()
    return learner


class _Bare:
    """MuJoCo's own batch on the same model with the same joint targets, and nothing else."""

    def __init__(self, env: GaitEnv, actions: np.ndarray, threads: int) -> None:
        world = env.world
        self._batch = Batch(world.model, env.num_envs, threads, True)
        self._batch.bind("qpos")[:], self._batch.bind("qvel")[:] = world.state()
        self._ctrl = self._batch.bind("ctrl")
        self._targets = env.robot.stance_angles + env.robot.action_scale * actions
        self._substeps = round(CONTROL_PERIOD / world.model.opt.timestep)

    def run(self) -> None:
        for target in self._targets:
            self._ctrl[:] = target
            self._batch.step(nstep=self._substeps)


def seconds_of(work: Callable[[], object]) -> float:
    """Time that the work takes [s]."""
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def replay_speed(seed: int) -> dict[str, float]:
    """Time [s] to find the first firings of six pairs of feet over the whole grid.

    Heights change at random times, as at touchdowns. With a leak the counter is computed step by
    step.
    """
    from gaitshift.lab.identification import first_firings  # needs scipy

    rng, steps = np.random.default_rng(seed), round(EPISODE_SECONDS / CONTROL_PERIOD)
    touched = rng.random((steps, EPISODES, 1)) < 0.1
    touched[0] = True
    which = np.maximum.accumulate(np.where(touched[..., 0], np.arange(steps)[:, None], 0), axis=0)
    drawn = np.abs(rng.normal(scale=0.05, size=(steps, EPISODES, 6)))
    values = np.take_along_axis(drawn, which[..., None], axis=0)
    alive = np.ones((steps, EPISODES), dtype=bool)
    seconds: dict[str, float] = {}
    for name, leak in (("no_leak", 0.0), ("leak", 0.5)):
        rule = Rule(alpha=0.1, beta=100.0, leak=leak)
        start = time.perf_counter()
        first_firings(values, alive, rule, ALPHAS, BETAS)
        seconds[f"{name}_s"] = time.perf_counter() - start
    return seconds
