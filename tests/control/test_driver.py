"""Drivers: who runs which gait, and what a shift does to a robot."""

from dataclasses import replace

import numpy as np
import pytest

from driving import GAITS, STANCE, exported, gaits_of, sensed_of, staggering
from gaitshift.control import Driver
from gaitshift.control.observation import GaitState
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.robot.command import Command
from gaitshift.robot.description import ANYMAL_B


@pytest.fixture(scope="module")
def constants(tmp_path_factory):
    """Policies that always act the same: trot 0.1 … 1.2, bound 1.1 … 2.2, pace 2.1 … 3.2."""
    folder = tmp_path_factory.mktemp("constants")
    return {
        gait: exported(
            folder, gaits.load(gait), seed=i, constant=(i + 0.1 * np.arange(1, 13)).tolist()
        )
        for i, gait in enumerate(GAITS)
    }


def test_robots_act_by_the_policy_of_their_own_gait(constants):
    driver = Driver(constants, 5, start="bound")
    sensed = sensed_of(["FL BR"] * 5)
    driver.switch(np.array([0, 3]), "trot", sensed)
    driver.switch(np.array([4]), "pace", sensed)
    assert gaits_of(driver) == ["trot", "bound", "bound", "trot", "pace"]
    moved = driver.act(sensed, Command.straight(5)) - STANCE
    scale = ANYMAL_B.action_scale
    for robot, first in enumerate([0.1, 1.1, 1.1, 0.1, 2.1]):
        expected = scale * (first + 0.1 * np.arange(12))
        np.testing.assert_allclose(moved[robot], expected, rtol=1e-6)


def test_a_batch_of_robots_is_driven_as_each_alone_would_be(policies):
    n = 4
    driver = Driver(policies, n, start="trot")
    alone = [Driver(policies, 1, start="trot") for _ in range(n)]
    plan = {3: ([1], "bound"), 9: ([0, 2], "pace"), 15: ([1, 2, 3], "trot"), 22: ([2], "bound")}
    together = 0
    for step, sensed in enumerate(staggering(n, 40)):
        command = Command(
            forward_speed=np.array([1.2, 0.8, 0.4, 1.0]),
            yaw_rate=np.array([0.1, -0.2, 0.3, 0.0]),
            stride_frequency=np.array([2.5, 1.5, 2.9, 2.0]),
        )
        target = driver.act(sensed, command)
        driver.see(sensed, command)
        for robot, one in enumerate(alone):
            ids = np.array([robot])
            own = one.act(sensed.robots(ids), command.of(ids))
            np.testing.assert_allclose(own[0], target[robot], rtol=1e-5, atol=1e-6)
            one.see(sensed.robots(ids), command.of(ids))
            assert one.machine_state[0] == driver.machine_state[robot]
            assert one.state.steps_in_state[0] == driver.state.steps_in_state[robot]
        ids, gait = plan.get(step, ([], "trot"))
        driver.switch(np.array(ids, dtype=int), gait, sensed)
        for robot in ids:
            alone[robot].switch(np.array([0]), gait, sensed.robots(np.array([robot])))
        together += len(set(driver.gait.tolist())) == 3
    assert together > 5, "three gaits at a time"


def test_what_is_expected_of_a_robot_is_what_the_critic_of_its_own_gait_expects(tmp_path, policies):
    expecting = {
        gait: exported(tmp_path, gaits.load(gait), expected=value)
        for gait, value in (("trot", 3.0), ("bound", -4.0))
    }
    driver = Driver({**expecting, "pace": policies["pace"]}, 3, start="trot")
    sensed, command = sensed_of(["FL BR"] * 3), Command.straight(3)
    driver.switch(np.array([1]), "bound", sensed)
    driver.act(sensed, command)
    np.testing.assert_allclose(driver.value(), [3.0, -4.0, 3.0])
    driver.switch(np.array([2]), "pace", sensed)
    np.testing.assert_allclose(driver.value(), [3.0, -4.0, 3.0], err_msg="of what was acted on")
    driver.act(sensed, command)
    assert driver.value() is None, "the policy of pace has no critic"


def test_a_switch_from_a_gait_to_itself_changes_no_bit(policies):
    plain, switched = (Driver(policies, 3, start="pace") for _ in range(2))
    command = Command.straight(3)
    for sensed in staggering(3, 30):
        switched.switch(np.arange(3), "pace", sensed)
        np.testing.assert_array_equal(switched.act(sensed, command), plain.act(sensed, command))
        plain.see(sensed, command)
        switched.see(sensed, command)
        switched.switch(np.array([1]), "pace", sensed)
        np.testing.assert_array_equal(switched.machine_state, plain.machine_state)
        np.testing.assert_array_equal(switched.state.steps_in_state, plain.state.steps_in_state)
    assert plain.state.steps_in_state.min() > 0, "a shift would have set a counter back"


def test_all_robots_begin_in_the_first_state_of_the_gait_they_start_in(policies):
    driver = Driver(policies, 3, start="bound")
    assert gaits_of(driver) == ["bound"] * 3
    assert driver.machine_state.tolist() == driver.state.steps_in_state.tolist() == [0, 0, 0]


