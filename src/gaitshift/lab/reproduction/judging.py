"""Trained policies, judged without exploration noise, and the small CSV files of a reproduction."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from statistics import fmean

from gaitshift.control import policy
from gaitshift.lab.evaluation import EvaluationConfig, evaluate
from gaitshift.lab.log import Log
from gaitshift.lab.reproduction.learning_curve import DECIMALS
from gaitshift.lab.reproduction.plan import ABLATED, ABLATIONS, PAPER, REFERENCE, Setting
from gaitshift.lab.reproduction.results import EarlierRuns, Results, Seeds, fingerprint
from gaitshift.learn.run_folder import POLICY
from gaitshift.table import Row

FIGURES = (
    "survival",
    "speed_mean",
    "pattern_fraction",
    "cycles_per_s",
    "touchdowns_per_cycle",
    "cost_of_transport",
)
"""Figures of each policy; touchdowns are the mean over the feet (1: a clean cycle)."""


@dataclass(frozen=True, kw_only=True)
class JudgedPolicy:
    """The figures of one policy."""

    gait: str
    """Its gait."""
    seed: int
    """Seed of its training."""
    walks_at: int | None
    """Iteration of its training from which it walked."""
    figures: Mapping[str, float | None]
    """`FIGURES` by name; None where all robots fell at once."""
    log: Log | None
    """Log of the walk; None for a policy that an earlier report judged."""


def judge(
    results: Results,
    runs: Path,
    earlier: EarlierRuns,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> list[JudgedPolicy]:
    """Evaluates the policies of the paper's setting on flat ground, except those judged earlier."""
    wanted = list(_policies(results))
    judged: list[JudgedPolicy] = []
    plan = results.plan
    config = EvaluationConfig(episodes=plan.robots, seconds=plan.seconds, seed=plan.seed)
    for gait, seed, walks_at, name in wanted:
        path, log = runs / name / POLICY, None
        if path.is_file():
            measured, log = evaluate(policy.load(path), config)
            figures: Mapping[str, float | None] = {key: _one(measured[key]) for key in FIGURES}
        else:
            figures = earlier.figures.get(name, dict.fromkeys(FIGURES))
        judged.append(
            JudgedPolicy(gait=gait, seed=seed, walks_at=walks_at, figures=figures, log=log)
        )
        report(len(judged), len(wanted))
    return judged


def middle(judged: list[JudgedPolicy], gait: str) -> JudgedPolicy | None:
    """The policy of a gait with the median pattern fraction."""
    ordered = sorted(
        (one for one in judged if one.gait == gait),
        key=lambda one: one.figures["pattern_fraction"] or 0.0,
    )
    return ordered[len(ordered) // 2] if ordered else None


def _policies(results: Results) -> Iterator[tuple[str, int, int | None, str]]:
    for gait, seeds in results.gaits():
        for job, curve, broken in zip(seeds.jobs, seeds.curves, seeds.broken, strict=True):
            if not broken:
                yield gait, job.seed, curve.walks_at, job.name


def _one(value: float | list[float] | None) -> float | None:
    """The figure, or its mean over the feet; None for nothing to measure."""
    if value is None:
        return None
    number = fmean(value) if isinstance(value, list) else float(value)
    return number if isfinite(number) else None


ABLATED_RUNS = "ablations.csv"


def gait_rows(judged: list[JudgedPolicy]) -> list[Row]:
    """A row per policy of the paper's setting: when it began to walk, and its figures."""
    return [
        {
            "setting": PAPER,
            "gait": one.gait,
            "seed": one.seed,
            "walks_from_iteration": one.walks_at,
            **{name: _short(value) for name, value in one.figures.items()},
        }
        for one in judged
    ]


def ablation_rows(results: Results) -> list[Row]:
    """A row per setting, the reference first; means over the last tenth of the iterations."""
    reference = results.reference
    rows = [] if reference is None else [_ablation_row(REFERENCE, reference)]
    settings = {setting.name: setting for setting in ABLATIONS}
    return rows + [_ablation_row(settings[name], seeds) for name, seeds in results.ablations()]


def run_rows(results: Results) -> list[Row]:
    """A row per run: its iterations and the fingerprint of its recipe."""
    return [
        {
            "setting": job.setting.name,
            "gait": job.gait,
            "seed": job.seed,
            "iterations": len(curve),
            "broke_down": broken,
            "recipe": fingerprint(job),
        }
        for seeds in results.seeds.values()
        for job, curve, broken in zip(seeds.jobs, seeds.curves, seeds.broken, strict=True)
    ]


def curve_rows(results: Results) -> Iterator[Row]:
    """A row per iteration of every run."""
    for (setting, gait), seeds in results.seeds.items():
        for job, curve in zip(seeds.jobs, seeds.curves, strict=True):
            run: Row = {"setting": setting, "gait": gait, "seed": job.seed}
            columns = [
                [f"{value:.{digits}f}" for value in getattr(curve, name)]
                for name, digits in DECIMALS.items()
            ]
            for index, entries in enumerate(zip(*columns, strict=True)):
                yield {**run, "iteration": index + 1, **dict(zip(DECIMALS, entries, strict=True))}


def _ablation_row(setting: Setting, seeds: Seeds) -> Row:
    late = {
        f"late_{name}": seeds.late(name)
        for name in ("speed", "survival", "changes_per_s", "stance_fraction")
    }
    return {
        "group": setting.group,
        "setting": setting.name,
        "label": setting.label,
        "gait": ABLATED,
        "seeds": len(seeds),
        "broke_down": sum(seeds.broken),
        "iterations": max(map(len, seeds.curves)),
        "walking": seeds.walking,
        "walk_from_iteration": seeds.walk_from,
        "as_fast": seeds.moving,
        "as_fast_from_iteration": seeds.move_from,
        **{name: _short(value) for name, value in late.items()},
    }


def _short(value: float | None) -> float | None:
    return None if value is None else round(value, 4)
