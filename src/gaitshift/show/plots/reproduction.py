"""The figures of a reproduction: the paper's Fig. 1, its Figs. 2 to 4, and the ablations."""

from collections.abc import Mapping
from pathlib import Path

from gaitshift.lab.log import Log
from gaitshift.lab.reproduction.judging import JudgedPolicy, middle
from gaitshift.lab.reproduction.plan import (
    ABLATIONS,
    AS_IN_THE_PAPER,
    PLATEAU,
    START,
    ZERO_CROSSING,
)
from gaitshift.lab.reproduction.results import Results, Seeds
from gaitshift.robot.command import PAPER_SPEED
from gaitshift.show.plots import contact_diagram
from gaitshift.show.plots.learning import Courses, Landmarks, comparison_curves, reward_curves

REWARDS, COMPARISONS = "reward.png", "ablations.png"

CONTACT_TIME = 2.0
"""Length of a contact diagram [s], as in the paper."""


def draw(results: Results, judged: list[JudgedPolicy], out: Path) -> list[str]:
    """Draws all available figures into `out`; returns the names of the files."""
    drawn: list[str] = []
    rewards = {gait: _columns(seeds, "reward") for gait, seeds in results.gaits()}
    rewards = {gait: curves for gait, curves in rewards.items() if curves}
    if rewards:
        landmarks = Landmarks(start=START, plateau=PLATEAU, zero_crossing=ZERO_CROSSING)
        reward_curves(rewards, landmarks, out / REWARDS)
        drawn.append(REWARDS)
    for gait in rewards:
        shown = middle(judged, gait)
        if shown is not None:
            path = out / f"contacts-{gait}.png"
            if shown.log is not None:
                _draw_contacts(shown.log, path)
            if path.is_file():  # drawn now, or by an earlier report
                drawn.append(path.name)
    panels = _panels(results)
    if panels:
        comparison_curves(panels, out / COMPARISONS, aim=PAPER_SPEED)
        drawn.append(COMPARISONS)
    return drawn


def _draw_contacts(log: Log, path: Path) -> None:
    """The last two seconds of the first robot that is still on its feet (else of the first)."""
    upright = (~log.fallen[-1]).nonzero()[0]
    robot = int(upright[0]) if upright.size else 0
    end = float(log.time[-1])
    contact_diagram(log, path, robot, t0=end - CONTACT_TIME, t1=end)


def _panels(results: Results) -> Mapping[str, Mapping[str, Courses]]:
    """Speeds by group and label, the reference first."""
    reference = results.reference
    panels: dict[str, dict[str, Courses]] = {}
    if reference is None:
        return panels
    ablations = dict(results.ablations())
    for setting in ABLATIONS:
        if setting.name in ablations:
            first = {AS_IN_THE_PAPER[setting.group]: _columns(reference, "speed")}
            panel = panels.setdefault(setting.group, first)
            panel[setting.label] = _columns(ablations[setting.name], "speed")
    return {
        group: {label: curves for label, curves in panel.items() if curves}
        for group, panel in panels.items()
    }


def _columns(seeds: Seeds, column: str) -> Courses:
    """One column of every run that has a curve."""
    return [getattr(curve, column) for curve in seeds.curves if len(curve)]
