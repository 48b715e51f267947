"""`gaitshift train`: a gait from its machine to a policy file."""

import shlex
import sys
import time
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, fields, replace
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import tyro
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from gaitshift.cli.output import emit_json, say
from gaitshift.cli.robot_options import RobotOption
from gaitshift.cli.watch import PUBLISH_EVERY, Watch
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import only_writer
from gaitshift.gait import gaits
from gaitshift.lab.evaluation import flat_verdict
from gaitshift.lab.evaluation.divergence import divergence_log

if TYPE_CHECKING:
    from gaitshift.learn.run import Row, Run
    from gaitshift.sim.world import Divergence


@dataclass(frozen=True, kw_only=True)
class Train(RobotOption):
    """Train a gait with PPO: flat ground first, then rough ground with pushes.

    Writes config.json, progress.csv, verdicts.csv (a short evaluation at each checkpoint),
    tensorboard/, checkpoints/ and policy.onnx; and where the simulation of a robot diverges,
    diverged/, logs of its last second. After Ctrl-C, --resume continues the run.
    """

    gait: Annotated[str | None, tyro.conf.Positional] = None
    """Name of a gait (see `gaitshift gaits`) or a machine file (.toml)."""
    preset: (
        Literal["default", "three-stage", "two-stage", "deployable", "deployable-gradual", "paper"]
        | None
    ) = None
    """Training recipe: default; three-stage or two-stage, by which the shipped policies are made;
    deployable (sensors like ANYmal's, delay, robots that differ, mild ground); deployable-gradual
    (the same with a smaller weight of the stance on flat ground); or paper (Table I, 30 robots, Kp
    3, Kd 0.2, flat ground). If not given: default."""
    recipe: Path | None = None
    """TOML file of settings that differ from the preset, such as [ppo] and epochs = 3."""
    settings: Annotated[tuple[str, ...], tyro.conf.arg(name="set", metavar="NAME=VALUE")] = ()
    """Settings that differ from preset and file: reward.power=-0.05 stages.flat.iterations=200"""
    robots: int | None = None
    """Number of robots in parallel; by default that of the recipe."""
    iterations: int | None = None
    """Total number of PPO iterations; by default that of the recipe."""
    threads: int | None = None
    """Number of torch threads; by default that of the recipe. Use 1 for parallel trainings."""
    seed: int | None = None
    """Seed of networks, exploration, terrains and pushes; 0 by default."""
    out: Path | None = None
    """Folder of the run; runs/GAIT-SEED by default."""
    resume: Path | None = None
    """Continue the run in this folder, with its own settings."""
    overwrite: bool = False
    """Replace an earlier run in the folder."""
    watch: bool = False
    """A page in the browser shows the robot walk as it learns."""
    port: int = 8080
    """Port of the page."""
    json: bool = False
    """One JSON object on stdout: the last line of progress.csv, the last verdict, and the policy's
    path."""

    def run(self) -> None:
        """Trains, with a progress bar."""
        folder, begin = self._beginning()
        page = Watch(self.port) if self.watch else None
        with page or nullcontext(), only_writer(folder):
            run = begin(folder)
            if page is not None:
                run.export()
                page.show(folder)
            bar = _Bar(run)
            try:
                with bar:
                    every = inf if page is None else PUBLISH_EVERY
                    path = run.train(bar, bar.judge, bar.keep, publish_every=every)
            except KeyboardInterrupt as stop:
                command = f"gaitshift train --resume {folder}"
                raise type(stop)(f"interrupted; continue with: {command}") from None
        if self.json:
            emit_json({**bar.row, "verdict": bar.verdict or None, "policy": str(path)})
            return
        if bar.verdict:
            print(f"{_spell(bar.verdict)}, {bar.verdict['misses'] or 'no limit missed'}")
        print(f"policy written to {path}; evaluate it with: gaitshift evaluate {path}")

    def _beginning(self) -> tuple[Path, "Callable[[Path], Run]"]:
        """The folder of the run, and what begins or resumes it there."""
        try:
            from gaitshift.learn.presets import PRESETS
            from gaitshift.learn.run import Run
            from gaitshift.learn.run_config import RunConfig
            from gaitshift.learn.settings import differences, with_settings
        except ImportError as error:
            raise GaitshiftError(
                f"training needs the package '{error.name}'; install gaitshift[train]"
            ) from error
        if self.resume is not None:
            self._refuse_settings()
            if not self.resume.is_dir():
                raise GaitshiftError(f"{self.resume} is not a training run: it is not a folder")
            return self.resume, Run.resume
        if self.gait is None:
            known = ", ".join(gaits.names())
            raise GaitshiftError(
                f"gait must be one of {known}, or a .toml file, got none; or give --resume DIR"
            )
        seed = self.seed or 0
        if seed < 0:
            raise GaitshiftError(f"seed must be 0 or larger, got {seed}")
        machine, robot = gaits.load(self.gait), self.read_robot()
        preset = self.preset or "default"
        default = PRESETS[preset]()
        recipe = with_settings(default, self.settings, self.recipe)
        for name, (value, usual) in differences(recipe, default).items():
            say(f"{name} is {value} (preset {preset}: {usual})")
        if self.robots is not None:
            recipe = replace(recipe, robots=self.robots)
        if self.threads is not None:
            recipe = replace(recipe, threads=self.threads)
        if self.iterations is not None:
            recipe = recipe.with_iterations(self.iterations)
        folder = self.out or Path("runs") / f"{machine.name}-{seed}"
        return folder, partial(
            Run.create,
            config=RunConfig(
                machine=machine,
                recipe=recipe,
                seed=seed,
                command=shlex.join(["gaitshift", *sys.argv[1:]]),
                robot=robot,
            ),
            overwrite=self.overwrite,
        )

    def _refuse_settings(self) -> None:
        for field in fields(Train):
            if (
                field.name in ("resume", "watch", "port", "json")
                or getattr(self, field.name) == field.default
            ):
                continue
            names = {"gait": "a gait", "settings": "--set"}
            option = names.get(field.name, f"--{field.name.replace('_', '-')}")
            raise GaitshiftError(
                f"{option} must not be given with --resume, which has its own settings"
            )


