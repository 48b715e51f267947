"""Trains policies from several seeds and writes the results as pages of docs/results.

Usage: python tools/training_evidence.py seeds|additions|shifts [--jobs N] [--seeds N]

`seeds` trains trot, pace and bound on flat ground with five fresh seeds each. `additions` trains
trot without each of the reward's additions, three seeds each. Each of these runs takes about six
minutes on one core. `shifts` trains bound by the whole recipe, two seeds with mixed starts and two
without, a quarter of an hour each. `--seeds` changes the number of seeds. If it is interrupted, the
same command resumes (runs/evidence).
"""

import argparse
import os
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean
from typing import Any

import numpy as np

from gaitshift.cli.output import progress
from gaitshift.control import policy
from gaitshift.gait import RewardMachine, gaits
from gaitshift.lab.evaluation import EvaluationConfig, evaluate
from gaitshift.lab.gait_analysis import FIRST_GAITS
from gaitshift.lab.identification.statistics import wilson
from gaitshift.lab.reproduction.plan import Job, Setting
from gaitshift.lab.reproduction.training import train_all
from gaitshift.lab.studies.transitions import Pair, run_pair
from gaitshift.learn.presets import three_stage
from gaitshift.learn.run_folder import POLICY
from gaitshift.sim.reward import ADDITIONS, BONUS_SHARES
from gaitshift.table import markdown

RUNS = Path("runs/evidence")
RESULTS = Path(__file__).parent.parent / "docs" / "results"
ABLATED = "trot"
ABLATED_ITERATIONS = 350
"""Enough for a clean trot; the whole flat stage is for the bound."""
JUDGED = EvaluationConfig(episodes=64, seconds=12.0)

SEEDS_HEAD = """# Is the flat stage clean from fresh seeds?

With {seeds} fresh seeds per gait, these policies are clean: {clean}.

Each policy is trained by the flat stage of the recipe `three-stage` alone ({iterations} iterations,
{steps:.1f} million control steps, about six minutes on one core), for seeds 1 to {seeds}.
It is judged on flat ground, with 64 robots for 12 s, by the limits of `gaitshift evaluate`. The
speed loop of `evaluate` is on; the column *open loop* gives the mean speed without it.
This page is made by `python tools/training_evidence.py seeds --seeds {seeds}`.
"""
ADDITIONS_HEAD = """# What does each addition to Table I contribute?

When one addition is left out, the trot is never clean without {never}; clean on some seeds only
without {some}; and always clean without {always}.

A trot is trained by the first {iterations} iterations of the recipe `three-stage`, on flat ground:
once with all additions, and once without each of the seven terms that the reward adds to the
paper's Table I and each of the two factors of the bonus (`gaitshift.sim.reward.ADDITIONS`,
`BONUS_SHARES`). The numbers are means over seeds 1 to {seeds}. Each policy is judged on flat
ground, with 64 robots for 12 s. *Clean* counts the policies that keep all limits of `gaitshift
evaluate`. *Worst touchdowns* are those of the foot that is furthest from one touchdown per cycle.
This page is made by `python tools/training_evidence.py additions --seeds {seeds}`.
"""
SHIFTED = "bound"
"""The gait that shifts into fail most often."""
MIXED_STARTS = 0.5
SWITCHES = 1024
ROUGH = EvaluationConfig(episodes=64, seconds=20.0)
SHIFTS_HEAD = """# Does training for shifts help?

On noise of 0.10 m {mixed} shifts into a bound fail after training with mixed starts, and {plain}
without.

The paper exchanges gaits in an instant and does not train for it. Here a bound is trained by the
recipe `three-stage`, and by the same recipe with mixed starts: on the rough stage the share
{share:g} of the episodes begins with the legs of different robots (`Stage.mixed_starts`), as
after a shift. Then {switches} robots shift into this bound at random phases of a trot, and as
many from a pace, on noise of 0.10 m, as in `gaitshift transitions`. Touchdowns (of the foot that
is furthest from one per cycle) and cost of transport are those of 64 robots for 12 s on flat
ground. The last three columns are the survival of 64 robots for 20 s on rough ground.
This page is made by `python tools/training_evidence.py shifts --seeds {seeds}`.
"""