FITTING = {
    # contacts:    the state that agrees on most feet, of trot (FL BR, FR BL), of bound
    #              (FL FR, BL BR) and of pace (FL BL, FR BR); ties go to the first
    "FL BR": (0, 0, 0),
    "FR BL": (1, 0, 0),
    "FL FR": (0, 0, 0),
    "BL BR": (0, 1, 0),
    "FL BL": (0, 0, 0),
    "FR BR": (0, 0, 1),
    "BL": (1, 1, 0),
    "FR BL BR": (1, 1, 1),
}


@pytest.mark.parametrize("gait", GAITS)
def test_after_a_switch_the_machine_is_in_the_state_that_fits_the_contacts(policies, gait):
    other = "bound" if gait == "trot" else "trot"
    sensed = sensed_of([*FITTING, "FL BR"])
    driver = Driver(policies, len(FITTING) + 1, start=other)
    for _ in range(3):
        driver.see(
            sensed_of(["FL FR BL BR"] * (len(FITTING) + 1)),
            driver.repertoire.own_command(driver.gait),
        )
    driver.switch(np.arange(len(FITTING)), gait, sensed)
    expected = [row[GAITS.index(gait)] for row in FITTING.values()]
    assert driver.machine_state.tolist() == [*expected, 0]
    assert driver.state.steps_in_state.tolist() == [0] * len(FITTING) + [3]
    assert gaits_of(driver) == [gait] * len(FITTING) + [other]


def test_a_machine_that_a_shift_began_and_that_stands_still_begins_anew(policies):
    """Trot's cycle takes 40 steps at 2.5 Hz: on four feet it waits for two of them, 80 steps."""
    driver = Driver(policies, 3, start="bound")
    standing = sensed_of(["FL FR BL BR"] * 3)
    command = replace(driver.repertoire.own_command(driver.gait), stride_frequency=np.full(3, 2.5))
    driver.switch(np.array([0, 1]), "trot", sensed_of(["FR BL"] * 3))
    assert driver.machine_state.tolist() == [1, 1, 0]
    for _ in range(80):
        driver.see(standing, command)
    assert driver.machine_state.tolist() == [1, 1, 0]
    driver.see(standing, command)
    assert driver.machine_state.tolist() == [0, 0, 0]
    assert driver.state.steps_in_state.tolist() == [0, 0, 81]
    for _ in range(81 + 30):
        driver.see(standing, command)
    assert driver.state.steps_in_state.tolist() == [30, 30, 192], (
        "once more, for as long as it stands"
    )


def test_a_machine_that_has_gone_round_since_the_shift_may_stand_still(policies):
    driver = Driver(policies, 2, start="bound")
    command = replace(driver.repertoire.own_command(driver.gait), stride_frequency=np.full(2, 2.5))
    driver.switch(np.arange(2), "trot", sensed_of(["FL BR"] * 2))
    for feet in [("FL BR", "FL BR")] * 25 + [("FR BL", "FR BL")] * 25 + [("FL BR", "FR BL")]:
        driver.see(sensed_of(feet), command)
    assert driver.machine_state.tolist() == [0, 1], "round, and half round"
    for _ in range(100):
        driver.see(sensed_of(["FL FR BL BR"] * 2), command)
    assert driver.state.steps_in_state.tolist() == [100, 100 - (81 - 25)]
    assert driver.machine_state.tolist() == [0, 0]


def test_after_a_switch_the_new_policy_is_shown_its_own_machine_and_the_last_action(policies):
    driver = Driver(policies, 2, start="trot")
    sensed = sensed_of(["FR BL", "BL BR"])
    command = Command(
        forward_speed=np.array([1.2, 0.5]),
        yaw_rate=np.array([0.2, -0.1]),
        stride_frequency=np.array([2.0, 2.4]),
    )
    first = driver.act(sensed, command)
    driver.see(sensed, command)
    driver.switch(np.array([1]), "bound", sensed)
    bound = policies["bound"]
    shown = GaitState(
        machine_state=np.array([1]),
        steps_in_state=np.array([0]),
        last_action=(first[1:] - STANCE) / ANYMAL_B.action_scale,
        touch_height=sensed.foot_height[1:],
    )
    ids = np.array([1])
    seen = bound.walker.observe(shown, sensed.robots(ids), command.of(ids))
    expected = bound.walker.target(bound(seen))[1]
    np.testing.assert_allclose(driver.act(sensed, command)[1:], expected, atol=1e-6)


def with_dwell(machine, dwell, name):
    """The same two-state machine at another dwell [control steps], by another name."""
    tables = machine.to_dict() | {"name": name, "dwell": dwell, "dwell_range": [10, 40]}
    for way in tables["transition"]:
        way["dwell"] = dwell
    return RewardMachine.from_dict(tables)


@pytest.fixture(scope="module")
def paced(tmp_path_factory):
    """Policies of different nominal commands: 1.1 m/s and 100 / (2 · 20) Hz, 0.6 and 2 · 25."""
    folder = tmp_path_factory.mktemp("paced")
    return {
        "quick": exported(folder, with_dwell(gaits.load("trot"), 20, "quick"), speed=1.1),
        "slow": exported(folder, with_dwell(gaits.load("bound"), 25, "slow"), speed=0.6),
    }


