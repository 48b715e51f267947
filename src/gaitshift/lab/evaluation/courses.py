"""The standard courses: grounds to record on, for conditions to be identified with."""

from collections.abc import Callable
from dataclasses import dataclass

from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.evaluate import EvaluationConfig, run_policy
from gaitshift.lab.log import Log

AMPLITUDES = (0.05, 0.07, 0.10, 0.15, 0.20)
"""Of the noise that robots walk into, and out of [m]."""

_UNTIL = (10.0, 18.0, 12.0, 16.0, 14.0)
"""Where the noise ends that robots walk out of, amplitude by amplitude [m]: were it always the same
place, a clock would notice it best."""


@dataclass(frozen=True, kw_only=True)
class Course:
    """A ground to record on."""

    name: str
    """In words that a file name may have."""
    terrain: str
    """Its spec; robots start 2 m after its beginning."""


def _smooth() -> tuple[Course, ...]:
    """What a condition should take for smooth."""
    steps, stairs = ",".join(["step:0.05@6"] * 5), ",".join(["stairs:0.05@9"] * 4)
    return (
        Course(name="flat", terrain="flat"),
        *(
            Course(name=f"{way}-{degrees}", terrain=f"flat@4,slope:{sign}{degrees}@8,flat@20")
            for degrees in (10, 15)
            for way, sign in (("up", ""), ("down", "-"))
        ),
        Course(name="across-10", terrain="bank:10"),
        Course(name="steps-5cm", terrain=f"flat@4,{steps}"),
        Course(name="stairs-5cm", terrain=f"flat@4,{stairs}"),
        Course(name="pebbles-4cm", terrain="flat@4,pebbles:0.04@30"),
    )


COURSES = (
    *_smooth(),
    *(
        Course(name=f"into-{a:.2f}", terrain=f"flat@6,perlin:{a:.2f}@10,flat@18")
        for a in AMPLITUDES
    ),
    *(
        Course(name=f"out-of-{a:.2f}", terrain=f"perlin:{a:.2f}@{end:g},flat@22")
        for a, end in zip(AMPLITUDES, _UNTIL, strict=True)
    ),
)
"""Ours: one edge every 6 m, ten stairs up and down every 9 m, noise of 10 m between level ground,
and noise from the start that ends after 8 to 16 m."""


def select(names: tuple[str, ...]) -> tuple[Course, ...]:
    """The courses of these names; all if none.

    Raises:
        GaitshiftError: no such course.
    """
    known = tuple(course.name for course in COURSES)
    unknown = [name for name in names if name not in known]
    if unknown:
        raise GaitshiftError(f"course must be one of {', '.join(known)}, got '{unknown[0]}'")
    return tuple(course for course in COURSES if not names or course.name in names)


def run_course(
    policy: Policy,
    course: Course,
    *,
    robots: int,
    seconds: float,
    seed: int,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Log:
    """Robots in one gait on a course, on eight grounds of a seed where the ground is random."""
    config = EvaluationConfig(terrain=course.terrain, episodes=robots, seconds=seconds, seed=seed)
    return run_policy(policy, config, values=True, report=report)
