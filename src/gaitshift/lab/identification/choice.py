"""The choice of α, β and leak by a criterion on recordings."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float, Shaped

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.firings import ParameterGrid, Tally

HEADROOM = 1.25
"""The choice has no false shift even at a β smaller by this factor; ours: a setting without
headroom has false shifts on other recordings."""

ALPHA_HEADROOM = 1.05
"""… and at an α changed by this factor so that the rule fires more often: smaller where it counts
values above α, larger where it counts values below. The only headroom where β is 0; ours."""

MISS_COSTS = 20.0
"""A rough stretch without a shift counts as a delay of this many metres; ours."""


@dataclass(frozen=True, kw_only=True)
class Choice:
    """A point of the grid, and its figures on the recordings used for the choice."""

    alpha: float
    """α, in the statistic's unit."""
    beta: float
    """β [counts]."""
    leak: float
    """Decrease of k in each step [counts]."""
    cost_m: float = np.nan
    """The minimised cost: mean delay, misses included [m]; NaN where the numbers were given."""
    false_per_km: float = np.nan
    """False shifts per kilometre of smooth ground at this α and β; NaN where they were given."""
    is_free: bool | None = None
    """Whether no robot shifted on smooth ground, with headroom; false: the setting with the fewest
    false shifts. None where the numbers were given."""


def choose(
    tallies: Mapping[float, Mapping[str, Tally]],
    grid: ParameterGrid,
    when: Literal["above", "below"] = "above",
) -> Choice:
    """The setting with the earliest detection among those that never shift on smooth ground.

    Where there is none, it is the earliest among those with the fewest false shifts per kilometre.

    Args:
        tallies: by leak, then by the name of the recordings.
        grid: the α and β of the tallies.
        when: what the rule counts; "below" is for the way back, on which rough and smooth ground
            are exchanged.

    Raises:
        GaitshiftError: no robot reached rough ground, or none walked on smooth ground.
    """
    choices = [_best(leak, _together(by_name), grid, when) for leak, by_name in tallies.items()]
    return min(choices, key=lambda c: (not c.is_free, 0 if c.is_free else c.false_per_km, c.cost_m))


def _best(
    leak: float, tally: Tally, grid: ParameterGrid, when: Literal["above", "below"]
) -> Choice:
    back = when == "below"
    if not tally.came.any():
        ground = "rough ground that ends" if back else "rough ground"
        raise GaitshiftError(f"the recordings must contain {ground} to detect, got none")
    if not tally.km.any():
        ground = "rough" if back else "smooth"
        raise GaitshiftError(
            f"the recordings must contain {ground} ground to count false shifts on, got none"
        )
    cost = delay_with_misses(tally.came, tally.detected, tally.metres)
    free = _free(tally, grid, when)
    rate = tally.false_per_km
    allowed = free if free.any() else rate == np.nanmin(rate)
    a, b = np.unravel_index(np.where(allowed, cost, np.inf).argmin(), grid.shape)
    return Choice(
        alpha=float(grid.alphas[a]),
        beta=float(grid.betas[b]),
        leak=leak,
        cost_m=float(cost[a, b]),
        false_per_km=float(tally.false_per_km[a, b]),
        is_free=bool(free.any()),
    )


def _together(by_name: Mapping[str, Tally]) -> Tally:
    tallies = list(by_name.values())
    if not tallies:
        raise GaitshiftError("there must be recordings to choose the settings by, got none")
    whole = Tally(shape=tallies[0].shape)
    for tally in tallies:
        whole.join(tally)
    return whole


def delay_with_misses(
    came: Shaped[np.ndarray, "*of"],
    detected: Shaped[np.ndarray, "*of"],
    metres: Float[np.ndarray, "*of"],
) -> Float[np.ndarray, "*of"]:
    """Mean delay [m] of the robots that reached rough ground; a miss counts `MISS_COSTS`.

    Args:
        came: robots that reached rough ground; where there are none, the result is inf.
        detected: those that shifted there.
        metres: sum of their delays [m].
    """
    total = metres + MISS_COSTS * (came - detected)
    return np.where(came > 0, total / np.maximum(came, 1), np.inf)


def _free(tally: Tally, grid: ParameterGrid, when: Literal["above", "below"]) -> np.ndarray:
    """Settings without firings on smooth ground, also after both factors of headroom."""
    clean = tally.fired == 0
    if when == "above":
        alpha = np.searchsorted(grid.alphas, grid.alphas / ALPHA_HEADROOM, "right") - 1
    else:
        alpha = np.searchsorted(grid.alphas, grid.alphas * ALPHA_HEADROOM, "left")
    beta = np.searchsorted(grid.betas, grid.betas / HEADROOM, "right") - 1
    last = len(grid.alphas) - 1
    known = ((alpha >= 0) & (alpha <= last))[:, None] & (beta >= 0)
    return clean & known & clean[np.clip(alpha, 0, last)][:, np.maximum(beta, 0)]
