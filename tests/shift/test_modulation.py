"""α that follows speed and time, straight between given points."""

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.shift import HeightDifference, Modulation, Rule, there_and_back
from sensing import ONE_UP, standing


def test_alpha_follows_speed_and_time():
    by_speed = Modulation(of="speed", points=((0.5, 1.0), (1.5, 3.0)))
    factor = by_speed.factor(standing(3, forward_speed_command=np.array([0.2, 1.0, 9.0])))
    np.testing.assert_allclose(factor, [1.0, 2.0, 3.0])
    graph = there_and_back(
        HeightDifference(),
        Rule(alpha=0.05, beta=200.0),
        Rule(when="below", alpha=0.035, beta=350.0),
        modulation=Modulation(of="time", points=((1, 1), (2, 4))),
    )
    for time, counts in ((0.0, 3), (1.2, 3), (1.6, 0)):  # α of 5 cm, 8 cm, 14 cm
        _, decision = graph.step(graph.begin(1), standing(feet=ONE_UP, time=time))
        assert decision.k.item() == counts


def test_alpha_over_speed_needs_the_commanded_speed():
    with pytest.raises(GaitshiftError, match="needs 'forward_speed_command'"):
        Modulation(of="speed", points=((0.5, 1.0),)).factor(standing())


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ((), "points must be pairs"),
        (((1.0, 1.0), (1.0, 2.0)), "rising"),
        (((0.0, -1.0),), "above 0"),
    ],
)
def test_a_faulty_modulation_is_refused_with_what_is_allowed(points, message):
    with pytest.raises(GaitshiftError, match=message):
        Modulation(of="speed", points=points)
