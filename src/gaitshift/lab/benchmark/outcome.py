"""The outcome of a training as a row of a table, and summaries over several seeds."""

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
    """Whether a check was passed; else the training was stopped at its limit."""
    seconds: float
    """Wall time of the training up to the last check, without the checks [s]."""
    steps: int
    """Control steps of all robots up to the last check."""
    survival: float
    """Share of the robots that did not fall in the last check."""
    speed: float | None
    """Mean forward speed in the last check [m/s]; None where all robots fell in the warm-up."""
    pattern_fraction: float | None
    """Share of the steps of the last check with a stance of the machine; None as for `speed`."""
    recipe: str
    """Fingerprint of the training and its checks (`time_to_gait.fingerprint`)."""


def middle(outcomes: Sequence[Outcome]) -> Outcome:
    """The median training by wall time, of two the slower; a stopped training counts as slowest."""
    ranked = sorted(outcomes, key=lambda outcome: (not outcome.reached, outcome.seconds))
    return ranked[len(ranked) // 2]


def ratio(ours: Outcome, baseline: Outcome) -> float | None:
    """The baseline's wall time over gaitshift's; a lower bound where the baseline was stopped.

    None where gaitshift's training was stopped.
    """
    return baseline.seconds / ours.seconds if ours.reached else None


def ratio_text(times: float, *, is_lower_bound: bool) -> str:
    """A ratio with at least two digits, rounded down so that a lower bound stays valid."""
    text = f"{floor(times)}" if times >= 10 else f"{floor(10 * times) / 10:.1f}"
    return f"> {text}" if is_lower_bound else text


def summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    """By gait: each learner's median and seeds, and the ratio where gaitshift reached the gait."""
    return {
        gait: _of_gait([outcome for outcome in outcomes if outcome.gait == gait])
        for gait in dict.fromkeys(outcome.gait for outcome in outcomes)
    }


def _of_gait(outcomes: list[Outcome]) -> dict[str, Any]:
    rows: dict[str, list[Outcome]] = {}
    for outcome in outcomes:
        rows.setdefault(outcome.learner, []).append(outcome)
    medians = {learner: middle(row) for learner, row in rows.items()}
    learners = {
        learner: {
            "reached": median.reached,
            "seconds": median.seconds,
            "steps": median.steps,
            "seeds": [asdict(outcome) for outcome in rows[learner]],
        }
        for learner, median in medians.items()
    }
    if len(medians) < 2:
        return {"learners": learners, "ratio": None, "ratio_is_lower_bound": False}
    ours, baseline = medians.values()
    return {
        "learners": learners,
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
    """An outcome as a row of a table; `outcome_of` is the inverse."""
    row = asdict(outcome)
    return {name: round(x, 3) if isinstance(x, float) else x for name, x in row.items()}


def outcome_of(row: Row) -> Outcome:
    """The outcome in a row of a table; figures with empty cells are None.

    Raises:
        GaitshiftError: another cell is empty.
    """
    empty = [name for name, value in row.items() if value == ""]
    for name in empty:
        if name not in _MAY_BE_EMPTY:
            raise GaitshiftError(f"column '{name}' must not be empty")
    values: Row = {**row, **dict.fromkeys(empty)}
    return Outcome(**values)
