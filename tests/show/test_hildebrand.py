"""The gait diagram and the circle of phases show the figures they are given."""

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.gait_analysis import measure
from gaitshift.robot.description import ANYMAL_B
from gaitshift.show.plots import gait_colours, hildebrand_diagram
from synthetic import TABLE, contacts, log_of


def diagram(gait, path):
    touchdowns, duty = TABLE[gait]
    machine = gaits.load(gait)
    log = log_of(contacts(touchdowns, duty, frequency=1.6, robots=3), gaits=(gait,))
    figures = measure(log, {gait: machine}, ANYMAL_B)
    return hildebrand_diagram(log, figures, machine, path), figures


def words(figure):
    return [text.get_text() for axes in figure.axes for text in axes.texts]


@pytest.mark.parametrize("gait", [name for name in gaits.names() if name != "stand"])
def test_every_gait_has_its_diagram(gait, tmp_path):
    figure, figures = diagram(gait, tmp_path / "gait.svg")
    shown = words(figure)
    for duty in figures["duty_factor"]:
        assert f"{duty:.2f}" in shown
    assert any(gait in text.get_text() for text in figure.texts)


def test_marks_stand_at_the_phases_and_feet_that_come_down_twice_have_two(tmp_path):
    """Three-one: FL at 0, FR at a half, hind feet at both."""
    figure, _ = diagram("three_one", tmp_path / "gait.png")
    circle = figure.axes[1]
    marks = [line for line in circle.get_lines() if line.get_marker() == "o"]
    hollow = [line for line in marks if line.get_markerfacecolor() == "none"]
    assert len(hollow) == len(marks) - len(hollow) == 6
    for some in (hollow, [line for line in marks if line not in hollow]):
        angles = np.array([float(np.ravel(line.get_xdata())[0]) for line in some])
        halves = angles / np.pi
        assert np.abs(halves - np.rint(halves)).max() < 0.03


def test_shipped_gaits_have_eight_colours():
    assert len(set(gait_colours(gaits.names()).values())) == len(gaits.names())


def test_a_robot_that_stands_has_a_diagram_without_touchdowns(tmp_path):
    machine = gaits.load("stand")
    log = log_of(np.ones((500, 2, 4), dtype=bool), gaits=("stand",))
    figures = measure(log, {"stand": machine}, ANYMAL_B)
    path = tmp_path / "stand.png"
    hildebrand_diagram(log, figures, machine, path)
    assert path.stat().st_size > 10_000


def test_no_robot_no_diagram(tmp_path):
    machine = gaits.load("trot")
    log = log_of(contacts(*TABLE["trot"], frequency=2.5))
    figures = measure(log, {"trot": machine}, ANYMAL_B)
    with pytest.raises(GaitshiftError, match=r"robot must be .*, got 9"):
        hildebrand_diagram(log, figures, machine, tmp_path / "gait.png", robot=9)
