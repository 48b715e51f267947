"""The shipped gaits against a table written by hand, and the gaits others may write."""

from pathlib import Path

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, draw, gaits

FEET = ("FL", "FR", "BL", "BR")
SHIPPED = {
    # gait: (stances in turn, ideal phases, touchdowns on a cycle, its states in a mirror)
    "bound": (["FL FR", "BL BR"], (0.0, 0.0, 0.5, 0.5), (1, 1, 1, 1), (0, 1)),
    "gallop": (["BR", "BL", "FR", "FL"], (0.0, 0.8, 0.5, 0.3), (1, 1, 1, 1), None),
    "half_bound": (
        ["FL FR", "BR", "FL FR", "BL"],
        (0.0, 0.0, 0.5, 0.5),
        (2, 2, 1, 1),
        (2, 3, 0, 1),
    ),
    "pace": (["FL BL", "FR BR"], (0.0, 0.5, 0.0, 0.5), (1, 1, 1, 1), (1, 0)),
    "pronk": (["FL FR BL BR", ""], (0.0, 0.0, 0.0, 0.0), (1, 1, 1, 1), (0, 1)),
    "three_one": (
        ["FL BL BR", "FL", "FR BL BR", "FR"],
        (0.0, 0.5, 0.0, 0.0),
        (1, 1, 2, 2),
        (2, 3, 0, 1),
    ),
    "trot": (["FL BR", "FR BL"], (0.0, 0.5, 0.5, 0.0), (1, 1, 1, 1), (1, 0)),
    "walk": (
        ["FR BL BR", "FL FR BL", "FL BL BR", "FL FR BR"],
        (0.0, 0.5, 0.75, 0.25),
        (1, 1, 1, 1),
        (2, 3, 0, 1),
    ),
}
"""Dwells, heights and speeds are found by training, and stand in the gait files alone."""
HEAD = """
name = "{name}"
title = "A gait of mine"
description = "Written by a user."
dwell = 12
swing_height = 0.03
ideal_phase = {{ FL = 0, FR = 0.5, BL = 0.75, BR = 0.25 }}
"""
OTHERS = {
    # gait: (its tables, stances in turn, its states in a mirror)
    "half-bound": (
        """
        state = [
            { name = "front_then_BR", stance = ["FL", "FR"] },
            { name = "BR", stance = ["BR"] },
            { name = "front_then_BL", stance = ["FL", "FR"] },
            { name = "BL", stance = ["BL"] },
            { name = "sink", accepting = true },
        ]
        transition = [
            { from = "front_then_BR", to = "BR", down = ["BR"], up = ["FL", "FR", "BL"] },
            { from = "front_then_BR", to = "sink", down = ["BL"], up = ["FL", "FR"], bonus = 0 },
            { from = "BR", to = "front_then_BL", down = ["FL", "FR"], up = ["BL", "BR"] },
            { from = "front_then_BL", to = "BL", down = ["BL"], up = ["FL", "FR", "BR"] },
            { from = "front_then_BL", to = "sink", down = ["BR"], up = ["FL", "FR"], bonus = 0 },
            { from = "BL", to = "front_then_BR", down = ["FL", "FR"], up = ["BL", "BR"] },
        ]
        """,
        ["FL FR", "BR", "FL FR", "BL"],
        (2, 3, 0, 1, 4),
    ),
    "left-lead": (
        """
        state = [
            { name = "hind", stance = ["BL", "BR"] },
            { name = "FR", stance = ["FR"] },
            { name = "FL", stance = ["FL"] },
        ]
        transition = [
            { from = "hind", to = "FR", down = ["FR"], up = ["FL", "BL", "BR"] },
            { from = "FR", to = "FL", down = ["FL"], up = ["FR", "BL", "BR"] },
            { from = "FL", to = "hind", down = ["BL", "BR"], up = ["FL", "FR"] },
        ]
        """,
        ["BL BR", "FR", "FL"],
        None,
    ),
}


def contact(stance):
    return np.array([[foot in stance.split() for foot in FEET]])


