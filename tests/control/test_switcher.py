"""Switchers: who shifts when, by the conditions of a graph or by a schedule."""

from dataclasses import replace

import numpy as np
import pytest

from driving import exported, gaits_of, sensed_of, staggering
from gaitshift.control import Autonomous, Driver, Scheduled, Switcher
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.robot.command import Command
from gaitshift.shift import (
    Edge,
    GaitGraph,
    HeightDifference,
    Oracle,
    Rule,
    between,
    load_graph,
    there_and_back,
    tuned,
)
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import World

GRAPH = there_and_back(
    HeightDifference(), Rule(alpha=0.05, beta=7.0), Rule(when="below", alpha=0.03, beta=3.0)
)
LEVEL, ONE_UP, TWO_UP = [0.0, 0.01, 0.02, 0.0], [0.0, 0.1, 0.0, 0.0], [0.1, 0.1, 0.0, 0.0]
"""Feet on ground of pairs none, three and four of which differ by more than α."""
TIMELINE = [
    # robot 0:  ground, gait after it, k, threshold     | robot 1
    (LEVEL, "trot", 0, 7, TWO_UP, "trot", 4, 7),
    (LEVEL, "trot", 0, 7, TWO_UP, "bound", 8, 7),  # 8 > 7
    (ONE_UP, "trot", 3, 7, LEVEL, "bound", 1, 3),
    (ONE_UP, "trot", 6, 7, LEVEL, "bound", 2, 3),
    (ONE_UP, "bound", 9, 7, LEVEL, "bound", 3, 3),  # 9 > 7, but not yet 3 > 3
    (ONE_UP, "bound", 0, 3, LEVEL, "trot", 4, 3),  # 4 > 3
    (ONE_UP, "bound", 0, 3, LEVEL, "trot", 0, 7),
    (LEVEL, "bound", 1, 3, LEVEL, "trot", 0, 7),
    (LEVEL, "bound", 2, 3, LEVEL, "trot", 0, 7),
    (LEVEL, "bound", 3, 3, LEVEL, "trot", 0, 7),
    (LEVEL, "trot", 4, 3, LEVEL, "trot", 0, 7),
    (ONE_UP, "trot", 3, 7, TWO_UP, "trot", 4, 7),
    (ONE_UP, "trot", 6, 7, ONE_UP, "trot", 7, 7),  # not 7 > 7
    (ONE_UP, "bound", 9, 7, ONE_UP, "bound", 10, 7),
]


def walk_the_timeline(policies):
    """Gaits and decisions of two robots along TIMELINE."""
    driver = Driver(policies, 2, start="trot")
    switcher = Autonomous(GRAPH, 2)
    for step, row in enumerate(TIMELINE):
        feet = np.array([row[0], row[4]])
        sensed = sensed_of(["FL FR BL BR"] * 2, feet, time=(step + 1) / 100)
        driver.see(sensed, driver.repertoire.own_command(driver.gait))
        decision = switcher.step(sensed, driver)
        yield row, driver, decision


def test_robots_shift_to_the_rough_gait_and_back_each_on_its_own(policies):
    for row, driver, _ in walk_the_timeline(policies):
        assert gaits_of(driver) == [row[1], row[5]]


def test_the_decision_tells_the_rule_in_force(policies):
    for row, _, decision in walk_the_timeline(policies):
        assert decision.threshold.tolist() == [row[3], row[7]]


def test_the_decision_tells_the_counter_before_a_firing_sets_it_back(policies):
    told = [decision.k.tolist() for _, _, decision in walk_the_timeline(policies)]
    assert told == [[row[2], row[6]] for row in TIMELINE]


def test_a_shift_begins_the_new_machine_anew(policies):
    counters = [
        driver.state.steps_in_state.tolist() for _, driver, _ in walk_the_timeline(policies)
    ]
    assert [row[0] for row in counters] == [1, 2, 3, 4, 0, 1, 2, 3, 4, 5, 0, 1, 2, 0]
    assert [row[1] for row in counters] == [1, 0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 0]


def test_a_condition_that_looks_at_the_critics_value_is_shown_it(tmp_path):
    class Expectation:
        """The critic's value as it is."""

        unit, width, needs, search = "", 1, ("value",), None

        def start(self, n):
            return None

        def step(self, state, sensed):
            return None, sensed.need("value", "expectation")[:, None]

    expecting = {
        gait: exported(tmp_path, gaits.load(gait), expected=value)
        for gait, value in (("trot", 3.0), ("bound", 0.5))
    }
    graph = GaitGraph(
        start="trot",
        statistics={"expectation": Expectation()},
        edges=(
            Edge(
                source="trot",
                target="bound",
                statistic="expectation",
                rule=Rule(alpha=2.0, beta=2.0),
            ),
            Edge(
                source="bound",
                target="trot",
                statistic="expectation",
                rule=Rule(when="below", alpha=1.0, beta=1.0),
            ),
        ),
    )
    driver, switcher = Driver(expecting, 1, start="trot"), Autonomous(graph, 1)
    seen = []
    for step, sensed in enumerate(staggering(1, 7)):
        driver.act(sensed, Command.straight(1))
        driver.see(sensed, Command.straight(1))
        switcher.step(replace(sensed, time=step / 100), driver)
        seen.append(gaits_of(driver)[0])
    assert seen == ["trot", "trot", "bound", "bound", "trot", "trot", "trot"]


# The schedule -----------------------------------------------------------------------------------