@dataclass(frozen=True, kw_only=True)
class Default(Setting):
    """The recipe `three-stage`, or one like it, with the machines as they are."""

    def machine(self, gait: str) -> RewardMachine:
        """The gait's own."""
        return gaits.load(gait)


def setting(iterations: int, without: str | None = None, name: str = "default") -> Default:
    """The first iterations of the recipe on one core, without one of the additions."""
    recipe = replace(three_stage(), threads=1, physics_threads=1)
    recipe = recipe.with_iterations(iterations)
    if without is not None:
        reward = replace(recipe.env.reward, **{without: 0.0})
        recipe = replace(recipe, env=replace(recipe.env, reward=reward))
        name = f"no-{without}"
    return Default(name=name, group="default", label=without or "whole", recipe=recipe)


def jobs_of(settings: Iterable[Default], names: Iterable[str], seeds: Iterable[int]) -> list[Job]:
    """Every setting with every gait and seed."""
    names, seeds = tuple(names), tuple(seeds)
    return [
        Job(setting=one, gait=name, seed=seed, recipe=one.recipe)
        for seed in seeds
        for name in names
        for one in settings
    ]


def judged(
    jobs: list[Job], processes: int, config: EvaluationConfig = JUDGED
) -> dict[str, dict[str, Any]]:
    """Trains what is missing; figures of each job's policy by the name of the job."""
    with progress(f"{len(jobs)} runs") as report:
        train_all(jobs, RUNS, processes, report)
    return {job.name: evaluate(policy.load(RUNS / job.name / POLICY), config)[0] for job in jobs}


def write_seeds(processes: int, seeds: int) -> Path:
    """The table of fresh seeds, from 1 on."""
    flat = three_stage().stages[0].iterations
    jobs = jobs_of([setting(flat)], FIRST_GAITS, range(1, seeds + 1))
    figures = judged(jobs, processes)
    unaided = judged(jobs, processes, replace(JUDGED, open_loop=True))
    head = ("gait", "seed", "verdict", "survival", "speed [m/s]", "open loop [m/s]", "cycles [Hz]")
    head += ("pattern",)
    head += ("touchdowns a cycle", "least consistency", "least clearance [cm]", "CoT", "misses")
    rows: list[tuple[str, ...]] = []
    for job in sorted(jobs, key=lambda job: FIRST_GAITS.index(job.gait)):
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
        f" of {seeds}"
        for gait in FIRST_GAITS
    ]
    steps = flat * three_stage().robots * three_stage().steps / 1e6
    text = SEEDS_HEAD.format(clean=", ".join(clean), iterations=flat, steps=steps, seeds=seeds)
    return _write("seeds.md", text, head, rows)


def write_additions(processes: int, seeds: int) -> Path:
    """The table of additions taken away; seed by seed, so that fewer are a whole table too."""
    settings = [
        setting(ABLATED_ITERATIONS, name="whole"),
        *(setting(ABLATED_ITERATIONS, without) for without in (*ADDITIONS, *BONUS_SHARES)),
    ]
    jobs = jobs_of(settings, (ABLATED,), range(1, seeds + 1))
    figures = judged(jobs, processes)
    head = ("without", "clean", "survival", "speed [m/s]", "pattern", "worst touchdowns")
    head += ("least clearance [cm]", "slip [m/s]", "CoT")
    rows: list[tuple[str, ...]] = []
    without: dict[str, list[str]] = {"never": [], "some": [], "always": []}
    for one in settings:
        of = [figures[job.name] for job in jobs if job.setting == one]
        clean = sum(f["verdict"]["clean"] for f in of)
        if one.label != "whole":
            often = "never" if clean == 0 else "always" if clean == len(of) else "some"
            without[often].append(f"`{one.label}`")
        rows.append(
            (
                "nothing" if one.label == "whole" else f"`{one.label}`",
                f"{clean} of {len(of)}",
                _mean(of, "survival", float),
                _mean(of, "speed_mean", float),
                _mean(of, "pattern_fraction", float),
                _mean(of, "touchdowns_per_cycle", lambda x: max(x, key=lambda y: abs(y - 1))),
                _mean(of, "clearance", lambda x: 100 * min(x)),
                _mean(of, "slip", float),
                _mean(of, "cost_of_transport", float),
            )
        )
    named = {often: ", ".join(terms) or "(none)" for often, terms in without.items()}
    text = ADDITIONS_HEAD.format(iterations=ABLATED_ITERATIONS, seeds=seeds, **named)
    return _write("additions.md", text, head, rows)


