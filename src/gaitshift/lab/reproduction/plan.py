"""The plan of the reproduction: gaits and curves of the paper, and the jobs."""

from dataclasses import dataclass, replace

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.lab.reproduction.settings import ABLATIONS, PAPER, REFERENCE, Setting
from gaitshift.learn.recipe import Recipe

GAITS = ("trot", "bound", "pace")
"""The paper's gaits, in the order in which it learns them (IV-B)."""

START = -25.0
"""Reward a control step at the first iteration, of all gaits; read off Fig. 1."""

PLATEAU = (25.0, 27.0)
"""Reward a control step that the curves end at; read off Fig. 1."""

ZERO_CROSSING = {"trot": 38, "bound": 52, "pace": 85}
"""Iteration at which each curve crosses zero; read off Fig. 1."""

LEARNED_BY = 100
"""Iteration by which a robot moves in the right way in most cases (IV-B)."""


ABLATED = "trot"
"""The gait of the ablations: the one that the paper learns first."""


@dataclass(frozen=True, kw_only=True)
class Job:
    """One training run of the plan."""

    setting: Setting
    """How it is trained."""
    gait: str
    """Which gait."""
    seed: int
    """Seed of networks, exploration and starts."""
    recipe: Recipe
    """The setting's recipe with the plan's number of iterations."""

    @property
    def name(self) -> str:
        """Name of its folder."""
        return f"{self.setting.name}-{self.gait}-{self.seed}"

    @property
    def machine(self) -> RewardMachine:
        """The machine it is trained with."""
        return self.setting.machine(self.gait)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """All runs and their sizes."""

    seed: int = 0
    """First seed; the others follow it."""
    seeds: int = 5
    """Seeds of each gait in the paper's setting."""
    ablation_seeds: int = 3
    """Seeds of each ablation."""
    ablation_iterations: int = 200
    """Iterations of each ablation, and of the reference when compared with one; ours: twice what
    the paper needs to learn a gait, so that all runs take a few hours."""
    robots: int = 16
    """Robots that a trained policy of the paper's setting is judged on."""
    seconds: float = 10.0
    """Time that they walk [s]."""
    quick: bool = False
    """Tiny runs that learn nothing, as a test of the program."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise GaitshiftError(f"seed must be 0 or larger, got {self.seed}")

    @classmethod
    def tiny(cls, seed: int = 0) -> "Plan":
        """One seed, four iterations, six robots."""
        return cls(
            seed=seed,
            seeds=1,
            ablation_seeds=1,
            ablation_iterations=3,
            robots=2,
            seconds=3.0,
            quick=True,
        )

    @property
    def jobs(self) -> tuple[Job, ...]:
        """Every run: those of the paper's setting first, seed by seed, then the ablations."""
        main = [
            self._job(REFERENCE, gait, seed)
            for seed in range(self.seed, self.seed + self.seeds)
            for gait in GAITS
        ]
        ablations = [
            self._job(setting, ABLATED, seed)
            for setting in ABLATIONS
            for seed in range(self.seed, self.seed + self.ablation_seeds)
        ]
        return (*main, *ablations)

    def select(self, only: tuple[str, ...]) -> tuple[Job, ...]:
        """The runs of these gaits (in the paper's setting), settings or groups; all if none.

        With an ablation the runs of its reference are included.
        """
        groups = {setting.name: setting.group for setting in ABLATIONS}
        known = (PAPER, *GAITS, *dict.fromkeys(groups.values()), *groups)
        unknown = [name for name in only if name not in known]
        if unknown:
            raise GaitshiftError(f"only must name some of {', '.join(known)}, got '{unknown[0]}'")
        compared = any(name in groups or name in groups.values() for name in only)
        return tuple(
            job
            for job in self.jobs
            if not only
            or job.setting.name in only
            or job.setting.group in only
            or (job.setting.name == PAPER and job.gait in only)
            or (compared and self._is_reference(job))
        )

    def _is_reference(self, job: Job) -> bool:
        seed_counts = job.seed < self.seed + self.ablation_seeds
        return job.setting.name == PAPER and job.gait == ABLATED and seed_counts

    def _job(self, setting: Setting, gait: str, seed: int) -> Job:
        recipe = setting.recipe
        if self.quick:
            recipe = _shrunk(recipe)
        if setting.name != PAPER:
            recipe = recipe.with_iterations(self.ablation_iterations)
        return Job(setting=setting, gait=gait, seed=seed, recipe=recipe)


def _shrunk(recipe: Recipe) -> Recipe:
    """The same recipe, too short to learn anything."""
    ppo = replace(recipe.ppo, epochs=1, mini_batches=2)
    small = replace(recipe, ppo=ppo, robots=6, steps=12, checkpoint_every=2)
    return small.with_iterations(4)
