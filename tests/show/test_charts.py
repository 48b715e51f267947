"""Charts beside the robots on a page: the tape that they are drawn of, and what is drawn."""

import re

import numpy as np
import pytest

from gaitshift.gait import gaits
from gaitshift.show.viewer.charts import (
    WINDOW,
    Tape,
    contact_svg,
    counter,
    foot_heights,
    machine_svg,
)
from walking import live_run, walk


def test_a_tape_keeps_the_window_and_forgets_what_lies_ahead():
    run, tape = live_run(track="flat@40"), Tape()
    frames = walk(run, WINDOW + 1.0)
    for frame in frames:
        tape.add(frame)
    time_ = tape.of("time")
    assert (time_[-1], len(time_)) == (pytest.approx(WINDOW + 1.0), round(100 * WINDOW) + 1)
    tape.add(frames[400])
    assert tape.of("time")[-1] == frames[400].time
    assert (np.diff(tape.of("time")) > 0).all()


def test_the_diagram_has_a_bar_for_each_time_that_a_foot_is_down():
    run, tape = live_run(track="flat@40", is_autonomous=False), Tape()
    for frame in walk(run, 4.0):
        tape.add(frame)
    contact = tape.of("contact").astype(int)
    stances = int((np.diff(contact, axis=0) > 0).sum() + contact[0].sum())
    svg = contact_svg(tape, ("#111111", "#222222", "#333333"))
    bars = re.findall(r'width="([\d.]+)" height="12" fill="#111111"', svg)
    assert len(bars) == stances > 20
    # 300 units are the window.
    assert sum(map(float, bars)) == pytest.approx(300 * contact.sum() / 100 / WINDOW, rel=0.05)


@pytest.mark.parametrize("name", gaits.names())
def test_the_present_state_of_the_machine_is_lit(name):
    machine = gaits.load(name)
    for state, one in enumerate(machine.states):
        svg = machine_svg(machine, state, "#123456")
        (lit,) = re.findall(r'fill="#123456".*?>([A-Z a-z]+)</text>', svg)
        assert set(lit.split()) == (set(one.stance) or {"no", "foot"})
        assert svg.count("<g>") == len(machine.states)


def test_the_chart_of_k_marks_shifts_where_they_are_and_nowhere_else():
    run, tape = live_run(track="flat@40", is_autonomous=False), Tape()
    for _ in range(40):
        tape.add(run.step())
    run.take("bound")
    for _ in range(40):
        tape.add(run.step())
    _, _, shift = counter(tape)
    assert np.flatnonzero(shift).tolist() == [40]


def test_the_chart_of_heights_is_silent_of_feet_that_have_not_touched():
    run, tape = live_run(track="flat@40"), Tape()
    for _ in range(60):
        tape.add(run.step())
    touched = np.logical_or.accumulate(tape.of("contact"), axis=0)
    assert not touched[0].all()
    assert touched[-1].all()
    heights = foot_heights(tape)
    assert np.array_equal(np.isfinite(heights), touched)
    assert (heights[touched] < -0.3).all(), "below the base"
