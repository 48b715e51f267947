"""First firings of a rule over a whole grid of α and β: detections, delays and false shifts."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.labelled_run import LabelledRun
from gaitshift.shift import Rule

_TOGETHER = 16
"""Robots for which a leaking counter runs at once: more need more memory, fewer more time."""


def first_firings(
    values: Float[np.ndarray, "T N M"],
    alive: Bool[np.ndarray, "T N"],
    rule: Rule,
    alphas: Float[np.ndarray, " A"],
    betas: Float[np.ndarray, " B"],
) -> Int[np.ndarray, "N A B"]:
    """The step in which each robot first fires at each α and β; T where it never does.

    ε, leak and side are those of the rule; its α, β and hold are not used. The counter adds in the
    same order as on a robot, so a replay fires in the same step as the robot did. A robot that has
    fallen no longer fires.

    Raises:
        GaitshiftError: α or β do not rise.
    """
    for name, grid in (("α", alphas), ("β", betas)):
        if len(grid) == 0 or np.any(np.diff(grid) <= 0.0):
            raise GaitshiftError(f"grid values of {name} must rise")
    steps, robots, _ = values.shape
    first = np.empty((robots, len(alphas), len(betas)), dtype=np.int32)
    last = steps_alive(alive)
    for start in range(0, robots, _TOGETHER):
        block = range(start, min(start + _TOGETHER, robots))
        for robot, k in zip(block, counters(values[:, block], rule, alphas), strict=True):
            rising = np.maximum.accumulate(k, axis=1) if rule.leak else k
            for a in range(len(alphas)):
                first[robot, a] = np.searchsorted(rising[a], betas, "right")
            if last[robot] < steps:
                first[robot][first[robot] >= last[robot]] = steps
    return first


def counters(
    values: Float[np.ndarray, "T N M"], rule: Rule, alphas: Float[np.ndarray, " A"]
) -> Float[np.ndarray, "N A T"]:
    """Counter k of each robot after each step, at each α, never set back."""
    counts = np.stack([counts_at(of_robot, rule, alphas) for of_robot in values.swapaxes(0, 1)])
    growth = rule.epsilon * counts - rule.leak
    if not rule.leak:
        return growth.cumsum(axis=2)
    steps = np.ascontiguousarray(np.moveaxis(growth, 2, 0))
    k, last = np.empty(steps.shape), np.zeros(steps.shape[1:])
    for t, grown in enumerate(steps):
        last = np.maximum(last + grown, 0.0, out=k[t])
    return np.ascontiguousarray(np.moveaxis(k, 0, 2))


def counts_at(
    values: Float[np.ndarray, "T M"], rule: Rule, alphas: Float[np.ndarray, " A"]
) -> Int[np.ndarray, "A T"]:
    """How many times ε k grows in each step of one robot, at each α."""
    steps = len(values)
    if rule.when == "below":
        largest = values.max(axis=1)  # NaN where any is unknown
        return (largest < alphas[:, None]).astype(np.int64)
    # The number of α below a value is its place in the rising α.
    passed = np.searchsorted(alphas, np.where(np.isnan(values), -np.inf, values), "left")
    slot = passed * steps + np.arange(steps)[:, None]
    shape = (len(alphas) + 1, steps)
    each = np.bincount(slot.ravel(), minlength=shape[0] * steps).astype(np.int32).reshape(shape)
    return each[::-1].cumsum(axis=0, dtype=np.int32)[::-1][1:]


def steps_alive(alive: Bool[np.ndarray, "T N"]) -> Int[np.ndarray, " N"]:
    """Number of steps before each robot fell."""
    fell = ~alive
    return np.where(fell.any(axis=0), fell.argmax(axis=0), len(alive))


@dataclass(frozen=True, kw_only=True, eq=False)
class Detections:
    """Detections of the robots that reached rough ground without a firing, at each α and β."""

    came: Int[np.ndarray, "A B"]
    """Robots."""
    detected: Int[np.ndarray, "A B"]
    """Those of them that fired before the rough ground, or their run, ended."""
    delay_s: Float[np.ndarray, "N A B"]
    """Time from the start of rough ground to the firing [s]; NaN where not detected."""
    delay_m: Float[np.ndarray, "N A B"]
    """The same as a distance [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FalseShifts:
    """Firings of robots on smooth ground, before they reach rough ground, at each α and β."""

    fired: Int[np.ndarray, "A B"]
    """Robots that fired."""
    robots: int
    """Robots."""
    km: Float[np.ndarray, "A B"]
    """Distance walked until the firing or the end [km]."""


def detections(recording: LabelledRun, first: Int[np.ndarray, "N A B"]) -> Detections:
    """The firings `first` of one recording on its first stretch of rough ground."""
    entry, end = _stretch(recording)
    came = (entry[:, None, None] < end[:, None, None]) & (first >= entry[:, None, None])
    detected = came & (first < end[:, None, None])
    last = len(recording.time) - 1
    at = np.minimum(first, last)
    robots = np.arange(recording.robots)
    start = np.minimum(entry, last)
    delay = recording.time[at] - recording.time[start][:, None, None]
    way = recording.distance[at, robots[:, None, None]]
    way = way - recording.distance[start, robots][:, None, None]
    return Detections(
        came=came.sum(axis=0),
        detected=detected.sum(axis=0),
        delay_s=np.where(detected, delay, np.nan),
        delay_m=np.where(detected, way, np.nan),
    )


def false_shifts(recording: LabelledRun, first: Int[np.ndarray, "N A B"]) -> FalseShifts:
    """The firings before any rough ground, and the distance walked until then."""
    entry, _ = _stretch(recording)
    limit = np.minimum(entry, steps_alive(recording.alive))[:, None, None]
    fired = first < limit
    until = np.maximum(np.where(fired, first, limit) - 1, 0)
    way = recording.distance[until, np.arange(recording.robots)[:, None, None]]
    return FalseShifts(
        fired=fired.sum(axis=0), robots=recording.robots, km=way.sum(axis=0) / 1000.0
    )


def _stretch(recording: LabelledRun) -> tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]]:
    """Steps at which each robot reaches its first rough ground, and leaves it; T if never."""
    steps = len(recording.time)
    rough = recording.rough & recording.alive
    some = rough.any(axis=0)
    entry = np.where(some, rough.argmax(axis=0), steps)
    after = ~rough & (np.arange(steps)[:, None] >= entry)
    end = np.where(after.any(axis=0), after.argmax(axis=0), steps)
    return entry, end


