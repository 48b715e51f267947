"""Tunes conditions: every α, β and leak of each candidate is tried on recordings."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.candidates import BETAS, Candidate, statistics_of
from gaitshift.lab.identification.choice import Choice, choose
from gaitshift.lab.identification.firings import ParameterGrid, Tally, first_firings, join_by_name
from gaitshift.lab.identification.labelled_run import LabelledRun, Way, align_to_entry
from gaitshift.lab.identification.passage import GridScores, best_beta, passage_grid
from gaitshift.shift import Rule


@dataclass(frozen=True, kw_only=True)
class Tuned:
    """A candidate with its numbers."""

    candidate: Candidate
    """The condition."""
    way: Way
    """What it detects."""
    choice: Choice
    """α, β and leak."""
    grid: ParameterGrid
    """α and β that were tried."""
    tally: Tally
    """Results at the chosen leak on the recordings for choosing."""
    area_beta: float
    """β at which passages are scored for ROC curves [counts]: that of the grid with the largest
    mean area on the recordings for choosing, because k may not reach the chosen β within a passage.
    Where numbers were given, the given β."""

    @property
    def rule(self) -> Rule:
        """The rule that was chosen."""
        return _rule(self.way, self.choice.alpha, self.choice.beta, self.choice.leak)

    @property
    def area_rule(self) -> Rule:
        """The rule by which passages are scored."""
        return replace(self.rule, beta=self.area_beta)


@dataclass(kw_only=True)
class OnGrid:
    """Results of a candidate at one leak, at each α and β, on the recordings of one name."""

    tally: Tally
    """Detections and false shifts."""
    scores: GridScores = field(default_factory=lambda: {True: [], False: []})
    """Of each passage."""

    def join(self, other: "OnGrid") -> None:
        """Adds the results of another one."""
        self.tally.join(other.tally)
        for is_wanted, rows in other.scores.items():
            self.scores[is_wanted] += rows


@dataclass(kw_only=True)
class Tried:
    """Results of whole grids on some recordings; others can be added."""

    way: Way
    """What is detected."""
    found: dict[str, dict[float, dict[str, OnGrid]]] = field(default_factory=dict)
    """By candidate, by leak, by the name of the recordings."""
    lacking: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """Columns that a recording lacks, by candidate."""

    def on(self, candidate: Candidate, leak: float, course: str) -> OnGrid:
        """The results of a candidate at one leak and course; empty results where there are none."""
        by_leak = self.found.setdefault(candidate.name, {})
        tally = Tally(shape=_grid(candidate, self.way).shape)
        return by_leak.setdefault(leak, {}).setdefault(course, OnGrid(tally=tally))

    def join(self, other: "Tried") -> None:
        """Adds the results of another one."""
        self.lacking |= other.lacking
        for name, by_leak in other.found.items():
            for leak, by_course in by_leak.items():
                join_by_name(self.found.setdefault(name, {}).setdefault(leak, {}), by_course)


def try_grids(
    candidates: Sequence[Candidate], recordings: Iterable[LabelledRun], way: Way
) -> Tried:
    """Replays each candidate whose signals a recording has, at each of its α, β and leaks."""
    tried = Tried(way=way)
    for recording in recordings:
        recording.compute(statistics_of(candidates, recording))
        for candidate in candidates:
            if missing := candidate.missing(recording):
                tried.lacking[candidate.name] = missing
                continue
            values = candidate.values(recording)  # before the labels change: an oracle reads them
            seen, values = align_to_entry(recording, values, way)
            grid = _grid(candidate, way)
            for leak in candidate.leaks:
                rule = _rule(way, 1.0, 1.0, leak)
                first = first_firings(values, seen.alive, rule, grid.alphas, grid.betas)
                one = tried.on(candidate, leak, seen.name)
                one.tally.add(seen, first)
                of = passage_grid(seen, values, rule, grid.alphas, grid.betas)
                for is_wanted, rows in of.items():
                    one.scores[is_wanted] += rows
    return tried


def tune(candidates: Sequence[Candidate], tried: Tried) -> list[Tuned]:
    """The best numbers of each candidate on the recordings.

    Candidates whose signals no recording has are left out.

    Raises:
        GaitshiftError: no rough ground, or no smooth ground, in the recordings.
    """
    found: list[Tuned] = []
    for candidate in candidates:
        if candidate.name not in tried.found:
            continue
        grid = _grid(candidate, tried.way)
        tallies = {
            leak: {course: one.tally for course, one in by_course.items()}
            for leak, by_course in tried.found[candidate.name].items()
        }
        choice = choose(tallies, grid, _rule(tried.way, 1.0, 1.0, 0.0).when)
        chosen = tried.found[candidate.name][choice.leak]
        whole = Tally(shape=grid.shape)
        for one in chosen.values():
            whole.join(one.tally)
        scores = {course: one.scores for course, one in chosen.items()}
        found.append(
            Tuned(
                candidate=candidate,
                way=tried.way,
                choice=choice,
                grid=grid,
                tally=whole,
                area_beta=best_beta(scores, grid.betas, choice.beta),
            )
        )
    if not found:
        needs = "; ".join(f"'{name}' needs {', '.join(of)}" for name, of in tried.lacking.items())
        raise GaitshiftError(
            f"the logs lack the signals of all these conditions: {needs}"
            if needs
            else "there must be recordings to choose the settings by, got none"
        )
    return found


def as_given(
    candidates: Sequence[Candidate], *, way: Way, alpha: float, beta: float, leak: float = 0.0
) -> list[Tuned]:
    """Each candidate with the same given numbers, in place of chosen ones.

    Raises:
        GaitshiftError: a number is out of range.
    """
    _ = _rule(way, alpha, beta, leak)
    grids = [_grid(candidate, way) for candidate in candidates]
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


def _grid(candidate: Candidate, way: Way) -> ParameterGrid:
    return ParameterGrid(alphas=candidate.alphas(way), betas=BETAS)


def _rule(way: Way, alpha: float, beta: float, leak: float) -> Rule:
    when = "above" if way == "rough" else "below"
    return Rule(when=when, alpha=alpha, beta=beta, leak=leak)
