"""What identification finds out: the numbers that some recordings choose, judged on others."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.identification.candidates import BETAS, Candidate
from gaitshift.identification.chatter import (
    Said,
    chattered,
    ever_fires,
    in_turn,
    shifts,
)
from gaitshift.identification.choice import Choice, choose
from gaitshift.identification.facing import facing
from gaitshift.identification.grid import first_firings, steps_alive
from gaitshift.identification.passage import (
    GridScores,
    best_beta,
    longest_passage,
    passage_grid,
    passage_scores,
)
from gaitshift.identification.recording import Recording, Way
from gaitshift.identification.scores import detections
from gaitshift.identification.statistics import auc, auc_interval
from gaitshift.identification.tally import Grid, Tally
from gaitshift.switching import Rule

Recordings = Callable[[], Iterable[Recording]]
"""Gives the recordings, one after the other, as often as asked."""


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """A candidate with its numbers."""

    candidate: Candidate
    """The condition."""
    way: Way
    """What it is to notice."""
    choice: Choice
    """α, β and leak."""
    grid: Grid
    """What was tried."""
    tally: Tally
    """What came of it over the recordings that chose, at the chosen leak."""
    area_beta: float
    """β at which passages are scored for ROC curves [counts]: of the grid's the one of the largest
    mean area on the recordings that chose, as k may not reach the chosen β within a passage; where
    numbers were given, the one that was given."""

    @property
    def rule(self) -> Rule:
        """The rule that was chosen."""
        return _rule(self.way, self.choice.alpha, self.choice.beta, self.choice.leak)

    @property
    def area_rule(self) -> Rule:
        """The rule by which passages are scored."""
        return replace(self.rule, beta=self.area_beta)


@dataclass(kw_only=True)
class OnCourse:
    """How one condition did on the recordings of one name."""

    course: str
    """Name of the recordings."""
    tally: Tally
    """Of one α and one β."""
    delays_m: list[float] = field(default_factory=list)
    """Of each detection [m]."""
    scores: dict[bool, list[int]] = field(default_factory=lambda: {True: [], False: []})
    """Score of each passage (`passage_scores`), of what is to be noticed and of what is not."""
    shifts: int = 0
    """How often robots would have shifted, there and back (`chatter`)."""
    chattered: int = 0
    """Robots that did so more than once there and once back for each rough stretch."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A condition on recordings that did not choose its numbers."""

    tuned: Tuned
    """The condition."""
    courses: tuple[OnCourse, ...]
    """Course by course."""
    soonest: float
    """What β is in time [s]: from k = 0 to firing where every value counts in each step."""
    speed: float
    """Mean speed of the robots that judged [m/s]."""
    is_scored: bool
    """Whether k can exceed `Tuned.area_beta` within a passage: else its scores tell nothing."""

    def area(self, course: str) -> tuple[float, float, float] | None:
        """Area under the ROC curve of the passages to be noticed on a course, with its interval.

        Against the passages of all recordings on which nothing is to be noticed; None without both,
        and where no passage is long enough for the rule to fire at all.
        """
        wanted, others = self.scores_on(course), self.other_scores
        if not self.is_scored or not wanted.size or not others.size:
            return None
        area = float(auc(wanted[:, None], others[:, None])[0])
        low, high = auc_interval(area, len(wanted), len(others))
        return area, low, high

    def scores_on(self, course: str) -> Float[np.ndarray, " P"]:
        """Scores of the passages to be noticed on a course."""
        of = [c.scores[True] for c in self.courses if c.course == course]
        return np.array([float(score) for scores in of for score in scores])

    @property
    def other_scores(self) -> Float[np.ndarray, " Q"]:
        """Scores of the passages in which nothing is to be noticed."""
        return np.array([float(x) for course in self.courses for x in course.scores[False]])


