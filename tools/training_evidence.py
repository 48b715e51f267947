"""Trains many times on flat ground and writes what came of it: docs/results/seeds.md, additions.md.

Usage: python tools/training_evidence.py seeds|additions [--jobs N]

`seeds` trains trot, pace and bound with five fresh seeds each; `additions` trains trot without each
of the reward's additions in turn, three seeds each. One run takes about five minutes on a core.
Broken off, the same command goes on where it stopped (runs/evidence).
"""

import argparse
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

from gaitshift import gaits, policy
from gaitshift.cli.output import progress
from gaitshift.evaluation import EvaluationConfig, evaluate
from gaitshift.gait_analysis import FIRST_GAITS
from gaitshift.reproduction.plan import Job
from gaitshift.reproduction.pool import train_all
from gaitshift.reproduction.settings import Setting
from gaitshift.reward import ADDITIONS, BONUS_SHARES
from gaitshift.reward_machine import RewardMachine
from gaitshift.training.recipe import Recipe
from gaitshift.training.run import POLICY

RUNS = Path("runs/evidence")
RESULTS = Path(__file__).parent.parent / "docs" / "results"
FRESH_SEEDS = range(1, 6)
"""The shipped policies have seed 0."""
ABLATION_SEEDS = range(1, 4)
ABLATED = "trot"
JUDGED = EvaluationConfig(episodes=64, seconds=12.0)

SEEDS_HEAD = """# Five fresh seeds

The flat stage of the default recipe alone ({iterations} iterations, {steps:.1f} million control
steps, about five minutes on one core), for five seeds that are not those of the shipped policies.
Each policy is judged on flat ground, 64 robots for 12 s, by the limits of `gaitshift evaluate`,
whose speed loop trims the asked speed; open loop: the mean speed without it.
This page is made by `python tools/training_evidence.py seeds`.
"""
ADDITIONS_HEAD = """# The additions to Table I, taken away

Trot on the flat stage of the default recipe ({iterations} iterations), whole and without each of
the seven terms that the reward adds to the paper's Table I, and of the two manners
of a change that the bonus depends on (`gaitshift.reward.ADDITIONS`, `BONUS_SHARES`): means over
three seeds, each policy judged on flat ground, 64 robots for 12 s. Clean: how many of the three
keep all limits of `gaitshift evaluate`. Worst touchdowns: of the foot furthest from one a cycle.
This page is made by `python tools/training_evidence.py additions`.
"""


@dataclass(frozen=True, kw_only=True)
class Default(Setting):
    """The default recipe, or one like it, with the machines as they are."""

    def machine(self, gait: str) -> RewardMachine:
        """The gait's own."""
        return gaits.load(gait)


def setting(without: str | None = None) -> Default:
    """The flat stage on one core, without one of the additions."""
    recipe = Recipe(threads=1, physics_threads=1)
    recipe = recipe.with_iterations(recipe.stages[0].iterations)
    if without is not None:
        reward = replace(recipe.env.reward, **{without: 0.0})
        recipe = replace(recipe, env=replace(recipe.env, reward=reward))
    name = "ours" if without is None else f"no-{without}"
    return Default(name=name, group="ours", label=without or "whole", recipe=recipe)


def jobs_of(settings: Iterable[Default], names: Iterable[str], seeds: Iterable[int]) -> list[Job]:
    """Every setting with every gait and seed."""
    names, seeds = tuple(names), tuple(seeds)
    return [
        Job(setting=one, gait=name, seed=seed, recipe=one.recipe)
        for one in settings
        for name in names
        for seed in seeds
    ]


def judged(
    jobs: list[Job], processes: int, config: EvaluationConfig = JUDGED
) -> dict[str, dict[str, Any]]:
    """Trains what is missing; figures of each job's policy by the name of the job."""
    with progress(f"{len(jobs)} runs") as report:
        train_all(jobs, RUNS, processes, report)
    return {job.name: evaluate(policy.load(RUNS / job.name / POLICY), config)[0] for job in jobs}


