"""The counter k: constant input in closed form, the leak, and what no rule can have."""

import math

import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.shift import Rule, load_graph, ways
from sensing import PERIOD


@pytest.mark.parametrize(("counts", "leak"), [(6, 0.0), (4, 0.5), (1, 0.5), (1, 1.0), (0, 0.5)])
def test_on_constant_input_k_rises_by_epsilon_counts_less_leak_and_fires_when_told(counts, leak):
    rule = Rule(alpha=0.1, beta=50.0, epsilon=1.0, leak=leak)
    values = np.array([[0.2] * counts + [0.0] * (6 - counts)])
    k, fired = np.zeros(1), []
    for step in range(1, 301):
        k = rule.step(k, values)
        assert k[0] == pytest.approx(max(step * (counts - leak), 0.0))
        if rule.fires(k, np.array([step * PERIOD]))[0]:
            fired.append(step)
    expected = rule.delay(counts)
    assert (fired[:1] or [math.inf])[0] * PERIOD == pytest.approx(expected)


def test_beta_in_time_is_when_a_robot_fires_whose_values_all_count():
    """The paper's 1000 counts at 100 Hz: 6 pairs, so the 167th step."""
    there, back = (edge.rule for edge in ways(load_graph("paper")))
    assert there.soonest(6) == pytest.approx(1.67)
    assert back.soonest(6) == pytest.approx(10.01), "below counts steps, not pairs"
    k, steps = np.zeros(1), 0
    while not there.fires(k, np.ones(1))[0]:
        k, steps = there.step(k, np.full((1, 6), 0.3)), steps + 1
    assert steps == 167


def test_k_leaks_to_zero_and_no_further():
    rule = Rule(alpha=0.1, beta=50.0, leak=0.5)
    k = np.array([1.2])
    seen = [(k := rule.step(k, np.array([[0.0]]))).item() for _ in range(4)]
    assert seen == pytest.approx([0.7, 0.2, 0.0, 0.0])


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"alpha": 0.0}, "alpha must be above 0 and finite, got 0.0"),
        ({"beta": -1.0}, "beta must be 0 or more and finite, got -1.0"),
        ({"epsilon": math.inf}, "epsilon must be above 0 and finite, got inf"),
        ({"alpha": math.nan}, "alpha must be above 0 and finite, got nan"),
        ({"leak": -0.1}, "leak must be 0 or more and finite, got -0.1"),
        ({"hold": math.nan}, "hold must be 0 or more and finite, got nan"),
    ],
)
def test_a_number_that_no_rule_can_have_is_refused_with_what_is_allowed(wrong, message):
    with pytest.raises(GaitshiftError) as caught:
        Rule(**({"alpha": 0.1, "beta": 1.0} | wrong))
    assert str(caught.value) == message
