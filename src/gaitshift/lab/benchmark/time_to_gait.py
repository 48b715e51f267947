"""Time to gait: how long training takes until a policy meets a criterion, and a baseline's."""

import hashlib
import json
import time
from collections.abc import Callable, Generator, Sequence
from dataclasses import asdict, dataclass, field, replace
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol, cast

from gaitshift.control import policy
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.lab.benchmark.outcome import Outcome
from gaitshift.lab.evaluation import EvaluationConfig, evaluate
from gaitshift.learn.presets import PRESETS
from gaitshift.learn.recipe import Recipe


@dataclass(frozen=True, kw_only=True)
class Figures:
    """Figures of a check, after the evaluation's warm-up of 2 s."""

    survival: float
    """Share of the robots that did not fall."""
    speed: float | None
    """Mean forward speed [m/s]; None where all fell in the warm-up."""
    pattern_fraction: float | None
    """Share of the steps with a stance of the gait's machine; None as for `speed`."""


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """Robots on flat ground without exploration noise, and the figures that they must reach."""

    survival: float = 0.99
    """Least share of robots that do not fall."""
    speed_error: float = 0.1
    """Greatest |mean forward speed - the gait's nominal speed| [m/s]."""
    pattern_fraction: float = 0.6
    """Least share of steps that show a stance of the machine."""
    robots: int = 64
    """Number of robots; at a survival of 0.99 none of 64 may fall."""
    seconds: float = 6.0
    """Length of the run [s]."""

    def see(self, policy: Policy) -> Figures:
        """Runs the policy at its nominal speed and stride frequency; deterministic."""
        config = EvaluationConfig(episodes=self.robots, seconds=self.seconds)
        seen, _ = evaluate(policy, config)
        return Figures(
            survival=cast(float, seen["survival"]),
            speed=cast("float | None", seen["speed_mean"]),
            pattern_fraction=cast("float | None", seen["pattern_fraction"]),
        )

    def is_passed(self, figures: Figures, own_speed: float) -> bool:
        """Whether the figures meet the criterion for a gait of nominal speed `own_speed` [m/s]."""
        if figures.speed is None or figures.pattern_fraction is None:
            return False
        return (
            figures.survival >= self.survival
            and abs(figures.speed - own_speed) <= self.speed_error
            and figures.pattern_fraction >= self.pattern_fraction
        )


GAITSHIFT, BASELINE = "gaitshift", "stable-baselines3"
"""Names of the learners in outcomes."""


def flat_stage(preset: str = "default") -> Recipe:
    """The first stage of a preset, on flat ground."""
    recipe = PRESETS[preset]()
    return recipe.with_iterations(recipe.stages[0].iterations)


@dataclass(frozen=True, kw_only=True)
class TimeToGait:
    """The trainings, and when they are checked."""

    gaits: tuple[str, ...] = ("trot", "pace", "bound")
    """The paper's three."""
    seeds: int = 3
    """Number of seeds for each gait and learner."""
    first_seed: int = 0
    """First seed; the others follow it."""
    baseline_budget: float = 600.0
    """Training time after which a baseline is stopped [s]; 0: no baseline."""
    recipe: Recipe = field(default_factory=flat_stage)
    """Ours: the flat stage of the default recipe; a training is stopped at its end."""
    check: Criterion = field(default_factory=Criterion)
    """The criterion that ends a training."""
    check_every: int = 10
    """Iterations of ours between two checks; half a baseline's rollout at its defaults."""
    baseline_rollout: int = 2048
    """Control steps of each of the baseline's robots between two updates; it is checked after
    each. stable-baselines3's default."""

    def __post_init__(self) -> None:
        if not 1 <= self.seeds <= 100:
            raise GaitshiftError(f"seeds must be 1 to 100, got {self.seeds}")
        if self.first_seed < 0:
            raise GaitshiftError(f"first_seed must be 0 or larger, got {self.first_seed}")
        if not self.gaits:
            raise GaitshiftError("gaits must name at least one gait, such as trot, got none")
        for name in self.gaits:
            gaits.load(name)
        if not 0 <= self.baseline_budget <= 86_400:
            raise GaitshiftError(
                f"baseline_budget must be 0 to 86400 s, got {self.baseline_budget}"
            )

    @property
    def trainings(self) -> int:
        """Number of trainings, and so of outcomes."""
        return len(self.gaits) * self.seeds * (2 if self.baseline_budget > 0 else 1)

    @classmethod
    def quick(cls) -> "TimeToGait":
        """Trot for seconds on few robots: a test run, not a measurement."""
        return cls(
            gaits=("trot",),
            seeds=1,
            baseline_budget=1.0,
            recipe=replace(Recipe().with_iterations(2), robots=8),
            check=Criterion(robots=8, seconds=2.5),
            check_every=1,
            baseline_rollout=32,
        )