def assert_stances_in_turn_walk_the_states(machine, stances):
    """Shown one after the other, the stances lead through the states and back to the first."""
    state = np.array([machine.initial])
    for i, stance in enumerate([*stances[1:], stances[0]], start=1):
        told = machine.step(state, contact(stance), np.array([30]))
        assert (told.state[0], told.changed[0]) == (i % len(stances), True)
        assert machine.shows_state(told.state, contact(stance))[0]
        state = told.state


def test_every_shipped_gait_stands_in_the_table():
    assert gaits.names() == tuple(sorted([*SHIPPED, "stand"]))


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_a_shipped_gait_is_what_the_table_says(name):
    stances, phases, touchdowns, mirror = SHIPPED[name]
    machine = gaits.load(name)
    assert machine.name == name
    assert machine.ideal_phase == phases
    assert machine.accepting == ()
    assert len(machine.states) == len(stances)
    assert machine.mirrored_states() == mirror
    assert machine.cycle == tuple(range(len(stances)))
    assert machine.touchdowns == touchdowns
    assert_stances_in_turn_walk_the_states(machine, stances)
    assert RewardMachine.from_dict(machine.to_dict()) == machine
    for edge in machine.edges:
        assert edge.guard.down | edge.guard.up == set(FEET)
        assert edge.swing_height > 0
        assert edge.bonus == 1.0


def test_the_gait_that_stands_has_one_state_and_no_stride():
    machine = gaits.load("stand")
    assert machine.stands
    assert not any(gaits.load(name).stands for name in SHIPPED)
    assert [state.stance for state in machine.states] == [frozenset(FEET)]
    assert (machine.cycle, machine.touchdowns, machine.speed_range) == ((), (0,) * 4, (0.0, 0.0))
    assert machine.mirrored_states() == (0,)
    assert RewardMachine.from_dict(machine.to_dict()) == machine
    label = np.array([[False] * 4, [True] * 4, [True, False, True, True]])
    told = machine.step(np.zeros(3, dtype=int), label, np.array([0, 50, 900]))
    assert (told.state.tolist(), told.changed.any(), told.bonus.tolist()) == (
        [0] * 3,
        False,
        [0.0] * 3,
    )
    assert machine.agreement(told.state, label).tolist() == [0.0, 1.0, 0.75]
    assert machine.punctuality(told.state, np.array([0, 50, 900])).tolist() == [1.0] * 3


def onsets(name):
    """Steps of an ideal cycle in which each foot comes down, and the length of the cycle.

    The stances of the table, each shown for as long as the guard of the edge that leaves it asks.
    """
    machine = gaits.load(name)
    shown = [
        (stance, edge.guard.dwell)
        for stance, edge in zip(SHIPPED[name][0], machine.edges, strict=True)
    ]
    feet = [[foot in stance.split() for foot in FEET] for stance, dwell in shown]
    down = np.repeat(feet, [dwell for _, dwell in shown], axis=0)
    began = down & ~np.roll(down, 1, axis=0)
    return [np.flatnonzero(began[:, foot]) for foot in range(4)], len(down)


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_ideal_phases_and_touchdowns_are_those_of_the_cycle_walked_step_by_step(name):
    machine, (steps, length) = gaits.load(name), onsets(name)
    assert machine.stride() == length
    assert machine.touchdowns == tuple(len(onset) for onset in steps)
    # A phase is the time since FL came down over its stride, which is half of a cycle in the
    # half-bound. The hind feet of the three-one come down twice in it: one of them is the norm.
    stride = length / len(steps[0])
    for foot, ideal in enumerate(machine.ideal_phase):
        phases = (steps[foot] - steps[0][0]) / stride
        away = np.abs((phases - ideal + 0.5) % 1.0 - 0.5)
        assert away.min() < 0.01, f"{FEET[foot]} comes down at {phases}, not {ideal}"


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_what_may_be_commanded_of_a_gait_lies_about_its_own(name):
    machine = gaits.load(name)
    slow, fast = machine.speed_range
    assert 0 <= slow < machine.speed < fast
    low, high = machine.height_range
    assert low <= machine.height <= high
    assert machine.dwell_range[0] <= machine.dwell <= machine.dwell_range[1]
    # Every dwell in range is reached by the stride it makes, or by one that makes the same.
    for dwell in range(machine.dwell_range[0], machine.dwell_range[1] + 1):
        reached = machine.dwell_for(np.array([float(machine.stride(dwell))])).item()
        assert machine.stride(reached) == machine.stride(dwell)


