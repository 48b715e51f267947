"""How a training came out, as a line of a table, and what several seeds of it amount to."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import floor
from typing import Any

from gaitshift.errors import GaitshiftError
from gaitshift.table import Columns, Row


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One training: of one gait, by one learner, from one seed."""

    gait: str
    """Name of the gait."""
    learner: str
    """`gaitshift` or `stable-baselines3`."""
    seed: int
    """Seed of networks, exploration and robots."""
    reached: bool
    """Whether a check was passed; else the training was given up at its limit."""
    seconds: float
    """Wall time of the training up to the last check, that of the checks left out [s]."""
    steps: int
    """Control steps of all robots up to there."""
    survival: float
    """Figures of the last check: share of the robots that did not fall,"""
    speed: float | None
    """mean forward speed [m/s],"""
    pattern_fraction: float | None
    """share of the steps that show a stance of the machine; None of both where all fell at once."""
    recipe: str
    """Fingerprint of what was trained and how it was checked (`time_to_gait.fingerprint`)."""


def middle(outcomes: Sequence[Outcome]) -> Outcome:
    """The median training by wall time, the later of two; one that was given up counts as last."""
    ranked = sorted(outcomes, key=lambda outcome: (not outcome.reached, outcome.seconds))
    return ranked[len(ranked) // 2]


def ratio(ours: Outcome, baseline: Outcome) -> float | None:
    """How many times as long the baseline took; a lower bound where it was given up.

    None where ours was given up: then nothing can be said.
    """
    return baseline.seconds / ours.seconds if ours.reached else None


def ratio_text(times: float, *, is_lower_bound: bool) -> str:
    """A ratio in two figures or more, rounded down: so a lower bound stays one."""
    text = f"{floor(times)}" if times >= 10 else f"{floor(10 * times) / 10:.1f}"
    return f"> {text}" if is_lower_bound else text


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """By gait: each learner's median and seeds, and the ratio where the first's is known."""
    return {
        gait: _of_gait([outcome for outcome in outcomes if outcome.gait == gait])
        for gait in dict.fromkeys(outcome.gait for outcome in outcomes)
    }


def _of_gait(outcomes: list[Outcome]) -> dict[str, Any]:
    rows: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        rows.setdefault(outcome.learner, []).append(outcome)
    medians = {learner: middle(row) for learner, row in rows.items()}
    told = {
        learner: {
            "reached": median.reached,
            "seconds": median.seconds,
            "steps": median.steps,
            "seeds": [asdict(outcome) for outcome in rows[learner]],
        }
        for learner, median in medians.items()
    }
    if len(medians) < 2:
        return {"learners": told, "ratio": None, "ratio_is_lower_bound": False}
    ours, baseline = medians.values()
    return {
        "learners": told,
        "ratio": ratio(ours, baseline),
        "ratio_is_lower_bound": not baseline.reached,
    }


def _truth(text: str) -> bool:
    if text not in ("True", "False"):
        raise ValueError(f"must be True or False, got '{text}'")
    return text == "True"


COLUMNS: Columns = {
    "gait": str,
    "learner": str,
    "seed": int,
    "reached": _truth,
    "seconds": float,
    "steps": int,
    "survival": float,
    "speed": float,
    "pattern_fraction": float,
    "recipe": str,
}

_MAY_BE_EMPTY = ("speed", "pattern_fraction")


def row_of(outcome: Outcome) -> Row:
    """The line of a table that an outcome is; `outcome_of` makes it one again."""
    row = asdict(outcome)
    return {name: round(x, 3) if isinstance(x, float) else x for name, x in row.items()}


def outcome_of(row: Row) -> Outcome:
    """The outcome that a line of a table is; figures that stand empty there are None.

    Raises:
        GaitshiftError: another cell is empty.
    """
    empty = [name for name, value in row.items() if value == ""]
    for name in empty:
        if name not in _MAY_BE_EMPTY:
            raise GaitshiftError(f"column '{name}' must not be empty")
    values: Row = {**row, **dict.fromkeys(empty)}
    return Outcome(**values)