def write_seeds(processes: int) -> Path:
    """The table of fresh seeds."""
    jobs = jobs_of([setting()], FIRST_GAITS, FRESH_SEEDS)
    figures = judged(jobs, processes)
    unaided = judged(jobs, processes, replace(JUDGED, open_loop=True))
    head = ("gait", "seed", "verdict", "survival", "speed [m/s]", "open loop [m/s]", "cycles [Hz]")
    head += ("pattern",)
    head += ("touchdowns a cycle", "least consistency", "least clearance [cm]", "CoT", "misses")
    rows: list[tuple[str, ...]] = []
    for job in jobs:
        one = figures[job.name]
        verdict = one["verdict"]
        rows.append(
            (
                job.gait,
                str(job.seed),
                f"{verdict['gait']}, {'clean' if verdict['clean'] else 'not clean'}",
                f"{one['survival']:.2f}",
                f"{one['speed_mean']:.2f}",
                f"{unaided[job.name]['speed_mean']:.2f}",
                f"{one['cycles_per_s']:.2f}",
                f"{one['pattern_fraction']:.2f}",
                " ".join(f"{x:.2f}" for x in one["touchdowns_per_cycle"]),
                f"{min(one['phase_consistency']):.2f}",
                f"{100 * min(one['clearance']):.0f}",
                f"{one['cost_of_transport']:.2f}",
                "; ".join(f"{miss['figure']} {miss['value']:.3g}" for miss in verdict["misses"]),
            )
        )
    clean = [
        f"{gait} {sum(figures[job.name]['verdict']['clean'] for job in jobs if job.gait == gait)}"
        f" of {len(FRESH_SEEDS)}"
        for gait in FIRST_GAITS
    ]
    words = f"Clean: {', '.join(clean)}.\n"
    return _write("seeds.md", SEEDS_HEAD, words, head, rows)


def write_additions(processes: int) -> Path:
    """The table of additions taken away."""
    settings = [setting(), *(setting(name) for name in (*ADDITIONS, *BONUS_SHARES))]
    jobs = jobs_of(settings, (ABLATED,), ABLATION_SEEDS)
    figures = judged(jobs, processes)
    head = ("without", "clean", "survival", "speed [m/s]", "pattern", "worst touchdowns")
    head += ("least clearance [cm]", "slip [m/s]", "CoT")
    rows: list[tuple[str, ...]] = []
    for one in settings:
        of = [figures[job.name] for job in jobs if job.setting == one]
        rows.append(
            (
                "nothing" if one.label == "whole" else f"`{one.label}`",
                f"{sum(f['verdict']['clean'] for f in of)} of {len(of)}",
                _mean(of, "survival", float),
                _mean(of, "speed_mean", float),
                _mean(of, "pattern_fraction", float),
                _mean(of, "touchdowns_per_cycle", lambda x: max(x, key=lambda y: abs(y - 1))),
                _mean(of, "clearance", lambda x: 100 * min(x)),
                _mean(of, "slip", float),
                _mean(of, "cost_of_transport", float),
            )
        )
    return _write("additions.md", ADDITIONS_HEAD, "", head, rows)


def _mean(figures: list[dict[str, Any]], name: str, of: Callable[[Any], float]) -> str:
    return f"{fmean(of(one[name]) for one in figures):.2f}"


def _write(
    name: str, head: str, words: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]
) -> Path:
    recipe = setting().recipe
    steps = recipe.iterations * recipe.robots * recipe.steps / 1e6
    lines = [columns, ("---",) * len(columns), *rows]
    table = "\n".join(f"| {' | '.join(line)} |" for line in lines)
    path = RESULTS / name
    text = head.format(iterations=recipe.iterations, steps=steps)
    path.write_text(f"{text}\n{words}\n{table}\n" if words else f"{text}\n{table}\n")
    return path


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("seeds", "additions"))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    write = write_seeds if options.what == "seeds" else write_additions
    print(f"written: {write(options.jobs)}")
