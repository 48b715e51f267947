"""What is trained: the paper's recipe with one thing changed at a time, its gaits, and the jobs."""

from dataclasses import dataclass, replace

from gaitshift.control.observation import PAPER_SLICES
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.learn.presets import paper
from gaitshift.learn.recipe import Recipe
from gaitshift.sim.reward import RewardConfig

LOCKOUT = 10
"""Control steps between two changes of state in the main runs. The paper prints none; the first
author's code for another robot has 10, and the published plateau of 25 to 27 implies it: with
b = 200 added at most every 20 steps no reward above 10 + 200 / 20 = 20 per step is possible."""

PAPER = "paper"
"""Name of the setting with which the others are compared."""


@dataclass(frozen=True, kw_only=True)
class Setting:
    """One way to train: a recipe, and a lock-out for the machine of any gait."""

    name: str
    """In the names of runs and in tables."""
    group: str
    """The question that it answers, together with the paper's setting."""
    label: str
    """Short description of the change."""
    recipe: Recipe
    """Everything but the machine."""
    lockout: int = LOCKOUT
    """Least time between two changes of the machine's state [control steps]."""

    def machine(self, gait: str) -> RewardMachine:
        """The gait's machine with this lock-out, and without a swing height."""
        own = gaits.load(gait)
        edges = tuple(
            replace(edge, guard=replace(edge.guard, dwell=self.lockout), swing_height=0.0)
            for edge in own.edges
        )
        return replace(
            own, edges=edges, dwell=self.lockout, dwell_range=(self.lockout, self.lockout)
        )


def _recipe(
    *,
    gains: str = "default",
    observed: tuple[str, ...] = PAPER_SLICES,
    penalty_start: float = 1.0,
    **reward: object,
) -> Recipe:
    """The paper's recipe on one core, on gains that hold the robot up, and one thing changed."""
    whole = paper()
    weights: RewardConfig = replace(whole.env.reward, **reward)
    env = replace(whole.env, gains=gains, observed=observed, reward=weights)
    return replace(whole, env=env, penalty_start=penalty_start, threads=1, physics_threads=1)


_WITHOUT_MACHINE = tuple(s for s in PAPER_SLICES if s not in ("machine_state", "steps_in_state"))

REFERENCE = Setting(name=PAPER, group=PAPER, label="the paper's recipe", recipe=_recipe())

ABLATIONS = (
    Setting(
        name="multiply-clipped",
        group="bonus",
        label="max(R, 0) · b",
        recipe=_recipe(bonus_mode="multiply_clipped"),
    ),
    Setting(name="multiply", group="bonus", label="R · b", recipe=_recipe(bonus_mode="multiply")),
    Setting(name="lockout-0", group="lock-out", label="no lock-out", recipe=_recipe(), lockout=0),
    Setting(name="lockout-20", group="lock-out", label="20 steps", recipe=_recipe(), lockout=20),
    Setting(
        name="blind",
        group="observation",
        label="u and δ hidden",
        recipe=_recipe(observed=_WITHOUT_MACHINE),
    ),
    Setting(name="no-bonus", group="machine", label="b = 0", recipe=_recipe(bonus=0.0)),
    Setting(
        name="curriculum",
        group="penalties",
        label="λ grows from 0.1 to 1",
        recipe=_recipe(penalty_start=0.1),
    ),
    Setting(name="paper-gains", group="gains", label="Kp 3, Kd 0.2", recipe=_recipe(gains="paper")),
)
"""Each differs from `REFERENCE` in the one setting that it names."""

AS_IN_THE_PAPER = {
    "bonus": "R + b",
    "lock-out": f"{LOCKOUT} steps",
    "observation": "u and δ shown",
    "machine": "b = 200",
    "penalties": "λ = 1 from the start",
    "gains": "Kp 80, Kd 2",
}
"""Label of the reference in each group."""


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
