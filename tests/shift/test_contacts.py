"""The filter of contacts against tables written by hand."""

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.shift.statistics.contacts import ContactFilter

PERIOD = 0.01


def filtered(felt, **times):
    """Whether a foot stands, step by step, as 0 and 1; `felt` likewise."""
    contacts, feet = ContactFilter(**times), []
    state = contacts.start(1)
    for foot in felt:
        state = contacts.step(state, np.full((1, 4), foot == "1"), PERIOD)
        assert (state.down == state.down[0, 0]).all()
        feet.append("01"[int(state.down[0, 0])])
    return "".join(feet)


@pytest.mark.parametrize(
    ("times", "felt", "stands"),
    [
        ({}, "0110100", "0110100"),
        ({"least_stance": 0.03}, "0110111110100", "0000001110000"),
        ({"least_stance": 0.03}, "1111", "0011"),
        ({"least_swing": 0.02}, "1110111001", "1111111101"),
        ({"least_stance": 0.02, "least_swing": 0.02}, "0101101110100", "0000111111110"),
    ],
)
def test_a_foot_stands_and_swings_when_it_is_felt_so_for_long_enough(times, felt, stands):
    assert filtered(felt, **times) == stands


def test_a_log_of_another_period_has_the_same_times():
    contacts = ContactFilter(least_stance=0.02)
    state, down = contacts.start(1), []
    for _ in range(5):
        state = contacts.step(state, np.ones((1, 4), dtype=bool), 0.0025)
        down.append(bool(state.down[0, 0]))
    assert not any(down)
    for _ in range(3):
        state = contacts.step(state, np.ones((1, 4), dtype=bool), 0.0025)
    assert state.down.all()


@pytest.mark.parametrize("name", ["least_stance", "least_swing"])
@pytest.mark.parametrize("time", [-0.01, 2.0, float("nan")])
def test_times_are_checked(name, time):
    with pytest.raises(GaitshiftError, match=f"{name} must be 0 to 1, got"):
        ContactFilter(**{name: time})