def test_the_single_foot_phases_of_the_three_one_are_half_as_long():
    times = [edge.guard.dwell for edge in gaits.load("three_one").edges]
    assert times[0] == times[2]
    assert times[1] == times[3] == pytest.approx(times[0] / 2, abs=0.5)


@pytest.mark.parametrize("name", sorted(OTHERS))
def test_a_gait_of_another_kind_is_one_file(name, tmp_path):
    tables, stances, mirror = OTHERS[name]
    path = tmp_path / f"{name}.toml"
    path.write_text(HEAD.format(name=name) + tables, encoding="utf-8")
    machine = gaits.load(path)
    assert gaits.load(str(path)) == machine
    assert machine.mirrored_states() == mirror
    assert_stances_in_turn_walk_the_states(machine, stances)
    draw(machine, tmp_path / "gait.png")


def test_half_bound_ends_on_the_wrong_hind_foot(tmp_path):
    path = tmp_path / "half-bound.toml"
    path.write_text(HEAD.format(name="half-bound") + OTHERS["half-bound"][0], encoding="utf-8")
    machine = gaits.load(path)
    assert machine.accepting == (4,)
    for start, stance, reached in ((0, "BL", 4), (0, "BL BR", 4), (2, "BR", 4), (2, "BL", 3)):
        told = machine.step(np.array([start]), contact(stance), np.array([30]))
        assert told.state[0] == reached
        assert told.bonus[0] == (0.0 if reached == 4 else 1.0)


def test_a_file_with_windows_line_ends_and_a_byte_order_mark_loads(tmp_path):
    shipped = Path(gaits.__file__).with_name("trot.toml").read_bytes()
    path = tmp_path / "trot.toml"
    path.write_bytes(b"\xef\xbb\xbf" + shipped.replace(b"\n", b"\r\n"))
    assert gaits.load(path) == gaits.load("trot")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "trott",
            r"unknown gait 'trott'; did you mean 'trot'\? known gaits: bound, gallop, half_bound,"
            " pace, pronk, stand, three_one, trot, walk; or give the path of a .toml file",
        ),
        ("canter", "unknown gait 'canter'; known gaits: bound, gallop"),
        ("", "unknown gait ''; known gaits: "),
        ("../gaits/trot", "unknown gait"),
        ("no/such.toml", "no/such.toml: no such file"),
        (Path("trot"), "trot: no such file"),
    ],
)
def test_an_unknown_gait_is_refused_with_those_there_are(name, message):
    with pytest.raises(GaitshiftError, match=message):
        gaits.load(name)


@pytest.mark.parametrize(
    ("gait", "state", "steps", "dwell", "wait"),
    [
        ("trot", 0, 0, None, 19),  # 20 steps, of which the first ends now
        ("trot", 1, 19, None, 0),
        ("trot", 1, 40, None, 0),
        ("trot", 0, 5, 30, 24),
        ("gallop", 0, 3, None, 4),  # its states last 8 and 12 steps in turn
        ("gallop", 1, 3, None, 8),
        ("gallop", 1, 0, 14, 16),  # 1.2 times 14 is 16.8, and the seventeenth step may change
    ],
)
def test_the_wait_is_the_steps_until_the_lock_out_opens(gait, state, steps, dwell, wait):
    told = gaits.load(gait).wait(np.array([state]), np.array([steps]), dwell)
    assert told.tolist() == [wait]


def test_feet_are_lifted_by_a_change_that_takes_them_out_of_the_stance():
    walk = gaits.load("walk")  # FL, BR, FR, BL are up in turn
    told = walk.lifted(np.array([0, 1, 3, 2]), np.array([1, 2, 0, 2]))
    assert told.astype(int).tolist() == [[0, 0, 0, 1], [0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0]]
