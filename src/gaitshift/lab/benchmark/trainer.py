"""The trainer of `gaitshift train`, stepped from check to check."""

from pathlib import Path

from gaitshift.gait import RewardMachine
from gaitshift.learn.recipe import Recipe
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig
from gaitshift.learn.run_folder import POLICY


class GaitshiftTrainer:
    """A training run that writes only its policy."""

    def __init__(
        self, machine: RewardMachine, recipe: Recipe, seed: int, folder: Path, *, iterations: int
    ) -> None:
        """Trains `iterations` at a time; writes the policy to `folder`."""
        command = "gaitshift bench time-to-gait"
        config = RunConfig(machine=machine, recipe=recipe, seed=seed, command=command)
        self._run = Run(folder, config)
        self._iterations = iterations

    @property
    def steps(self) -> int:
        """Control steps of all robots so far."""
        return self._run.iteration * self._run.recipe.robots * self._run.recipe.steps

    def advance(self) -> None:
        """Trains up to the next check."""
        for _ in range(self._iterations):
            self._run.iterate()

    def export(self) -> Path:
        """Writes the present policy."""
        self._run.export()
        return self._run.folder / POLICY
