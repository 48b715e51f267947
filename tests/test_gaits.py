"""The shipped gaits against a table written by hand, and the gaits others may write."""

from pathlib import Path

import numpy as np
import pytest

from gaitshift import gaits
from gaitshift.errors import GaitshiftError
from gaitshift.reward_machine import RewardMachine, draw

SHIPPED = {
    # gait: (stances in turn, ideal phases FL FR BL BR, its states in a mirror)
    "bound": (["FL FR", "BL BR"], (0.0, 0.0, 0.5, 0.5), (0, 1)),
    "pace": (["FL BL", "FR BR"], (0.0, 0.5, 0.0, 0.5), (1, 0)),
    "trot": (["FL BR", "FR BL"], (0.0, 0.5, 0.5, 0.0), (1, 0)),
}
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
    "pronk": (
        """
        state = [
            { name = "all", stance = ["FL", "FR", "BL", "BR"] },
            { name = "none", stance = [] },
        ]
        transition = [
            { from = "all", to = "none", down = [], up = ["FL", "FR", "BL", "BR"] },
            { from = "none", to = "all", down = ["FL", "FR", "BL", "BR"], up = [] },
        ]
        """,
        ["FL FR BL BR", ""],
        (0, 1),
    ),
    "walk": (
        """
        state = [
            { name = "FL_lifted", stance = ["FR", "BL", "BR"] },
            { name = "BR_lifted", stance = ["FL", "FR", "BL"] },
            { name = "FR_lifted", stance = ["FL", "BL", "BR"] },
            { name = "BL_lifted", stance = ["FL", "FR", "BR"] },
        ]
        transition = [
            { from = "FL_lifted", to = "BR_lifted", down = ["FL", "FR", "BL"], up = ["BR"] },
            { from = "BR_lifted", to = "FR_lifted", down = ["FL", "BL", "BR"], up = ["FR"] },
            { from = "FR_lifted", to = "BL_lifted", down = ["FL", "FR", "BR"], up = ["BL"] },
            { from = "BL_lifted", to = "FL_lifted", down = ["FR", "BL", "BR"], up = ["FL"] },
        ]
        """,
        ["FR BL BR", "FL FR BL", "FL BL BR", "FL FR BR"],
        (2, 3, 0, 1),
    ),
    "three-one": (
        """
        state = [
            { name = "FL_and_hind", stance = ["FL", "BL", "BR"] },
            { name = "FL", stance = ["FL"] },
            { name = "FR_and_hind", stance = ["FR", "BL", "BR"] },
            { name = "FR", stance = ["FR"] },
        ]
        transition = [
            { from = "FL_and_hind", to = "FL", down = ["FL"], up = ["FR", "BL", "BR"] },
            { from = "FL", to = "FR_and_hind", down = ["FR", "BL", "BR"], up = ["FL"], dwell = 6 },
            { from = "FR_and_hind", to = "FR", down = ["FR"], up = ["FL", "BL", "BR"] },
            { from = "FR", to = "FL_and_hind", down = ["FL", "BL", "BR"], up = ["FR"], dwell = 6 },
        ]
        """,
        ["FL BL BR", "FL", "FR BL BR", "FR"],
        (2, 3, 0, 1),
    ),
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
    return np.array([[foot in stance.split() for foot in ("FL", "FR", "BL", "BR")]])


def assert_stances_in_turn_walk_the_states(machine, stances):
    """Shown one after the other, the stances lead through the states and back to the first."""
    state = np.array([machine.initial])
    for i, stance in enumerate([*stances[1:], stances[0]], start=1):
        told = machine.step(state, contact(stance), np.full((1, 4), 0.1), np.array([30]))
        assert (told.state[0], told.changed[0]) == (i % len(stances), True)
        assert machine.shows_state(told.state, contact(stance))[0]
        state = told.state


def test_every_shipped_gait_stands_in_the_table():
    assert gaits.names() == tuple(sorted(SHIPPED))


@pytest.mark.parametrize("name", sorted(SHIPPED))
def test_a_shipped_gait_is_what_the_table_says(name):
    stances, phases, mirror = SHIPPED[name]
    machine = gaits.load(name)
    assert machine.name == name
    assert machine.ideal_phase == phases
    assert machine.accepting == ()
    assert len(machine.states) == len(stances)
    assert machine.mirrored_states() == mirror
    assert_stances_in_turn_walk_the_states(machine, stances)
    assert RewardMachine.from_dict(machine.to_dict()) == machine
    for edge in machine.edges:
        assert (edge.guard.dwell, edge.guard.swing_height, edge.bonus) == (20, 0.03, 1.0)
        assert edge.guard.down | edge.guard.up == {"FL", "FR", "BL", "BR"}


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
        told = machine.step(np.array([start]), contact(stance), np.ones((1, 4)), np.array([30]))
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
        ("trott", r"unknown gait 'trott'; did you mean 'trot'\? gaits are bound, pace, trot"),
        ("gallop", "unknown gait 'gallop'; gaits are bound, pace, trot; for a file of your own"),
        ("", "unknown gait ''; gaits are"),
        ("../gaits/trot", "unknown gait"),
        ("no/such.toml", "no/such.toml: there is no such file"),
        (Path("trot"), "trot: there is no such file"),
    ],
)
def test_an_unknown_gait_is_refused_with_those_there_are(name, message):
    with pytest.raises(GaitshiftError, match=message):
        gaits.load(name)
