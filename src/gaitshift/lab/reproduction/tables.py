"""The small CSV files of a reproduction."""

from collections.abc import Iterator

from gaitshift.lab.reproduction.judging import JudgedPolicy
from gaitshift.lab.reproduction.learning_curve import DECIMALS
from gaitshift.lab.reproduction.plan import ABLATED, ABLATIONS, PAPER, REFERENCE, Setting
from gaitshift.lab.reproduction.results import Results, Seeds, fingerprint
from gaitshift.table import Row

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
