"""The same robot and ground in the vector environments that others use, timed beside ours.

All step as many robots with the same joint targets, in turns. The peers step plain MuJoCo and give
positions and velocities; ours computes rewards, machines, pushes and restarts as well.
"""

import os
from collections.abc import Callable, Generator
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from statistics import median
from typing import Any, cast

import gymnasium as gym
import mujoco
import numpy as np
from jaxtyping import Float
from mujoco.rollout import Rollout

from gaitshift.gait import gaits
from gaitshift.lab.benchmark.speed import ROUNDS, SpeedConfig, seconds_of
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import from_spec

OURS = "gaitshift"

Targets = Float[np.ndarray, "T N 12"]
"""Joint targets of N robots at T control steps [rad]."""


class OneRobot(gym.Env[np.ndarray, np.ndarray]):
    """One robot in plain MuJoCo: joint targets in, positions and velocities out, no reward."""

    def __init__(
        self,
        model: mujoco.MjModel,
        qpos: Float[np.ndarray, " 19"],
        qvel: Float[np.ndarray, " 18"],
    ) -> None:
        """It begins each episode with these positions and velocities."""
        self._model, self._data, self._start = model, mujoco.MjData(model), (qpos, qvel)
        self._substeps = round(CONTROL_PERIOD / model.opt.timestep)
        size = model.nq + model.nv
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (size,), np.float64)
        self.action_space = gym.spaces.Box(-10.0, 10.0, (model.nu,), np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """At its start."""
        super().reset(seed=seed)
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[:], self._data.qvel[:] = self._start
        return self._seen(), {}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """One control step."""
        self._data.ctrl[:] = action
        mujoco.mj_step(self._model, self._data, self._substeps)
        return self._seen(), 0.0, False, False, {}

    def _seen(self) -> np.ndarray:
        return np.concatenate((self._data.qpos, self._data.qvel))


def peer_speeds(
    config: SpeedConfig, report: Callable[[int, int], None] = lambda done, total: None
) -> dict[str, float]:
    """Control steps per second of each, over all robots [1/s]: medians over rounds.

    A peer whose package is not installed is left out.
    """
    ground = from_spec(config.terrain, seed=config.seed, length=20.0, width=20.0)
    env = GaitEnv(gaits.load("trot"), ground, config.robots)
    env.reset(seed=config.seed)
    rng = np.random.default_rng(config.seed)
    actions = rng.normal(scale=0.5, size=(config.steps, config.robots, 12))
    targets = env.robot.stance_angles + env.robot.action_scale * actions
    found: dict[str, list[float]] = {}
    with ExitStack() as open_peers:
        works: dict[str, Callable[[], object]] = {
            OURS: lambda: [env.step(action) for action in actions]
        }
        for name, peer in PEERS.items():
            try:
                works[name] = open_peers.enter_context(peer(env, targets))
            except ImportError:
                continue
        for index in range(ROUNDS):
            for name, work in works.items():
                found.setdefault(name, []).append(seconds_of(work))
            report(index + 1, ROUNDS)
    total = config.robots * config.steps
    return {name: total / median(seconds) for name, seconds in found.items()}


def makers(env: GaitEnv) -> list[Callable[[], OneRobot]]:
    """What makes each robot of the environment in plain MuJoCo."""
    return [partial(OneRobot, env.world.model, *s) for s in zip(*env.world.state(), strict=True)]


@contextmanager
def _asynchronous(env: GaitEnv, targets: Targets) -> Generator[Callable[[], object]]:
    with closing(gym.vector.AsyncVectorEnv(makers(env))) as robots:
        robots.reset()
        yield lambda: [robots.step(target) for target in targets]


@contextmanager
def _subprocesses(env: GaitEnv, targets: Targets) -> Generator[Callable[[], object]]:
    from stable_baselines3.common.vec_env import SubprocVecEnv

    made: Any = SubprocVecEnv(cast(Any, makers(env)), start_method="fork")
    with closing(made) as robots:
        robots.reset()
        yield lambda: [robots.step(target) for target in targets]


@contextmanager
def _rolled_out(env: GaitEnv, targets: Targets) -> Generator[Callable[[], object]]:
    """Without feedback: all targets are known before the first step."""
    model, (qpos, qvel) = env.world.model, env.world.state()
    substeps = round(CONTROL_PERIOD / model.opt.timestep)
    kind = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states = np.zeros((len(qpos), mujoco.mj_stateSize(model, kind)))
    data = mujoco.MjData(model)
    for state, data.qpos[:], data.qvel[:] in zip(states, qpos, qvel, strict=True):
        mujoco.mj_getState(model, data, state, kind)
    control = np.repeat(targets.transpose(1, 0, 2), substeps, axis=1)
    threads = os.cpu_count() or 1
    workers = [mujoco.MjData(model) for _ in range(threads)]
    with cast(Any, Rollout)(nthread=threads) as pool:
        yield lambda: pool.rollout(model, workers, states, control)


PEERS = {
    "gymnasium AsyncVectorEnv": _asynchronous,
    "stable-baselines3 SubprocVecEnv": _subprocesses,
    "mujoco.rollout, without feedback": _rolled_out,
}
"""Each by its name: what opens it, for a block in which it steps."""
