"""A training run: its folder, its loop, and how it resumes after a kill."""

import time
from collections.abc import Callable
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
import torch

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.learn import checkpoint
from gaitshift.learn.export import describe, export
from gaitshift.learn.ground import FIELD, draw_grounds
from gaitshift.learn.learner import Learner
from gaitshift.learn.progress import last, trim
from gaitshift.learn.run_config import RunConfig, versions
from gaitshift.learn.run_folder import (
    CHECKPOINTS,
    CONFIG,
    DIVERGED,
    POLICY,
    PROGRESS,
    VERDICTS,
    clear,
    is_barely_begun,
)
from gaitshift.learn.tensorboard_log import TensorBoardLog
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import Divergence
from gaitshift.table import Row
from gaitshift.whole_file import flush_to_disk

Judge = Callable[[Path], Row]
"""Evaluates a policy file and returns its verdict, a row of `verdicts.csv`."""

Keep = Callable[[Divergence, Path], None]
"""Writes the last second of a robot whose simulation diverged to a file."""

MOST_FILES = 8
"""Most files of divergences in a run's folder; ours: enough to see a cause."""


class Run:
    """One gait, one recipe, one seed, one folder.

    A checkpoint is taken every `recipe.checkpoint_every` iterations. At each checkpoint all robots
    restart from a seed made of the run's seed and the iteration. So a resumed run gives the same
    weights as an uninterrupted one, bit for bit.
    """

    def __init__(self, folder: Path, config: RunConfig) -> None:
        self.folder = folder
        self.config = config
        self.machine, self.robot, self.recipe = config.machine, config.robot, config.recipe
        self.iteration = 0
        self._wall = 0.0
        torch.set_num_threads(self.recipe.threads)
        torch.manual_seed(config.seed)
        env = GaitEnv(
            self.machine,
            flat(FIELD, FIELD),
            self.recipe.robots,
            config=self.recipe.env,
            robot=self.robot,
            threads=self.recipe.physics_threads,
        )
        self.learner = Learner(env, self.recipe)

    @classmethod
    def create(cls, folder: Path, config: RunConfig, *, overwrite: bool = False) -> "Run":
        """A new run in a new folder, or in the folder of a run that has no checkpoint yet."""
        if folder.exists() and not (folder.is_dir() and is_barely_begun(folder)):
            if not overwrite:
                raise GaitshiftError(
                    f"{folder} exists and is not empty; give another --out, --overwrite, "
                    f"or --resume {folder}"
                )
            clear(folder)
        folder.mkdir(parents=True, exist_ok=True)  # first: without a folder nothing else can work
        run = cls(folder, config)
        config.write(folder)  # first, so that a folder that a kill left still shows what it is
        run._save_checkpoint()
        return run

    @classmethod
    def resume(cls, folder: Path) -> "Run":
        """The run of a folder, as it was at its last checkpoint."""
        config = RunConfig.read(folder)
        try:
            run = cls(folder, config)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
            raise GaitshiftError(f"{folder / CONFIG} is damaged: {error}") from error
        except GaitshiftError as error:
            raise GaitshiftError(f"{folder / CONFIG}: {error}") from error
        checkpoints = checkpoint.files(folder)
        if checkpoints:
            run._load_checkpoint(checkpoints[-1])
        elif is_barely_begun(folder):
            run._save_checkpoint()
        else:
            raise GaitshiftError(f"{folder / CHECKPOINTS} has no checkpoint to resume from")
        return run

    def train(
        self,
        report: Callable[[Row], None] = lambda row: None,
        judge: Judge | None = None,
        keep: Keep | None = None,
        publish_every: float = inf,
    ) -> Path:
        """Runs to the end, calling `report` after each iteration; gives the policy's path.

        At each checkpoint the policy is written for `judge`, and its verdict is saved. If a kill
        prevented the verdict of the present checkpoint, that one is made first. With `keep`, the
        first `MOST_FILES` divergences are written to `diverged/ITERATION-ROBOT.npz`. The policy is
        also written every `publish_every` seconds, for those who watch.
        After Ctrl-C the last checkpoint and the present policy are on disk.
        """
        for name in (PROGRESS, VERDICTS):
            trim(self.folder / name, self.iteration)
        try:
            with TensorBoardLog(self.folder / "tensorboard", self.iteration) as curves:
                self._train(curves, report, judge, keep, publish_every)
        finally:
            self.export()
        return self.folder / POLICY

    def _train(
        self,
        curves: TensorBoardLog,
        report: Callable[[Row], None],
        judge: Judge | None,
        keep: Keep | None,
        publish_every: float,
    ) -> None:
        if judge is not None and self._lacks_verdict():
            self._write_verdict(judge)
        published = time.monotonic()
        while self.iteration < self.recipe.iterations:
            row = self.iterate()
            table.append(self.folder / PROGRESS, row)
            curves.add(row)
            report(row)
            self._keep_divergences(keep)
            if self._is_checkpoint():
                self._save_checkpoint()
                if judge is not None:
                    self._write_verdict(judge)
            elif time.monotonic() > published + publish_every:
                self.export()
                published = time.monotonic()

    def go_to(self, iteration: int) -> None:
        """Goes back to the checkpoint of an iteration.

        Raises:
            GaitshiftError: the checkpoint is missing or damaged.
        """
        self._load_checkpoint(checkpoint.file_of(self.folder, iteration))

    def write_policy_at(self, iteration: int, path: Path) -> None:
        """Writes the policy of a checkpoint, to which the run goes back.

        Raises:
            GaitshiftError: as `go_to`.
        """
        self.go_to(iteration)
        self.export(path)

    def export(self, path: Path | None = None) -> None:
        """Writes the present policy, into the run's folder if no path is given."""
        training = {
            "command": self.config.command,
            "seed": self.config.seed,
            "iterations": self.iteration,
            "steps": self._steps(),
            "versions": versions(),
        }
        info = describe(self.learner.env, training)
        ppo = self.learner.ppo
        critic = None if self.recipe.env.privileged else ppo.critic  # which needs more than a robot
        export(ppo.actor, info, path or self.folder / POLICY, self._averaged(), critic)

    def _averaged(self) -> torch.nn.Sequential:
        """The present actor's layers, averaged with those of the last checkpoints."""
        averaged = (
            path
            for path in checkpoint.files(self.folder)
            if int(path.stem) < self.iteration and self.recipe.is_averaged(int(path.stem))
        )
        return checkpoint.averaged(self.learner.ppo.actor.mlp, averaged)

    def iterate(self) -> Row:
        """One iteration, on the ground of its stage; returns the row that `train` writes."""
        start = time.perf_counter()
        stage, within = self.recipe.stage_at(self.iteration)
        env = self.learner.env
        if within % stage.redraw_every == 0 and (stage.is_rough or within == 0):
            env.set_terrain(draw_grounds(stage, within, self.config.seed), stage.fidelity)
            env.push_at_most(stage.push)
        env.curriculum = self.recipe.curriculum(self.iteration)
        settling = self.recipe.settling(self.iteration)
        self.learner.aim(
            desired_kl=stage.kl_factor * settling,
            entropy=stage.entropy_factor * settling,
            horizon=stage.horizon_factor,
            trace=stage.trace_factor,
        )
        if self._is_checkpoint():
            self.learner.start_episodes(_seed_at(self.config.seed, self.iteration))
        seen = self.learner.iterate()
        self.iteration += 1
        self._wall += time.perf_counter() - start
        return {
            "iteration": self.iteration,
            "stage": stage.name,
            "steps": self._steps(),
            "wall_s": round(self._wall, 3),
            **{name: float(f"{value:.6g}") for name, value in seen.items()},
        }

    def _steps(self) -> int:
        return self.iteration * self.recipe.robots * self.recipe.steps

    def _is_checkpoint(self) -> bool:
        last = self.iteration == self.recipe.iterations
        return last or self.iteration % self.recipe.checkpoint_every == 0

    def _save_checkpoint(self) -> None:
        state: dict[str, Any] = {
            "iteration": self.iteration,
            "wall_s": self._wall,
            "torch_rng": torch.get_rng_state(),
            "ppo": self.learner.ppo.save(),
        }
        for name in (PROGRESS, VERDICTS):  # their rows up to a checkpoint are never repeated
            if (self.folder / name).is_file():
                flush_to_disk(self.folder / name)
        checkpoint.write(self.folder, state)

    def _load_checkpoint(self, path: Path) -> None:
        state = checkpoint.read(path)
        self.iteration = state["iteration"]
        self._wall = state["wall_s"]
        try:
            self.learner.ppo.load(state["ppo"], None, True)
        except (KeyError, RuntimeError, ValueError) as error:
            why = " ".join(str(error).split())
            raise GaitshiftError(f"{path} does not fit {self.folder / CONFIG}: {why}") from error
        torch.set_rng_state(state["torch_rng"])
        stage, within = self.recipe.stage_at(self.iteration)
        drawn = within - within % stage.redraw_every
        self.learner.env.set_terrain(draw_grounds(stage, drawn, self.config.seed), stage.fidelity)
        self.learner.env.push_at_most(stage.push)

    def _keep_divergences(self, keep: Keep | None) -> None:
        seen = self.learner.env.world.divergences
        folder = self.folder / DIVERGED
        for divergence in seen:
            if keep is not None and len(list(folder.glob("*.npz"))) < MOST_FILES:
                folder.mkdir(exist_ok=True)
                keep(divergence, folder / f"{self.iteration:06d}-{divergence.robot}.npz")
        seen.clear()

    def _lacks_verdict(self) -> bool:
        if self.iteration == 0 or not self._is_checkpoint():
            return False
        return last(self.folder / VERDICTS, self.iteration).get("iteration") != self.iteration

    def _write_verdict(self, judge: Judge) -> None:
        self.export()
        verdict = judge(self.folder / POLICY)
        table.append(self.folder / VERDICTS, {"iteration": self.iteration, **verdict})


def _seed_at(seed: int, iteration: int) -> int:
    return int(np.random.SeedSequence((seed, iteration)).generate_state(1)[0])