@dataclass(frozen=True, kw_only=True)
class ParameterGrid:
    """The values of α and β that are tried."""

    alphas: Float[np.ndarray, " A"]
    """α, in the statistic's unit, rising."""
    betas: Float[np.ndarray, " B"]
    """β [counts], rising."""

    @property
    def shape(self) -> tuple[int, int]:
        """A, B."""
        return len(self.alphas), len(self.betas)


@dataclass(kw_only=True, eq=False)
class Tally:
    """Results of a rule over many recordings."""

    shape: tuple[int, int]
    """A, B."""
    came: Int[np.ndarray, "A B"] = field(init=False)
    """Robots that reached rough ground without a firing."""
    detected: Int[np.ndarray, "A B"] = field(init=False)
    """Those of them that fired on it."""
    seconds: Float[np.ndarray, "A B"] = field(init=False)
    """Sum of their delays [s]."""
    metres: Float[np.ndarray, "A B"] = field(init=False)
    """Sum of their delays [m]."""
    fired: Int[np.ndarray, "A B"] = field(init=False)
    """Robots that fired on smooth ground."""
    km: Float[np.ndarray, "A B"] = field(init=False)
    """Distance over smooth ground until the firing, of all robots [km]."""
    robots: int = 0
    """Robots in all."""

    def __post_init__(self) -> None:
        self.came, self.detected, self.fired = (np.zeros(self.shape, dtype=int) for _ in range(3))
        self.seconds, self.metres, self.km = (np.zeros(self.shape) for _ in range(3))

    def add(self, recording: LabelledRun, first: Int[np.ndarray, "N A B"]) -> None:
        """Adds the firings of one recording."""
        found, wrong = detections(recording, first), false_shifts(recording, first)
        self.came += found.came
        self.detected += found.detected
        self.seconds += np.nansum(found.delay_s, axis=0)
        self.metres += np.nansum(found.delay_m, axis=0)
        self.fired += wrong.fired
        self.km += wrong.km
        self.robots += wrong.robots

    def join(self, other: "Tally") -> None:
        """Adds the results of another tally."""
        for name in ("came", "detected", "seconds", "metres", "fired", "km", "robots"):
            setattr(self, name, getattr(self, name) + getattr(other, name))

    @property
    def missed(self) -> Float[np.ndarray, "A B"]:
        """Share of the rough stretches without a shift; NaN without a rough stretch."""
        return 1.0 - _share(self.detected, self.came)

    @property
    def delay_m(self) -> Float[np.ndarray, "A B"]:
        """Mean delay of a detection [m]; NaN without one."""
        return _share(self.metres, self.detected)

    @property
    def delay_s(self) -> Float[np.ndarray, "A B"]:
        """Mean delay of a detection [s]; NaN without one."""
        return _share(self.seconds, self.detected)

    @property
    def false_per_km(self) -> Float[np.ndarray, "A B"]:
        """Shifts per kilometre of smooth ground; NaN where none was walked."""
        return _share(self.fired, self.km)


@runtime_checkable
class Joining(Protocol):
    """Results of some recordings, to which those of others can be added."""

    def join(self, other: Any, /) -> None:
        """Adds the results of another one."""
        ...


Part = TypeVar("Part", bound=Joining)


def join_by_name(mine: dict[str, Part], others: Mapping[str, Part]) -> None:
    """Joins the results of the others, name by name."""
    for name, other in others.items():
        if name in mine:
            mine[name].join(other)
        else:
            mine[name] = other


def _share(part: np.ndarray, whole: np.ndarray) -> Float[np.ndarray, "A B"]:
    return np.where(whole > 0, part / np.where(whole > 0, whole, 1), np.nan)
