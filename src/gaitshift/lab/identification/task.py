"""Identification from files: conditions tuned on some logs and judged on others, step by step."""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification.candidates import CANDIDATES, Candidate, candidates
from gaitshift.lab.identification.classifier import NAME, Examples, RoughnessClassifier
from gaitshift.lab.identification.judging import Judged, Replayed, judge, replay_rules
from gaitshift.lab.identification.kept import EXAMPLES, REPLAYED, TRIED
from gaitshift.lab.identification.labelled_run import Way
from gaitshift.lab.identification.log_files import check_sources, recordings
from gaitshift.lab.identification.step_cache import Stamp, StepCache, stamp
from gaitshift.lab.identification.tuning import Tried, Tuned, as_given, try_grids, tune

ALL = "all"
"""Stands for every condition whose signals are in the logs."""


@dataclass(frozen=True)
class Numbers:
    """Given α, β and leak, which are judged and not chosen."""

    alpha: float
    """In the condition's unit."""
    beta: float
    """[counts]"""
    leak: float = 0.0
    """[counts a step]"""


@dataclass(frozen=True, kw_only=True)
class Task:
    """An identification: logs, conditions, and what they detect."""

    logs: tuple[Path, ...]
    """Logs for choosing the numbers."""
    held_out: tuple[Path, ...] = ()
    """Logs for judging the numbers; by default the logs for choosing them."""
    conditions: tuple[str, ...]
    """Names of the conditions, or `ALL`."""
    way: Way = "rough"
    """What the conditions detect."""
    numbers: Numbers | None = None
    """Numbers to judge; None: they are chosen."""

    def __post_init__(self) -> None:
        if self.everything and self.numbers is not None:
            raise GaitshiftError(
                "--alpha must be given with named conditions, not with all: its unit differs"
            )
        _ = self.wanted  # every name is known
        check_sources((*self.logs, *self.held_out))
        choosing = {path.resolve() for path in self.logs}
        for path in self.held_out:
            if path.resolve() in choosing:
                raise GaitshiftError(
                    f"{path}: a log must not both choose settings and be --held-out; give logs of "
                    "other seeds"
                )

    @property
    def everything(self) -> bool:
        """Whether all conditions are compared."""
        return ALL in self.conditions

    @property
    def wanted(self) -> tuple[Candidate, ...]:
        """All but the classifier, which is fitted first; `GaitshiftError` if one is unknown."""
        named = candidates([name for name in self.conditions if name not in (NAME, ALL)])
        return CANDIDATES if self.everything else named

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the conditions, with that of the classifier where it may be among them."""
        classifier = (NAME,) if self.everything or NAME in self.conditions else ()
        return (*(candidate.name for candidate in self.wanted), *classifier)

    @property
    def judges(self) -> tuple[Path, ...]:
        """Logs for judging."""
        return self.held_out or self.logs

    def run(self, folder: Path, report: Callable[[str], None]) -> list[Judged]:
        """Tunes and judges, log by log; results are cached in `folder` and reused.

        Raises:
            GaitshiftError: a log cannot be read, lacks the signals of a condition that was named,
                or all of them are of one kind of ground.
        """
        cache = StepCache(folder, report)
        learned = tuple(map(stamp, self.logs))
        classifier = self._fitted(cache, report)
        if classifier is None:
            learned = ()
        tuned = self._tuned(cache, classifier, learned)
        if classifier is not None:  # robots that judge were seen by neither half of it
            known = classifier.candidate(crosswise=False)
            tuned = [replace(t, candidate=known) if t.candidate.name == NAME else t for t in tuned]
        replayed = Replayed()
        rules = [(one.candidate.name, one.rule, one.area_beta) for one in tuned]
        for log in self.judges:
            work = partial(_replay, tuned, log, self.way)
            about = (self.way, rules, learned, stamp(log))
            replayed.join(cache.get(f"judging: {log.stem}", about, REPLAYED, work))
        return judge(tuned, replayed)

    def _fitted(
        self, cache: StepCache, report: Callable[[str], None]
    ) -> RoughnessClassifier | None:
        """The classifier, where it is compared and can learn; fitted anew to the kept examples."""
        if NAME not in self.names:
            return None
        examples: list[Examples] = []
        for log in self.logs:
            work, about = partial(_examples, log, self.way), (self.way, stamp(log))
            examples.append(cache.get(f"learning from: {log.stem}", about, EXAMPLES, work))
        report("fitting the classifier")
        try:
            return RoughnessClassifier.learn(examples)
        except GaitshiftError as error:
            if not self.everything:
                raise
            report(f"{error}; the classifier is skipped")
            return None

    def _tuned(
        self, cache: StepCache, classifier: RoughnessClassifier | None, learned: tuple[Stamp, ...]
    ) -> list[Tuned]:
        wanted = list(self.wanted)
        if classifier is not None:
            wanted.append(classifier.candidate(crosswise=True))
        if self.numbers is not None:
            return as_given(wanted, way=self.way, **asdict(self.numbers))
        tried = Tried(way=self.way)
        names = [candidate.name for candidate in wanted]
        for log in self.logs:
            work = partial(_try, wanted, log, self.way)
            about = (self.way, names, learned, stamp(log))
            tried.join(cache.get(f"choosing: {log.stem}", about, TRIED, work))
        tuned = tune(wanted, tried)
        found = {one.candidate.name for one in tuned}
        left_out = [name for name in names if name not in found]
        if left_out and not self.everything:
            lacks = ", ".join(tried.lacking[left_out[0]])
            raise GaitshiftError(
                f"the logs lack signals; the condition '{left_out[0]}' needs {lacks}"
            )
        return tuned


def _examples(log: Path, way: Way) -> Examples:
    return Examples.of(recordings([log], way))


def _try(wanted: Sequence[Candidate], log: Path, way: Way) -> Tried:
    return try_grids(wanted, recordings([log], way), way)


def _replay(tuned: Sequence[Tuned], log: Path, way: Way) -> Replayed:
    return replay_rules(tuned, recordings([log], way))
