"""The results of single logs as plain data, for `StepCache`."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gaitshift.lab.identification.classifier import Examples
from gaitshift.lab.identification.firings import Tally
from gaitshift.lab.identification.judging import OnCourse, Replayed
from gaitshift.lab.identification.passage import GridScores
from gaitshift.lab.identification.step_cache import Form
from gaitshift.lab.identification.tuning import OnGrid, Tried


def _plain_tally(tally: Tally) -> dict[str, Any]:
    return {name: value for name, value in vars(tally).items() if name != "shape"}


def _tally(plain: dict[str, Any]) -> Tally:
    tally = Tally(shape=plain["came"].shape, robots=plain.pop("robots"))
    for name, values in plain.items():
        getattr(tally, name)[:] = values
    return tally


def _plain_scores(scores: GridScores) -> list[Any]:
    """Rows of smooth and of rough ground, each as one array: an array a row would be slow."""
    return [np.stack(scores[rough]) if scores[rough] else [] for rough in (False, True)]


def _scores(plain: Sequence[Any]) -> GridScores:
    smooth, rough = plain
    return {True: list(rough), False: list(smooth)}


def _plain_tried(tried: Tried) -> dict[str, Any]:
    return {
        "way": tried.way,
        "lacking": tried.lacking,
        "found": [
            {
                "candidate": candidate,
                "leak": leak,
                "course": course,
                "tally": _plain_tally(one.tally),
                "scores": _plain_scores(one.scores),
            }
            for candidate, by_leak in tried.found.items()
            for leak, by_course in by_leak.items()
            for course, one in by_course.items()
        ],
    }


def _tried(plain: dict[str, Any]) -> Tried:
    tried = Tried(way=plain["way"])
    tried.lacking = {name: tuple(columns) for name, columns in plain["lacking"].items()}
    for one in plain["found"]:
        by_course = tried.found.setdefault(one["candidate"], {}).setdefault(one["leak"], {})
        by_course[one["course"]] = OnGrid(tally=_tally(one["tally"]), scores=_scores(one["scores"]))
    return tried


TRIED = Form(plain=_plain_tried, result=_tried)
"""Of grids on a log."""


def _plain_replayed(replayed: Replayed) -> dict[str, Any]:
    return {
        **vars(replayed),
        "courses": {
            condition: [
                {
                    **vars(one),
                    "tally": _plain_tally(one.tally),
                    "scores": [one.scores[False], one.scores[True]],
                }
                for one in by_course.values()
            ]
            for condition, by_course in replayed.courses.items()
        },
    }


def _replayed(plain: dict[str, Any]) -> Replayed:
    courses: dict[str, list[dict[str, Any]]] = plain.pop("courses")
    return Replayed(
        **plain,
        courses={
            condition: {one["course"]: _on_course(**one) for one in of}
            for condition, of in courses.items()
        },
    )


def _on_course(*, tally: dict[str, Any], scores: list[Any], **others: Any) -> OnCourse:
    smooth, rough = scores
    return OnCourse(tally=_tally(tally), scores={True: rough, False: smooth}, **others)


REPLAYED = Form(plain=_plain_replayed, result=_replayed)
"""Of conditions with their numbers on a log."""

EXAMPLES = Form[Examples](plain=vars, result=lambda plain: Examples(**plain))
"""Of a log, for the classifier."""