def write_shifts(processes: int, seeds: int) -> Path:
    """The table of shifts into policies that were trained for them, and into others."""
    plain = replace(three_stage(), threads=1, physics_threads=1)
    flat, *rough = plain.stages
    starts = (replace(stage, mixed_starts=MIXED_STARTS) for stage in rough)
    mixed = replace(plain, stages=(flat, *starts))
    settings = (
        Default(name="plain", group="shifts", label="default", recipe=plain),
        Default(name="mixed", group="shifts", label="mixed starts", recipe=mixed),
    )
    jobs = jobs_of(settings, (SHIFTED,), range(seeds))
    figures = judged(jobs, processes)
    old = [gait for gait in FIRST_GAITS if gait != SHIFTED]
    grounds = ("perlin:0.15", "stairs:0.05", "step:0.10")
    head = ("training", "seed", *(f"{gait} → {SHIFTED}" for gait in old), "fell", "interval")
    head += ("touchdowns", "clean", "CoT", *grounds)
    rows: list[tuple[str, ...]] = []
    failed: dict[str, str] = {}
    for setting in settings:
        sums = np.zeros(len(old) + 1, dtype=int)
        for job in (job for job in jobs if job.setting == setting):
            trained = policy.load(RUNS / job.name / POLICY)
            outcomes = [
                run_pair(
                    {gait: policy.load(gait), SHIFTED: trained},
                    Pair(gait, SHIFTED),
                    ground="perlin:0.10",
                    switches=SWITCHES,
                    seed=0,
                )
                for gait in old
            ]
            counts = [int(o.success.sum()) for o in outcomes]
            counts.append(sum(int(o.fell.sum()) for o in outcomes))
            sums += counts
            on_flat = figures[job.name]
            rough = [evaluate(trained, replace(ROUGH, terrain=g))[0]["survival"] for g in grounds]
            rows.append(
                (
                    setting.label,
                    str(job.seed),
                    *_shift_cells(counts, SWITCHES),
                    f"{max(on_flat['touchdowns_per_cycle'], key=lambda x: abs(x - 1)):.2f}",
                    "yes" if on_flat["verdict"]["clean"] else "no",
                    f"{on_flat['cost_of_transport']:.2f}",
                    *(f"{share:.3f}" for share in rough),
                )
            )
        cells = _shift_cells(sums.tolist(), SWITCHES * seeds)
        rows.append((setting.label, "all", *cells, *[""] * (3 + len(grounds))))
        shifts = SWITCHES * seeds * len(old)
        failed[setting.name] = f"{shifts - int(sums[:-1].sum())} of {shifts}"
    text = SHIFTS_HEAD.format(share=MIXED_STARTS, switches=SWITCHES, seeds=seeds, **failed)
    return _write("shifting/trained-on-shifts.md", text, head, rows)


def _shift_cells(counts: list[int], switches: int) -> tuple[str, ...]:
    """Successes of each pair, falls, and the interval of the share of successes."""
    *came_off, fell = counts
    low, high = wilson(np.array(float(sum(came_off))), np.array(float(switches * len(came_off))))
    return (
        *(f"{count} of {switches}" for count in came_off),
        str(fell),
        f"{float(low):.4f} to {float(high):.4f}",
    )


def _mean(figures: list[dict[str, Any]], name: str, of: Callable[[Any], float]) -> str:
    return f"{fmean(of(one[name]) for one in figures):.2f}"


def _write(name: str, text: str, columns: tuple[str, ...], rows: list[tuple[str, ...]]) -> Path:
    path = RESULTS / name
    path.write_text(f"{text}\n{markdown(columns, rows)}\n", encoding="utf-8")
    return path


WRITERS = {
    "seeds": (write_seeds, 5),
    "additions": (write_additions, 3),
    "shifts": (write_shifts, 2),
}
"""What writes each page, and from how many seeds."""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=tuple(WRITERS))
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--seeds", type=int)
    options = parser.parse_args()
    write, usual = WRITERS[options.what]
    print(f"written: {write(options.jobs, options.seeds or usual)}")