def _spell(verdict: "Row") -> str:
    """The gait of a verdict, and whether it is clean."""
    return f"{verdict['gait']}, {'clean' if verdict['clean'] else 'not clean'}"


class _Bar:
    """Progress of a training: steps/s, speed, survival, the last verdict and time left."""

    def __init__(self, run: "Run") -> None:
        from gaitshift.learn.progress import last
        from gaitshift.learn.run_folder import PROGRESS, VERDICTS

        self.row: Row = last(run.folder / PROGRESS, run.iteration)
        """The last line of progress.csv."""
        self.verdict: Row = last(run.folder / VERDICTS, run.iteration)
        """The last verdict."""
        self.verdict.pop("iteration", None)
        self._run = run
        console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.completed:.0f}/{task.total:.0f}"),
            TextColumn("{task.fields[seen]}"),
            TimeRemainingColumn(),
            console=console,
            disable=not console.is_terminal,
        )
        self._task = self._progress.add_task(
            run.machine.name, total=run.recipe.iterations, completed=run.iteration, seen=""
        )
        self._clock = (time.perf_counter(), run.iteration)

    def __enter__(self) -> "_Bar":
        self._progress.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._progress.stop()

    def judge(self, path: Path) -> "Row":
        """A short evaluation of the present policy, with the sensors of the training."""
        sensors = self._run.recipe.env.sensors
        self.verdict = flat_verdict(policy.load(path, self._run.robot), sensors)
        return self.verdict

    def keep(self, divergence: "Divergence", path: Path) -> None:
        """Writes the last second of a robot whose simulation diverged."""
        divergence_log(divergence, self._run.robot, self._run.machine).save(path)

    def __call__(self, row: "Row") -> None:
        self.row = row
        start, first = self._clock
        iterations = row["iteration"] - first
        recipe = self._run.recipe
        rate = iterations * recipe.robots * recipe.steps / (time.perf_counter() - start)
        seen = (
            f"{row['stage']}  {rate:,.0f} steps/s  {row['speed']:.2f} m/s  "
            f"survival {row['survival']:.2f}"
        )
        if row["diverged"]:
            seen += f"  {row['diverged']:.0f} diverged"
        if self.verdict:
            seen += f"  {_spell(self.verdict)}"
        self._progress.update(self._task, completed=row["iteration"], seen=seen)
