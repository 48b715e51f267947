"""Identifies a gait graph from a map: which gait at which speed, with thresholds and intervals."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.studies.best import Objective, Ranking, Stretch, rankings, stretches
from gaitshift.lab.studies.gait_map import OWN_BODY
from gaitshift.table import Row

DRAWS = 4000
"""Maps that are drawn by the intervals of the figures, for the interval of a threshold."""

HYSTERESIS = 0.05
"""Least distance of the thresholds up and down from the crossing [m/s]; ours: a command that a
person gives by hand is no steadier."""

COUNTS = 50
"""β of the edges [counts]: the command has been beyond the threshold for half a second; ours."""

NORMAL = 1.96
"""Half the width of an interval of 95 % over its standard deviation."""


@dataclass(frozen=True, kw_only=True)
class Crossing:
    """Two neighbouring gaits, and the speed at which the faster becomes the better."""

    slower: str
    """Policy below the crossing."""
    faster: str
    """Policy above it."""
    speed: float
    """The crossing [m/s]."""
    low: float
    """Lower end of its interval (95 %) [m/s]."""
    high: float
    """Upper end of its interval [m/s]."""
    hysteresis: float
    """Distance of the two thresholds from the crossing [m/s]: half the interval, or the least."""

    @property
    def up(self) -> float:
        """Above this speed the faster gait is taken [m/s]."""
        return self.speed + self.hysteresis

    @property
    def down(self) -> float:
        """Below this speed the slower gait is taken [m/s]."""
        return self.speed - self.hysteresis


@dataclass(frozen=True, kw_only=True)
class Plan:
    """The gaits from slow to fast, and where they change."""

    gaits: Mapping[str, str]
    """Gait of each policy that is used, from slow to fast."""
    crossings: tuple[Crossing, ...]
    """Between neighbours."""
    left_out: tuple[str, ...]
    """Policies that are nowhere better than all others by more than the interval."""
    nobody: tuple[Stretch, ...]
    """Speeds at which no policy meets the objective."""


def plan(
    rows: Sequence[Row],
    objective: Objective,
    *,
    ground: str,
    hysteresis: float = HYSTERESIS,
    seed: int = 0,
) -> Plan:
    """The gaits that are the best at some speed on a ground, and the speeds where they change.

    A policy takes part only if at some speed it is better than the next by more than the interval
    of that difference. Between two speeds of the map figures are taken as straight lines.

    Raises:
        GaitshiftError: the map has no rows on this ground, or fewer than two policies take part, or
            two policies of one gait do.
    """
    here = [row for row in rows if row["ground"] == ground and row["body"] == OWN_BODY]
    if not here:
        known = ", ".join(dict.fromkeys(row["ground"] for row in rows)) or "none"
        raise GaitshiftError(f"ground must be one of the map, {known}, got '{ground}'")
    if not any(one.rows for one in rankings(here, objective)):
        raise GaitshiftError(_nobody(here, objective))
    kept, left_out = _significant(here, objective)
    ranked = rankings(kept, objective)
    best = [one for one in stretches(ranked) if one.policy is not None]
    nobody = tuple(one for one in stretches(ranked) if one.policy is None)
    order = list(dict.fromkeys(str(one.policy) for one in best))
    if len(order) < 2:
        raise GaitshiftError(
            f"a plan needs two gaits that are each the best somewhere; on {ground} {order[0]} is "
            f"at all speeds of the map"
        )
    gait_of = {row["policy"]: row["gait"] for row in kept}
    gaits = {name: str(gait_of[name]) for name in order}
    if len(set(gaits.values())) < len(gaits):
        raise GaitshiftError(
            f"the best policies must be of different gaits, got {', '.join(order)}"
        )
    if len(best) > len(order):
        spans = ", ".join(f"{one.policy} {one.first:g} to {one.last:g}" for one in best)
        raise GaitshiftError(
            f"each gait must be the best in one range of speeds, got {spans} m/s; measure more "
            "robots"
        )
    rng = np.random.default_rng(seed)
    crossings = tuple(
        _crossing(slow, fast, ranked, objective, hysteresis, rng) for slow, fast in pairwise(best)
    )
    return Plan(gaits=gaits, crossings=crossings, left_out=left_out, nobody=nobody)


def _nobody(rows: Sequence[Row], objective: Objective) -> str:
    """Who comes nearest at the fastest speed where nobody meets the objective."""
    fastest = max(row["speed"] for row in rows)
    nearest = max((row for row in rows if row["speed"] == fastest), key=lambda row: row["survived"])
    return (
        f"no gait meets survival {objective.survival:g} and its speed anywhere; nearest at "
        f"{fastest:g} m/s is {nearest['policy']}: {objective.misses(nearest)}"
    )


def _significant(rows: Sequence[Row], objective: Objective) -> tuple[list[Row], tuple[str, ...]]:
    """The rows of policies that are somewhere better by more than the interval, and the others."""
    kept, left_out = list(rows), list[str]()
    while True:
        ranked = rankings(kept, objective)
        clear = {one.best for one in ranked if _is_clear(one, objective)}
        doubtful = [
            str(one.best) for one in ranked if one.best is not None and one.best not in clear
        ]
        if not doubtful:
            return kept, tuple(left_out)
        left_out.append(doubtful[0])
        kept = [row for row in kept if row["policy"] != doubtful[0]]


def _is_clear(one: Ranking, objective: Objective) -> bool:
    margin = one.margin(objective)
    return one.best is not None and (margin is None or margin[0] > margin[1])


def _crossing(
    slow: Stretch,
    fast: Stretch,
    ranked: Sequence[Ranking],
    objective: Objective,
    hysteresis: float,
    rng: np.random.Generator,
) -> Crossing:
    """Where the losses of two neighbours cross.

    In the middle between the last speed of one and the first of the other, where not both of them
    can be the best at both of these speeds.
    """
    names = (str(slow.policy), str(fast.policy))
    of = [{row["policy"]: row for row in one.rows} for one in ranked]
    both = [
        (one.speed, *(here[name] for name in names))
        for one, here in zip(ranked, of, strict=True)
        if all(name in here for name in names)
    ]
    speeds = np.array([speed for speed, *_ in both])
    if not {slow.last, fast.first} <= set(speeds.tolist()):
        at, low, high = (slow.last + fast.first) / 2, slow.last, fast.first
    else:
        apart = np.array([objective.loss(a) - objective.loss(b) for _, a, b in both])
        sd = np.array([np.hypot(objective.half(a), objective.half(b)) for _, a, b in both])
        at = float(crossing_of(speeds, apart[None], (slow.last + fast.first) / 2)[0])
        drawn = apart + sd / NORMAL * rng.standard_normal((DRAWS, len(apart)))
        low, high = np.quantile(crossing_of(speeds, drawn, at), (0.025, 0.975)).tolist()
    return Crossing(
        slower=names[0],
        faster=names[1],
        speed=at,
        low=low,
        high=high,
        hysteresis=max(hysteresis, (high - low) / 2),
    )


def crossing_of(
    speeds: Float[np.ndarray, " K"], apart: Float[np.ndarray, "D K"], near: float
) -> Float[np.ndarray, " D"]:
    """Where straight lines through `apart` rise through 0, at the place nearest to `near` [m/s].

    The greatest speed where all are below 0, the least where none rises through it.
    """
    before, after = apart[:, :-1], apart[:, 1:]
    rises = (before < 0) & (after >= 0)
    share = np.where(rises, -before / np.where(rises, after - before, 1.0), 0.0)
    at = speeds[:-1] + share * np.diff(speeds)
    off = np.where(rises, np.abs(at - near), np.inf)
    nearest = at[np.arange(len(at)), off.argmin(axis=1)]
    least, greatest = float(speeds[0]), float(speeds[-1])
    ends = np.where(apart[:, -1] < 0, greatest, least)
    return np.where(rises.any(axis=1), nearest, ends)


def graph_text(found: Plan, objective: Objective, *, ground: str, source: str) -> str:
    """The gait graph of a plan as a TOML file, for `demo --graph`."""
    gaits = list(found.gaits.values())
    lines = [
        f"# {' and '.join(gaits)} by the commanded speed: the best by {objective.name} on",
        f"# {ground}, with survival of {objective.survival:g} or more. Made by",
        f"#   {source}",
        "",
        f'start = "{gaits[0]}"',
        "",
        "[statistic.speed]",
        'kind = "speed"',
    ]
    for one in found.crossings:
        slower, faster = found.gaits[one.slower], found.gaits[one.faster]
        lines += [
            "",
            f"# They cross at {one.speed:.3f} m/s, 95 %: {one.low:.3f} to {one.high:.3f}.",
            *_edge(slower, faster, "above", one.up, priority=0),
            "",
            *_edge(faster, slower, "below", one.down, priority=1),
        ]
    return "\n".join(lines) + "\n"


def _edge(source: str, target: str, when: str, alpha: float, *, priority: int) -> list[str]:
    return [
        "[[edge]]",
        f'from = "{source}"',
        f'to = "{target}"',
        'statistic = "speed"',
        f'when = "{when}"',
        f"alpha = {alpha:.3f}  # [m/s]",
        f"beta = {COUNTS}  # [counts]",
        *([f"priority = {priority}"] if priority else []),
    ]
