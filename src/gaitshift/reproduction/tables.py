"""The small CSV files of a reproduction."""

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from gaitshift.reproduction.judging import Judged
from gaitshift.reproduction.plan import ABLATED
from gaitshift.reproduction.results import Results, Seeds
from gaitshift.reproduction.settings import ABLATIONS, REFERENCE, Setting

GAITS, ABLATED_RUNS, CURVES = "gaits.csv", "ablations.csv", "curves.csv"

EVERY = 5
"""Iterations from one line of `curves.csv` to the next."""

Row = dict[str, Any]


def gait_rows(judged: list[Judged]) -> list[Row]:
    """A row a policy of the paper's setting: from when it walked, and how it walks."""
    return [
        {
            "gait": one.gait,
            "seed": one.seed,
            "walks_from_iteration": one.walks_at,
            **{name: _short(value) for name, value in one.figures.items()},
        }
        for one in judged
    ]


def ablation_rows(results: Results) -> list[Row]:
    """A row a setting, the reference first; means over the last tenth of the iterations."""
    reference = results.reference
    rows = [] if reference is None else [_ablation_row(REFERENCE, reference)]
    settings = {setting.name: setting for setting in ABLATIONS}
    return rows + [_ablation_row(settings[name], seeds) for name, seeds in results.ablations()]


def curve_rows(results: Results) -> Iterator[Row]:
    """Mean and standard deviation over seeds, every few iterations, of every setting and gait."""
    for (setting, gait), seeds in results.seeds.items():
        longest = max(map(len, seeds.courses))
        for index in range(EVERY - 1, longest, EVERY):
            there = [course for course in seeds.courses if len(course) > index]
            row: Row = {"setting": setting, "gait": gait, "iteration": index + 1}
            for name in ("reward", "speed"):
                values = [getattr(course, name)[index] for course in there]
                row[f"{name}_mean"] = round(float(np.mean(values)), 4)
                row[f"{name}_sd"] = round(float(np.std(values)), 4)
            yield {**row, "seeds": len(there)}


def write(rows: list[Row], path: Path) -> None:
    """Writes rows of the same columns."""
    with path.open("w", newline="") as file:
        lines = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        lines.writeheader()
        lines.writerows(rows)


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
        "iterations": max(map(len, seeds.courses)),
        "walking": seeds.walking,
        "walk_from_iteration": seeds.walk_from,
        "as_fast": seeds.moving,
        "as_fast_from_iteration": seeds.move_from,
        **{name: _short(value) for name, value in late.items()},
    }


def _short(value: float | None) -> float | None:
    return None if value is None else round(value, 4)