def test_each_entry_of_a_schedule_is_carried_out_once_when_it_is_due(policies):
    driver = Driver(policies, 2, start="trot")
    switcher = Scheduled(((0.02, "bound"), (0.05, "pace"), (0.07, "trot")))
    sensed = sensed_of(["FL BR", "FR BL"])
    seen = []
    for step in range(8):
        switcher.step(replace(sensed, time=(step + 1) / 100), driver)
        seen.append(gaits_of(driver))
        if step == 2:  # whoever changes a gait by hand is not overruled before the next entry
            driver.switch(np.array([1]), "trot", sensed)
    assert [row[0] for row in seen] == ["trot"] + ["bound"] * 3 + ["pace"] * 2 + ["trot"] * 2
    assert [row[1] for row in seen] == [
        *("trot", "bound", "bound", "trot", "pace", "pace", "trot", "trot")
    ]


def test_entries_that_fall_due_together_are_carried_out_in_order(policies):
    driver = Driver(policies, 1, start="trot")
    switcher = Scheduled(((3.0, "bound"), (3.0, "pace")))
    switcher.step(sensed_of(["FL BL"], time=3.0), driver)
    assert gaits_of(driver) == ["pace"]


def test_a_schedule_has_no_counter_to_tell(policies):
    driver = Driver(policies, 3, start="trot")
    decision = Scheduled(((0.01, "pace"),)).step(sensed_of(["FL"] * 3, time=0.01), driver)
    assert not decision.k.any()
    assert not decision.threshold.any()
    assert decision.fired.all()


def test_both_switchers_are_switchers():
    assert isinstance(Autonomous(GRAPH, 1), Switcher)
    assert isinstance(Scheduled(()), Switcher)


# Graphs that switchers carry --------------------------------------------------------------------


@pytest.mark.parametrize("reset", [True, False])
def test_a_switcher_shifts_as_the_graph_does_by_itself(policies, reset):
    """Live is replay: what a log of the same run gives again."""
    graph = replace(GRAPH, reset=reset)
    driver, switcher = Driver(policies, 2, start="trot"), Autonomous(graph, 2)
    rng, state, shifts = np.random.default_rng(3), graph.begin(2), 0
    for step in range(200):
        feet = np.where(rng.random((2, 1)) < 0.5, ONE_UP, LEVEL)
        sensed = sensed_of(["FL FR BL BR"] * 2, feet, time=(step + 1) / 100)
        decision = switcher.step(sensed, driver)
        state, expected = graph.step(state, sensed)
        for name in ("fired", "k", "threshold"):
            np.testing.assert_array_equal(getattr(decision, name), getattr(expected, name))
        shifts += expected.fired.sum()
        assert gaits_of(driver) == [graph.gaits[index] for index in state.gait]
    assert shifts > 20


def test_who_changes_a_gait_by_hand_is_judged_by_the_rule_of_that_gait(policies):
    driver, switcher = Driver(policies, 1, start="trot"), Autonomous(GRAPH, 1)
    level = sensed_of(["FL FR BL BR"], np.array([LEVEL]))
    driver.switch(np.array([0]), "bound", level)
    seen = [switcher.step(level, driver).threshold.item() for _ in range(4)]
    assert seen == [3, 3, 3, 3]
    assert gaits_of(driver) == ["trot"], "the fourth level step"
    driver.switch(np.array([0]), "pace", level)
    decision = switcher.step(sensed_of(["FL FR BL BR"], np.array([ONE_UP])), driver)
    assert (decision.k.item(), decision.threshold.item()) == (0, 0), "no edge leaves pace"


def test_only_numbers_of_a_graph_can_be_retuned():
    graph = load_graph("height_difference")
    switcher = Autonomous(graph, 1)
    switcher.retune(tuned(graph, alpha=0.1, beta=3.0))
    assert switcher.graph.edges[0].rule.beta == 3.0
    for other in (between(graph, flat="trot", rough="pace"), load_graph("paper")):
        with pytest.raises(GaitshiftError, match="must have the same edges and statistics"):
            switcher.retune(other)


def test_counters_go_on_when_numbers_are_retuned(policies):
    driver, switcher = Driver(policies, 1, start="trot"), Autonomous(GRAPH, 1)
    uneven = sensed_of(["FL FR BL BR"], np.array([ONE_UP]))
    assert switcher.step(uneven, driver).k.item() == 3
    switcher.retune(tuned(GRAPH, beta=5.0))
    assert switcher.step(uneven, driver).k.item() == 6
    assert gaits_of(driver) == ["bound"], "6 > 5"


def test_a_graph_of_other_numbers_is_another_condition(policies):
    driver = Driver(policies, 1, start="trot")
    switcher = Autonomous(tuned(GRAPH, beta=2.0), 1)
    switcher.step(sensed_of(["FL FR BL BR"], np.array([ONE_UP])), driver)
    assert gaits_of(driver) == ["bound"], "3 > 2 at the first step"


def test_a_switcher_with_an_oracle_asks_for_the_truth(policies):
    """Robots beyond x = 1 m are said to be on rough ground."""
    graph = load_graph("oracle")
    assert isinstance(graph.statistics["ground"], Oracle)
    driver = Driver(policies, 2, start="trot")
    world = World(driver.robot, flat(9.0, 9.0), 2, threads=1)
    world.place(np.arange(2), xy=np.array([[0.0, 0.0], [2.0, 0.0]]), yaw=np.zeros(2))
    knowing = Autonomous(graph, 2, rough=lambda truth: truth.base_position_w[:, 0] > 1.0)
    knowing.step(world.sensed, driver, world.truth)
    assert gaits_of(driver) == ["trot", "bound"]
    for blind, truth in ((knowing, None), (Autonomous(graph, 2), world.truth)):
        with pytest.raises(GaitshiftError, match="an oracle needs the truth"):
            blind.step(world.sensed, driver, truth)