class Trainer(Protocol):
    """A training that is stepped from check to check."""

    @property
    def steps(self) -> int:
        """Control steps of all robots so far."""
        ...

    def advance(self) -> None:
        """Trains up to the next check."""
        ...

    def export(self) -> Path:
        """Writes the present policy, and returns its path."""
        ...


@dataclass(frozen=True, kw_only=True)
class _Entry:
    """A learner in the comparison, and its limit."""

    name: str
    build: Callable[[RewardMachine, int, Path], Trainer]
    most_steps: float = inf
    most_seconds: float = inf

    def knows(self, known: Outcome, gait: str, seed: int) -> bool:
        """Whether an outcome is of this entry, and a longer training would add nothing."""
        if (known.learner, known.gait, known.seed) != (self.name, gait, seed):
            return False
        return known.reached or self.gives_up(known.steps, known.seconds)

    def gives_up(self, steps: int, seconds: float) -> bool:
        """Whether a training has reached its limit."""
        return steps >= self.most_steps or seconds >= self.most_seconds


def fingerprint(config: TimeToGait, learner: str, machine: RewardMachine) -> str:
    """Fingerprint of all settings of a training and its checks except the seed."""
    settings = {
        "machine": machine.to_dict(),
        "recipe": asdict(config.recipe),
        "check": asdict(config.check),
        "rollout": config.check_every if learner == GAITSHIFT else config.baseline_rollout,
    }
    return hashlib.sha256(json.dumps(settings, sort_keys=True).encode()).hexdigest()[:12]


def is_of(config: TimeToGait, outcome: Outcome) -> bool:
    """Whether an outcome is of the same training as in this measurement, from any seed."""
    if outcome.gait not in config.gaits:
        return False
    return outcome.recipe == fingerprint(config, outcome.learner, gaits.load(outcome.gait))


def time_to_gait(config: TimeToGait, known: Sequence[Outcome] = ()) -> Generator[Outcome]:
    """Trains every gait from every seed, ours and the baseline alternately; yields each outcome.

    Outcomes in `known` are yielded without training, unless they are of another recipe.

    Raises:
        GaitshiftError: a package that training needs is not installed.
    """
    entries = _entries(config)
    known = [outcome for outcome in known if is_of(config, outcome)]
    for seed in range(config.first_seed, config.first_seed + config.seeds):
        for gait in config.gaits:
            for entry in entries:
                earlier = (outcome for outcome in known if entry.knows(outcome, gait, seed))
                yield next(earlier, None) or _train(entry, gaits.load(gait), seed, config)


def _entries(config: TimeToGait) -> list[_Entry]:
    recipe = config.recipe
    try:
        from gaitshift.lab.benchmark.trainer import GaitshiftTrainer

        ours = _Entry(
            name=GAITSHIFT,
            build=lambda machine, seed, folder: GaitshiftTrainer(
                machine, recipe, seed, folder, iterations=config.check_every
            ),
            most_steps=recipe.iterations * recipe.robots * recipe.steps,
        )
        if config.baseline_budget == 0:
            return [ours]
        from gaitshift.lab.benchmark.baseline import Baseline
    except ImportError as error:
        raise GaitshiftError(
            f"time-to-gait needs the package '{error.name}'; install gaitshift[train] and "
            "stable-baselines3, or give --baseline-budget 0"
        ) from error
    baseline = _Entry(
        name=BASELINE,
        build=lambda machine, seed, folder: Baseline(
            machine, recipe, seed, folder, rollout=config.baseline_rollout
        ),
        most_seconds=config.baseline_budget,
    )
    return [ours, baseline]


def _train(entry: _Entry, machine: RewardMachine, seed: int, config: TimeToGait) -> Outcome:
    """Trains until a check is passed or the limit is reached; only training is timed."""
    check = config.check
    with TemporaryDirectory() as folder:
        start = time.perf_counter()
        learner = entry.build(machine, seed, Path(folder))
        seconds = time.perf_counter() - start
        while True:
            start = time.perf_counter()
            learner.advance()
            seconds += time.perf_counter() - start
            loaded = policy.load(learner.export())
            figures = check.see(loaded)
            reached = check.is_passed(figures, loaded.info.forward_speed)
            if reached or entry.gives_up(learner.steps, seconds):
                return Outcome(
                    gait=machine.name,
                    learner=entry.name,
                    seed=seed,
                    reached=reached,
                    seconds=seconds,
                    steps=learner.steps,
                    **asdict(figures),
                    recipe=fingerprint(config, entry.name, machine),
                )
