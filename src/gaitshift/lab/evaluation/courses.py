"""The standard courses: grounds on which logs for identification are recorded."""

from collections.abc import Callable
from dataclasses import dataclass

from gaitshift.control import Controller
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation.evaluate import EvaluationConfig, run_controller
from gaitshift.lab.log import Log
from gaitshift.sim.sensor_config import PERFECT, SensorConfig

AMPLITUDES = (0.05, 0.07, 0.10, 0.15, 0.20)
"""Amplitudes of the noise that robots walk onto and off [m]."""

_UNTIL = (10.0, 18.0, 12.0, 16.0, 14.0)
"""Where the noise ends that robots walk off, for each amplitude [m]. The places differ, because
otherwise a clock would be the best detector of the end."""


@dataclass(frozen=True, kw_only=True)
class Course:
    """A ground to record on."""

    name: str
    """Name, valid as part of a file name."""
    terrain: str
    """Its spec; robots start 2 m after the beginning of the ground."""


def _smooth() -> tuple[Course, ...]:
    """Courses that a condition should treat as smooth."""
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
"""Ours: one edge every 6 m, ten stairs up and down every 9 m, 10 m of noise between level ground,
and noise from the start on that ends 8 to 16 m after the robots' start."""


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
    controller: Controller,
    course: Course,
    *,
    seconds: float,
    seed: int,
    sensors: SensorConfig = PERFECT,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Log:
    """Robots in one gait on a course, on eight grounds of a seed where the ground is random."""
    config = EvaluationConfig(
        terrain=course.terrain,
        episodes=controller.n,
        seconds=seconds,
        sensors=sensors,
        seed=seed,
    )
    return run_controller(controller, config, values=True, report=report)
