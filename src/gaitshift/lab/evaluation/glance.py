"""A short look at a policy: its verdict in one line, as a training writes it down on its way."""

from typing import Any

from gaitshift.control.policy import Policy
from gaitshift.lab.evaluation.evaluate import EvaluationConfig, evaluate

ROBOTS, SECONDS = 16, 5.0
"""Robots and length [s]; ours: seven to twelve strides of each after the 2 s left out."""

FIGURES = ("survival", "speed_mean", "pattern_fraction", "cycles_per_s", "cost_of_transport")


def glance(policy: Policy) -> dict[str, Any]:
    """The verdict on a policy on flat ground, at its own speed and stride frequency.

    `gait` is the name by the contacts alone, `clean` whether it is the right one with all limits
    kept, `misses` the figures that miss theirs with the worst foot, parted by "; ". The others are
    as `gait_analysis.measure` defines them.
    """
    figures, _ = evaluate(policy, EvaluationConfig(episodes=ROBOTS, seconds=SECONDS))
    verdict = figures["verdict"]
    return {
        "gait": verdict["gait"],
        "clean": verdict["clean"],
        **{name: _rounded(figures[name]) for name in FIGURES},
        "misses": "; ".join(_spell(miss) for miss in verdict["misses"]),
    }


def _spell(miss: dict[str, Any]) -> str:
    parts = (miss["figure"], miss.get("foot"), _rounded(miss["value"]))
    return " ".join(str(part) for part in parts if part is not None)


def _rounded(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.4g}")
