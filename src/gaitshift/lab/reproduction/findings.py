"""The paper's statements, the measured results, and whether they agree."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from gaitshift.lab.reproduction.plan import (
    ABLATED,
    ABLATIONS,
    AS_IN_THE_PAPER,
    GAITS,
    LEARNED_BY,
    PLATEAU,
    START,
    ZERO_CROSSING,
)
from gaitshift.lab.reproduction.results import Results, Seeds

Verdict = Literal["holds", "holds in part", "does not hold"]

START_WITHIN, PLATEAU_WITHIN, CROSSING_WITHIN = 10.0, 5.0, 2.0
"""Tolerances of the paper's curves: two in reward per step, and a factor on iterations."""

MOST_CHANGES = 12.0
"""Changes of state per second above which feet vibrate and do not walk; ours: a stride of 6 Hz."""

LATER = 1.1
"""A run learns later if it walks from an iteration larger by this factor."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """One statement of the paper, compared with the runs."""

    name: str
    """Its topic."""
    paper: str
    """The statement in our words, and its place in the paper."""
    measured: str
    """Result of the runs."""
    verdict: Verdict
    """Whether the statement holds."""


def findings(results: Results) -> list[Finding]:
    """A finding for every statement that the finished runs can test."""
    gaits = dict(results.gaits())
    found: list[Finding] = []
    if len(gaits) == len(GAITS):
        found += [_all_come_out(gaits), _learned_early(gaits), _order(gaits), _curves(gaits)]
    reference = results.reference
    if reference is not None:
        ablations = dict(results.ablations())
        for group, (paper, deciding, judge) in _COMPARISONS.items():
            settings = [s for s in ABLATIONS if s.group == group and s.name in ablations]
            if deciding not in ablations:
                continue
            others = [ablations[s.name] for s in settings]
            labels = [AS_IN_THE_PAPER[group], *(s.label for s in settings)]
            parts = [_describe(*pair) for pair in zip(labels, [reference, *others], strict=True)]
            found.append(
                Finding(
                    name=group,
                    paper=paper,
                    measured=f"{ABLATED.capitalize()}. {'. '.join(parts)}.",
                    verdict=judge(reference, ablations[deciding]),
                )
            )
    return found


def _all_come_out(gaits: dict[str, Seeds]) -> Finding:
    parts = [
        f"{gait} in {seeds.walking} of {len(seeds)} seeds ({_number(seeds.late('speed'), '.2f')}"
        f" m/s, reward {_number(seeds.late('reward'), '.1f')} per step)"
        for gait, seeds in gaits.items()
    ]
    walking = sum(seeds.walking for seeds in gaits.values())
    return Finding(
        name="three gaits",
        paper="All three gaits are learned in about 500 iterations (IV-B).",
        measured=f"Runs that walk at the end: {', '.join(parts)}.",
        verdict=_grade(walking, sum(map(len, gaits.values()))),
    )


def _learned_early(gaits: dict[str, Seeds]) -> Finding:
    starts = [curve.walks_at for seeds in gaits.values() for curve in seeds.curves]
    early = sum(start is not None and start <= LEARNED_BY for start in starts)
    verdict: Verdict = "does not hold" if early == 0 else "holds in part"
    return Finding(
        name="learned early",
        paper=f"Most runs need {LEARNED_BY} iterations for the right movements (IV-B).",
        measured=f"{early} of {len(starts)} runs walk by iteration {LEARNED_BY}.",
        verdict="holds" if early > len(starts) / 2 else verdict,
    )


def _order(gaits: dict[str, Seeds]) -> Finding:
    first = [_or_never(gaits[gait].walk_from) for gait in GAITS]
    parts = [f"{gait} {_iteration(gaits[gait].walk_from)}" for gait in GAITS]
    in_order = [a < b for a, b in pairwise(first)]
    return Finding(
        name="order",
        paper="Trot is learned first, then bound, then pace (IV-B).",
        measured=f"Iteration from which the median run walks: {', '.join(parts)}.",
        verdict=_grade(sum(in_order), len(in_order)),
    )


def _curves(gaits: dict[str, Seeds]) -> Finding:
    parts: list[str] = []
    near: list[bool] = []
    for gait, seeds in gaits.items():
        start = float(np.mean([c.reward[0] for c in seeds.curves if len(c)] or [np.nan]))
        late, crossing = seeds.late("reward"), seeds.cross_zero_at
        parts.append(
            f"{gait} starts at {start:.0f}, is positive from iteration {_iteration(crossing)}"
            f" (paper: {ZERO_CROSSING[gait]}) and ends at {_number(late, '.1f')}"
        )
        low, high = PLATEAU[0] - PLATEAU_WITHIN, PLATEAU[1] + PLATEAU_WITHIN
        ratio = _or_never(crossing) / ZERO_CROSSING[gait]
        near += [
            abs(start - START) <= START_WITHIN,
            late is not None and low <= late <= high,
            1 / CROSSING_WITHIN <= ratio <= CROSSING_WITHIN,
        ]
    text = "; ".join(parts)
    return Finding(
        name="reward curves",
        paper=(
            f"Rewards start near {START:g} per step, cross zero near iteration "
            f"{', '.join(f'{n} ({gait})' for gait, n in ZERO_CROSSING.items())}, and end at "
            f"{PLATEAU[0]:g} to {PLATEAU[1]:g} (read off Fig. 1)."
        ),
        measured=(
            f"{text[0].upper()}{text[1:]}. {sum(near)} of these {len(near)} values are close to "
            f"the paper's: within {START_WITHIN:g} per step at the start, {PLATEAU_WITHIN:g} at "
            f"the end, and a factor of {CROSSING_WITHIN:g} at the crossing."
        ),
        verdict=_grade(sum(near), len(near)),
    )


def _works_as_printed(reference: Seeds, other: Seeds) -> Verdict:
    return _grade(other.walking, len(other))


def _walks_without_lockout(reference: Seeds, other: Seeds) -> Verdict:
    changes = other.late("changes_per_s")
    walks = changes is not None and changes <= MOST_CHANGES
    return _grade(other.walking, len(other)) if walks else "does not hold"


def _is_needed(reference: Seeds, other: Seeds) -> Verdict:
    fewer = other.walking / len(other) < reference.walking / len(reference)
    later = _or_never(other.walk_from) > LATER * _or_never(reference.walk_from)
    return "holds" if fewer or later else "does not hold"


def _speeds_up(reference: Seeds, other: Seeds) -> Verdict:
    fewer = other.moving / len(other) < reference.moving / len(reference)
    later = _or_never(other.move_from) > LATER * _or_never(reference.move_from)
    return _grade(fewer + later, 2)


def _is_spared(reference: Seeds, other: Seeds) -> Verdict:
    if reference.walking < len(reference):
        return _grade(reference.walking, len(reference))
    quicker = _or_never(other.walk_from) > LATER * _or_never(reference.walk_from)
    return "holds" if quicker else "holds in part"


_COMPARISONS = {
    "bonus": (
        "At a change of state the total reward is multiplied by b = 200 (III-C).",
        "multiply",
        _works_as_printed,
    ),
    "lock-out": (
        "The order of contacts alone defines a gait: the paper names no least time between two "
        "changes (III-C).",
        "lockout-0",
        _walks_without_lockout,
    ),
    "observation": (
        "The policy observes the machine's state u and the steps δ since it changed, so that the "
        "reward is Markov over S × U (III-B, III-C).",
        "blind",
        _is_needed,
    ),
    "machine": (
        "Reward machines make learning much faster and keep robots from standing still (III-D, "
        "IV-B).",
        "no-bonus",
        _speeds_up,
    ),
    "penalties": (
        "The penalties need no growing factor λ: with full penalties from the start, learning is "
        "much faster (III-D).",
        "curriculum",
        _is_spared,
    ),
    "gains": ("Joint gains are Kp = 3 and Kd = 0.2 (IV-A).", "paper-gains", _works_as_printed),
}
"""For each group: the statement, the setting that tests it, and a function that compares the
reference with that setting."""


def _describe(label: str, seeds: Seeds) -> str:
    """Number of runs that walk, number as fast in any gait, and the median first iterations."""
    text = (
        f"**{label}** {seeds.walking} of {len(seeds)} walk "
        f"({_median(seeds.walk_from)}), {seeds.moving} reach that speed in any gait "
        f"({_median(seeds.move_from)}); at the end {_number(seeds.late('speed'), '.2f')} m/s, "
        f"{_number(seeds.late('changes_per_s'), '.1f')} state changes per second"
    )
    broken = sum(seeds.broken)
    return f"{text}; {broken} diverged" if broken else text


def _grade(good: int, of: int) -> Verdict:
    if good == of:
        return "holds"
    return "holds in part" if good else "does not hold"


def _or_never(iteration: float | None) -> float:
    return float("inf") if iteration is None else iteration


def _iteration(iteration: float | None) -> str:
    return "never" if iteration is None else f"{iteration:g}"


def _median(iteration: float | None) -> str:
    return "the median never" if iteration is None else f"median iteration {iteration:g}"


def _number(value: float | None, form: str) -> str:
    return "–" if value is None else format(value, form)