def test_after_a_shift_a_robots_own_command_is_that_of_its_new_gait(paced):
    driver = Driver(paced, 3, start="quick")
    driver.switch(np.array([1]), "slow", sensed_of(["FL BR"] * 3))
    own = driver.repertoire.own_command(driver.gait)
    np.testing.assert_allclose(own.forward_speed, [1.1, 0.6, 1.1])
    np.testing.assert_allclose(own.stride_frequency, [2.5, 2.0, 2.5])
    assert not own.yaw_rate.any()
    driver.switch(np.array([0, 1]), "quick", sensed_of(["FL BR"] * 3))
    np.testing.assert_allclose(driver.repertoire.own_command(driver.gait).forward_speed, 1.1)


def test_a_commanded_stride_frequency_holds_each_robots_machine_back_for_its_dwell(paced):
    # Strides of 50 and 33.3 steps: dwells of 25 and of 17 (34 steps) for all, whatever the gait;
    # strides of 10 and 200 steps end at the ranges, 10 and 40.
    driver = Driver(paced, 4, start="quick")
    driver.switch(np.array([1, 3]), "slow", sensed_of(["FL BR", "FL FR"] * 2))
    command = Command(
        forward_speed=np.full(4, 1.0),
        yaw_rate=np.zeros(4),
        stride_frequency=np.array([2.0, 3.0, 10.0, 0.5]),
    )
    changed_at = {}
    for step in range(1, 60):
        driver.see(sensed_of(["FR BL", "BL BR"] * 2), command)
        for robot in np.flatnonzero(driver.machine_state == 1):
            changed_at.setdefault(int(robot), step)
    assert changed_at == {0: 25, 1: 17, 2: 10, 3: 40}


def test_machines_go_on_as_the_feet_do(policies):
    driver = Driver(policies, 2, start="trot")
    dwell = gaits.load("trot").dwell
    # Robot 0 stands on its first diagonal for a dwell and then on the other; robot 1 stays.
    for step in range(dwell + 5):
        sensed = sensed_of(["FL BR" if step < dwell + 2 else "FR BL", "FL BR"])
        driver.see(sensed, driver.repertoire.own_command(driver.gait))
    assert driver.machine_state.tolist() == [1, 0]
    assert driver.state.steps_in_state.tolist() == [2, dwell + 5]


def test_a_stance_is_shown_where_the_feet_are_one_of_the_present_gaits(policies):
    contacts = ["FL BR", "FR BL", "FL FR", "FL BR", "BL BR", "FL BL", "FR BR"]
    driver = Driver(policies, 7, start="trot")
    sensed = sensed_of(contacts)
    driver.switch(np.array([3, 4]), "bound", sensed)
    driver.switch(np.array([5]), "pace", sensed)
    shown = driver.repertoire.stance_shown(driver.gait, sensed.contact).tolist()
    assert shown == [True, True, False, False, True, True, False]


def test_a_driver_without_the_gait_to_start_in_is_refused(policies):
    with pytest.raises(
        GaitshiftError, match="unknown gait 'canter'; known gaits: trot, bound, pace"
    ):
        Driver(policies, 1, start="canter")


def test_policies_for_different_gains_cannot_be_shifted_between(policies, tmp_path):
    soft = exported(tmp_path, gaits.load("bound"), gains="paper")
    with pytest.raises(GaitshiftError) as caught:
        Driver({"trot": policies["trot"], "bound": soft}, 1, start="trot")
    line = str(caught.value)
    assert "got anymal_b with gains 'paper' for bound" in line
    assert "anymal_b with gains 'default' for trot" in line


def test_a_policy_is_not_shown_a_command_that_it_was_not_trained_for(tmp_path):
    """A trot without lateral speed and height, one with both, and one that stands."""
    ranged = replace(gaits.load("trot"), name="aside", lateral_speed=0.3, height_range=(-0.1, 0.02))
    machines = (gaits.load("trot"), ranged, gaits.load("stand"))
    command = Command(
        forward_speed=np.array([1.2, 0.0]),
        yaw_rate=np.array([0.2, 0.4]),
        stride_frequency=np.array([2.5, 2.5]),
        lateral_speed=np.array([0.2, -0.5]),
        body_height=np.array([-0.05, 0.1]),
    )
    plain, aside, stand = (exported(tmp_path, machine).within(command) for machine in machines)
    assert (plain.lateral_speed.tolist(), plain.body_height.tolist()) == ([0, 0], [0, 0])
    assert plain.forward_speed.tolist() == [1.2, 0.0]
    assert aside.lateral_speed.tolist() == [0.2, -0.3]
    assert aside.body_height.tolist() == [-0.05, 0.02]
    assert (stand.forward_speed.tolist(), stand.yaw_rate.tolist()) == ([0, 0], [0, 0])
    assert stand.body_height.tolist() == [-0.05, 0.02]
