"""Confidence intervals, and areas under ROC curves."""

import numpy as np
from jaxtyping import Float
from scipy import stats

CONFIDENCE = 0.95
"""Of all intervals."""


def wilson(
    successes: Float[np.ndarray, "*shape"], trials: Float[np.ndarray, "*shape"]
) -> tuple[Float[np.ndarray, "*shape"], Float[np.ndarray, "*shape"]]:
    """Interval of a probability (Wilson 1927); 0 to 1 without trials."""
    z = float(stats.norm.ppf(0.5 + CONFIDENCE / 2))
    n = np.maximum(trials, 1e-12)
    share = successes / n
    middle = (share + z * z / (2 * n)) / (1 + z * z / n)
    half = z / (1 + z * z / n) * np.sqrt(share * (1 - share) / n + z * z / (4 * n * n))
    none = trials <= 0
    return (
        np.where(none, 0.0, np.clip(middle - half, 0.0, 1.0)),
        np.where(none, 1.0, np.clip(middle + half, 0.0, 1.0)),
    )


def poisson(
    events: Float[np.ndarray, "*shape"], exposure: Float[np.ndarray, "*shape"]
) -> tuple[Float[np.ndarray, "*shape"], Float[np.ndarray, "*shape"]]:
    """Exact interval of a rate per unit of exposure (Garwood 1936)."""
    tail = (1 - CONFIDENCE) / 2
    low = np.where(events > 0, stats.chi2.ppf(tail, 2 * np.maximum(events, 1)) / 2, 0.0)
    high = stats.chi2.ppf(1 - tail, 2 * (events + 1)) / 2
    safe = np.maximum(exposure, 1e-12)
    return low / safe, high / safe


def auc(
    rough: Float[np.ndarray, "P ..."], smooth: Float[np.ndarray, "Q ..."]
) -> Float[np.ndarray, "..."]:
    """Probability that a score of rough ground exceeds one of smooth ground; a tie counts half.

    The area under the ROC curve, by ranks (Mann and Whitney 1947), along axis 0.
    """
    ranks = stats.rankdata(np.concatenate([rough, smooth]), axis=0)
    p, q = len(rough), len(smooth)
    return (ranks[:p].sum(axis=0) - p * (p + 1) / 2) / (p * q)


def auc_interval(area: float, positives: int, negatives: int) -> tuple[float, float]:
    """Interval of an area under the ROC curve: Wilson's, with the smaller number of trials.

    It is conservative, and has a width above 0 where the area is 1.
    """
    trials = np.array([float(min(positives, negatives))])
    low, high = wilson(area * trials, trials)
    return float(low[0]), float(high[0])