def tune(
    candidates: Sequence[Candidate],
    recordings: Recordings,
    *,
    way: Way,
    report: Callable[[str], None] = lambda name: None,
) -> list[Tuned]:
    """The numbers of each candidate that the recordings choose.

    Candidates that the recordings do not feed are left out.

    Raises:
        GaitshiftError: no rough ground, or no smooth ground, in the recordings.
    """
    tallies: dict[str, dict[float, dict[str, Tally]]] = {}
    scores: dict[str, dict[float, dict[str, GridScores]]] = {}
    lacking: dict[str, tuple[str, ...]] = {}
    for recording in recordings():
        report(recording.name)
        for candidate in candidates:
            if missing := candidate.missing(recording):
                lacking[candidate.name] = missing
                continue
            values = candidate.values(recording)  # an oracle sees the ground as it is
            seen, values = facing(recording, values, way)
            grid = Grid(alphas=candidate.alphas, betas=BETAS)
            for leak in candidate.leaks:
                rule = _rule(way, 1.0, 1.0, leak)
                first = first_firings(values, seen.alive, rule, grid.alphas, grid.betas)
                by_name = tallies.setdefault(candidate.name, {}).setdefault(leak, {})
                tally = by_name.setdefault(seen.name, Tally(shape=grid.shape))
                tally.add(seen, first)
                of = passage_grid(seen, values, rule, grid.alphas, grid.betas)
                kept = scores.setdefault(candidate.name, {}).setdefault(leak, {})
                course = kept.setdefault(seen.name, {True: [], False: []})
                for is_wanted, rows in of.items():
                    course[is_wanted] += rows
    found: list[Tuned] = []
    for candidate in candidates:
        if candidate.name not in tallies:
            continue
        grid = Grid(alphas=candidate.alphas, betas=BETAS)
        choice = choose(tallies[candidate.name], grid, _rule(way, 1.0, 1.0, 0.0).when)
        whole = Tally(shape=grid.shape)
        for tally in tallies[candidate.name][choice.leak].values():
            whole.join(tally)
        found.append(
            Tuned(
                candidate=candidate,
                way=way,
                choice=choice,
                grid=grid,
                tally=whole,
                area_beta=best_beta(scores[candidate.name][choice.leak], grid.betas, choice.beta),
            )
        )
    if not found:
        needs = "; ".join(f"'{name}' needs {', '.join(of)}" for name, of in lacking.items())
        raise GaitshiftError(
            f"the logs lack the signals of every condition that was asked for: {needs}"
            if needs
            else "no recordings to choose by"
        )
    return found


def as_given(
    candidates: Sequence[Candidate], *, way: Way, alpha: float, beta: float, leak: float = 0.0
) -> list[Tuned]:
    """Each candidate with the same numbers, which nobody chose: to see what they do.

    Raises:
        GaitshiftError: a number out of range.
    """
    _ = _rule(way, alpha, beta, leak)
    grids = [Grid(alphas=candidate.alphas, betas=BETAS) for candidate in candidates]
    return [
        Tuned(
            candidate=candidate,
            way=way,
            choice=Choice(alpha=alpha, beta=beta, leak=leak),
            grid=grid,
            tally=Tally(shape=grid.shape),
            area_beta=beta,
        )
        for candidate, grid in zip(candidates, grids, strict=True)
    ]


def judge(
    tuned: Sequence[Tuned],
    recordings: Recordings,
    *,
    report: Callable[[str], None] = lambda name: None,
) -> list[Judged]:
    """What conditions with their numbers do on recordings, course by course.

    Raises:
        GaitshiftError: a recording lacks the signals of a condition, or there is none.
    """
    courses: dict[str, dict[str, OnCourse]] = {one.candidate.name: {} for one in tuned}
    soonest: dict[str, float] = {}
    scored: dict[str, bool] = {}
    way, time = 0.0, 0.0
    for recording in recordings():
        report(recording.name)
        steps = steps_alive(recording.alive)
        way += float(recording.distance[steps - 1, np.arange(recording.robots)].sum())
        time += float(steps.sum()) * recording.period
        for one in tuned:
            name, rule = one.candidate.name, one.rule
            if missing := one.candidate.missing(recording):
                raise GaitshiftError(
                    f"{recording.name} lacks signals of '{name}': it needs {', '.join(missing)}"
                )
            values = one.candidate.values(recording)
            seen, faced = facing(recording, values, one.way)
            course = courses[name].setdefault(
                seen.name, OnCourse(course=seen.name, tally=Tally(shape=(1, 1)))
            )
            _add(course, one, seen, faced)
            if one.way == "flat" or ever_fires(recording, rule, values):
                watched = one.candidate.statistic or Said(values=values)
                count = shifts(recording, in_turn(rule, watched, one.way))
                course.shifts += int(count.sum())
                course.chattered += int(chattered(recording, count).sum())
            width, period = values.shape[2], recording.period
            soonest[name] = rule.soonest(width, period)
            least = one.area_rule.soonest(width, period)
            enough = least < period * (longest_passage(seen) + 0.5)
            scored[name] = scored.get(name, False) or enough
    if not time:
        raise GaitshiftError("no recordings to judge by")
    return [
        Judged(
            tuned=one,
            courses=tuple(courses[one.candidate.name].values()),
            soonest=soonest[one.candidate.name],
            speed=way / time,
            is_scored=scored[one.candidate.name],
        )
        for one in tuned
    ]


def _add(course: OnCourse, one: Tuned, seen: Recording, values: Float[np.ndarray, "T N M"]) -> None:
    """Takes in how a condition did on a recording that shows what it is to notice (`facing`)."""
    alpha, beta = np.array([one.choice.alpha]), np.array([one.choice.beta])
    first = first_firings(values, seen.alive, one.rule, alpha, beta)
    course.tally.add(seen, first)
    delays = detections(seen, first).delay_m.ravel()
    course.delays_m += delays[~np.isnan(delays)].tolist()
    for is_wanted, of in passage_scores(seen, values, one.area_rule, one.grid.alphas).items():
        course.scores[is_wanted] += of


def _rule(way: Way, alpha: float, beta: float, leak: float) -> Rule:
    when = "above" if way == "rough" else "below"
    return Rule(when=when, alpha=alpha, beta=beta, leak=leak)
