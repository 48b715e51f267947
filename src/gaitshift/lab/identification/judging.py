"""Judges conditions with their numbers on recordings that were not used to choose them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.candidates import statistics_of
from gaitshift.lab.identification.chatter import (
    RecordedValues,
    chattered,
    ever_fires,
    in_turn,
    shifts,
)
from gaitshift.lab.identification.firings import (
    Tally,
    detections,
    first_firings,
    join_by_name,
    steps_alive,
)
from gaitshift.lab.identification.labelled_run import LabelledRun, align_to_entry
from gaitshift.lab.identification.passage import longest_passage, passage_scores
from gaitshift.lab.identification.statistics import auc, auc_interval
from gaitshift.lab.identification.tuning import Tuned
from gaitshift.shift import GaitGraph


@dataclass(kw_only=True)
class OnCourse:
    """Results of one condition on the recordings of one name."""

    course: str
    """Name of the recordings."""
    tally: Tally
    """Of one α and one β."""
    delays_m: list[float] = field(default_factory=list)
    """Of each detection [m]."""
    scores: dict[bool, list[int]] = field(default_factory=lambda: {True: [], False: []})
    """Score of each passage (`passage_scores`), with (True) and without the ground to detect."""
    shifts: int = 0
    """Number of shifts of all robots, there and back (`chatter`)."""
    chattered: int = 0
    """Robots that shifted more than once there and once back for each rough stretch."""

    def join(self, other: "OnCourse") -> None:
        """Adds the results of another one."""
        self.tally.join(other.tally)
        self.delays_m += other.delays_m
        for is_wanted, scores in other.scores.items():
            self.scores[is_wanted] += scores
        self.shifts += other.shifts
        self.chattered += other.chattered


@dataclass(kw_only=True)
class Replayed:
    """Results of conditions with their numbers on some recordings; others can be added."""

    courses: dict[str, dict[str, OnCourse]] = field(default_factory=dict)
    """By condition, by the name of the recordings."""
    soonest: dict[str, float] = field(default_factory=dict)
    """Shortest time to exceed each condition's β [s]."""
    scored: dict[str, bool] = field(default_factory=dict)
    """Whether a passage was long enough for each one's k to exceed `Tuned.area_beta`."""
    metres: float = 0.0
    """Distance walked by all robots [m]."""
    seconds: float = 0.0
    """Time walked by all robots [s]."""

    def join(self, other: "Replayed") -> None:
        """Adds the results of another one."""
        for name, by_course in other.courses.items():
            join_by_name(self.courses.setdefault(name, {}), by_course)
        self.soonest |= other.soonest
        for name, scored in other.scored.items():
            self.scored[name] = self.scored.get(name, False) or scored
        self.metres += other.metres
        self.seconds += other.seconds


@dataclass(frozen=True, kw_only=True)
class Judged:
    """Results of a condition on recordings that were not used to choose its numbers."""

    tuned: Tuned
    """The condition."""
    courses: tuple[OnCourse, ...]
    """Course by course."""
    soonest: float
    """Shortest time to exceed β [s]: from k = 0 to firing where every value counts at each step."""
    speed: float
    """Mean speed of the robots in the recordings [m/s]."""
    is_scored: bool
    """Whether k can exceed `Tuned.area_beta` within a passage; else its scores mean nothing."""

    def area(self, course: str) -> tuple[float, float, float] | None:
        """Area under the ROC curve of a course's passages with the ground to detect, with interval.

        Negatives are the passages of all recordings without that ground. None without passages of
        both kinds, and where no passage is long enough for the rule to fire.
        """
        wanted, others = self.scores_on(course), self.other_scores
        if not self.is_scored or not wanted.size or not others.size:
            return None
        area = float(auc(wanted[:, None], others[:, None])[0])
        low, high = auc_interval(area, len(wanted), len(others))
        return area, low, high

    def scores_on(self, course: str) -> Float[np.ndarray, " P"]:
        """Scores of the passages with the ground to detect on a course."""
        of = [c.scores[True] for c in self.courses if c.course == course]
        return np.array([float(score) for scores in of for score in scores])

    @property
    def other_scores(self) -> Float[np.ndarray, " Q"]:
        """Scores of the passages without the ground to detect."""
        return np.array([float(x) for course in self.courses for x in course.scores[False]])


def replay_rules(tuned: Sequence[Tuned], recordings: Iterable[LabelledRun]) -> Replayed:
    """Replays each condition with its numbers, course by course.

    Raises:
        GaitshiftError: a recording lacks the signals of a condition.
    """
    replayed = Replayed(courses={one.candidate.name: {} for one in tuned})
    for recording in recordings:
        steps = steps_alive(recording.alive)
        replayed.metres += float(recording.distance[steps - 1, np.arange(recording.robots)].sum())
        replayed.seconds += float(steps.sum()) * recording.period
        recording.compute(statistics_of((one.candidate for one in tuned), recording))
        graphs: dict[str, GaitGraph] = {}
        for one in tuned:
            name, rule = one.candidate.name, one.rule
            if missing := one.candidate.missing(recording):
                raise GaitshiftError(
                    f"{recording.name} lacks signals; the condition '{name}' needs "
                    f"{', '.join(missing)}"
                )
            values = one.candidate.values(recording)
            seen, aligned = align_to_entry(recording, values, one.way)
            course = replayed.courses[name].setdefault(
                seen.name, OnCourse(course=seen.name, tally=Tally(shape=(1, 1)))
            )
            _add(course, one, seen, aligned)
            if one.way == "flat" or ever_fires(recording, rule, values):
                watched = one.candidate.statistic or RecordedValues(values=values)
                graphs[name] = in_turn(rule, watched, one.way)
            width, period = values.shape[2], recording.period
            replayed.soonest[name] = rule.soonest(width, period)
            least = one.area_rule.soonest(width, period)
            enough = least < period * (longest_passage(seen) + 0.5)
            replayed.scored[name] = replayed.scored.get(name, False) or enough
        counts = shifts(recording, list(graphs.values())) if graphs else ()
        for name, count in zip(graphs, counts, strict=True):
            course = replayed.courses[name][recording.name]
            course.shifts += int(count.sum())
            course.chattered += int(chattered(recording, count).sum())
    return replayed


def judge(tuned: Sequence[Tuned], replayed: Replayed) -> list[Judged]:
    """Each condition with its results.

    Raises:
        GaitshiftError: there was no recording.
    """
    if not replayed.seconds:
        raise GaitshiftError("there must be recordings to judge by, got none")
    return [
        Judged(
            tuned=one,
            courses=tuple(replayed.courses[one.candidate.name].values()),
            soonest=replayed.soonest[one.candidate.name],
            speed=replayed.metres / replayed.seconds,
            is_scored=replayed.scored[one.candidate.name],
        )
        for one in tuned
    ]


def _add(
    course: OnCourse, one: Tuned, seen: LabelledRun, values: Float[np.ndarray, "T N M"]
) -> None:
    """Adds the results of a condition on a recording from `align_to_entry`."""
    alpha, beta = np.array([one.choice.alpha]), np.array([one.choice.beta])
    first = first_firings(values, seen.alive, one.rule, alpha, beta)
    course.tally.add(seen, first)
    delays = detections(seen, first).delay_m.ravel()
    course.delays_m += delays[~np.isnan(delays)].tolist()
    for is_wanted, of in passage_scores(seen, values, one.area_rule, one.grid.alphas).items():
        course.scores[is_wanted] += of
