"""Drivers and switchers: who runs which gait, and what a shift does to a robot."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from gaitshift.control import Autonomous, Driver, Scheduled, Switcher, policy
from gaitshift.control.observation import Situation
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.learn.export import describe, export
from gaitshift.learn.learner import Learner
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.robot.command import Command
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.motion import Motion
from gaitshift.shift import Condition, Edge, GaitGraph, Rule, Signals
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat

STANCE = ANYMAL_B.stance_angles
GAITS = ("trot", "bound", "pace")
FEET = ("FL", "FR", "BL", "BR")
BASE_HEIGHT = 0.5


def exported(folder, machine, *, seed=0, constant=None, gains="default", speed=None, expected=None):
    """An untrained policy of a machine; with `constant` its twelve actions are always those.

    With `expected` it has a critic that always expects that.
    """
    torch.manual_seed(seed)
    config = EnvConfig(gains=gains, forward_speed=speed)
    env = GaitEnv(machine, flat(10.0, 10.0), 1, config=config, threads=1)
    recipe = Recipe(env=config, ppo=PpoConfig(hidden=(16,)), robots=1, steps=1)
    ppo = Learner(env, recipe).ppo
    actor, critic = ppo.actor, None if expected is None else ppo.critic
    with torch.no_grad():
        if critic is not None:
            critic.mlp[-1].weight.zero_()
            critic.mlp[-1].bias.fill_(expected)
        for parameter in actor.mlp.parameters():
            parameter.normal_(0.0, 0.1)
        if constant is not None:
            actor.mlp[-1].weight.zero_()
            actor.mlp[-1].bias.copy_(torch.tensor(constant))
    path = folder / f"{machine.name}-{seed}-{gains}-{constant is None}.onnx"
    export(actor, describe(env, {}), path, critic=critic)
    return policy.load(path)


@pytest.fixture(scope="module")
def policies(tmp_path_factory):
    """Policies of three gaits, each of which looks at everything it is shown."""
    folder = tmp_path_factory.mktemp("policies")
    return {gait: exported(folder, gaits.load(gait), seed=i) for i, gait in enumerate(GAITS)}


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


def motion_of(contacts, heights=None):
    """Robots upright at rest; contacts such as "FL BR", and heights (N, 4) of the feet [m]."""
    n = len(contacts)
    foot = np.tile(
        [[0.34, 0.2, 0], [0.35, -0.21, 0], [-0.33, 0.22, 0], [-0.36, -0.23, 0]], (n, 1, 1)
    )
    foot[..., 2] = 0.0 if heights is None else heights
    return Motion(
        joint_position=np.tile(STANCE + 0.01 * np.arange(12), (n, 1)),
        joint_velocity=np.tile(0.1 * np.arange(12.0), (n, 1)),
        joint_torque=np.zeros((n, 12)),
        base_position_w=np.tile([1.0, 2.0, BASE_HEIGHT], (n, 1)),
        base_quaternion_w=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        base_linear_velocity_w=np.tile([0.9, 0.1, -0.05], (n, 1)),
        base_angular_velocity_b=np.tile([0.1, 0.2, 0.3], (n, 1)),
        foot_position_w=foot,
        foot_velocity_w=np.zeros((n, 4, 3)),
        foot_force=np.zeros((n, 4)),
        contact=np.array([[name in contact.split() for name in FEET] for contact in contacts]),
        clearance=np.full((n, 4), 0.2),
        body_contact=np.zeros(n, dtype=bool),
    )


def staggering(robots, steps):
    """Motions of robots that stagger under arbitrary actions."""
    env = GaitEnv(gaits.load("trot"), flat(20.0, 20.0), robots, config=EnvConfig(), threads=1)
    env.reset(seed=0)
    rng, action = np.random.default_rng(1), np.zeros((robots, 12))
    for _ in range(steps):
        action = 0.8 * action + rng.normal(size=(robots, 12))
        env.step(action)
        yield env.world.motion


def gaits_of(driver):
    return [driver.gaits[index] for index in driver.gait]


# The driver -------------------------------------------------------------------------------------


def test_robots_act_by_the_policy_of_their_own_gait(constants):
    driver = Driver(constants, 5, start="bound")
    motion = motion_of(["FL BR"] * 5)
    driver.switch(np.array([0, 3]), "trot", motion)
    driver.switch(np.array([4]), "pace", motion)
    assert gaits_of(driver) == ["trot", "bound", "bound", "trot", "pace"]
    moved = driver.act(motion, Command.straight(5)) - STANCE
    scale = ANYMAL_B.action_scale
    for robot, first in enumerate([0.1, 1.1, 1.1, 0.1, 2.1]):
        expected = scale * (first + 0.1 * np.arange(12))
        np.testing.assert_allclose(moved[robot], expected, rtol=1e-6)


def test_the_driver_shows_a_policy_what_its_training_environment_shows_it(tmp_path):
    machine = RewardMachine.from_dict(
        {
            "name": "shuffle",
            "title": "Shuffle",
            "description": "Changes its state whenever the front left foot lifts or lands.",
            "dwell": 2,
            "ideal_phase": {"FL": 0.0, "FR": 0.5, "BL": 0.5, "BR": 0.0},
            "state": [
                {"name": "all", "stance": list(FEET)},
                {"name": "three", "stance": ["FR", "BL", "BR"]},
            ],
            "transition": [
                {"from": "all", "to": "three", "down": [], "up": ["FL"]},
                {"from": "three", "to": "all", "down": ["FL"], "up": []},
            ],
        }
    )
    shuffle = exported(tmp_path, machine, seed=5)
    config = EnvConfig(heading_range=0.0, forward_speed=0.9, command_share=0.0)
    env = GaitEnv(machine, flat(20.0, 20.0), 3, config=config, threads=1)
    driver = Driver({"shuffle": shuffle}, 3, start="shuffle")
    observation, _ = env.reset(seed=0)
    changes = 0
    for _ in range(80):
        action = shuffle(observation)
        command = Command.straight(3, 0.9, stride_frequency=25.0)  # a cycle of 2 · 2 steps
        target = driver.act(env.world.motion, command)
        np.testing.assert_allclose(target, STANCE + ANYMAL_B.action_scale * action, atol=1e-6)
        observation, _, terminated, _, info = env.step(action)
        assert not terminated.any()
        driver.see(env.world.motion, command)
        changes += int(info["changed"].sum())
    assert changes > 5


def test_a_batch_of_robots_is_driven_as_each_alone_would_be(policies):
    n = 4
    driver = Driver(policies, n, start="trot")
    alone = [Driver(policies, 1, start="trot") for _ in range(n)]
    plan = {3: ([1], "bound"), 9: ([0, 2], "pace"), 15: ([1, 2, 3], "trot"), 22: ([2], "bound")}
    together = 0
    for step, motion in enumerate(staggering(n, 40)):
        command = Command(
            forward_speed=np.array([1.2, 0.8, 0.4, 1.0]),
            yaw_rate=np.array([0.1, -0.2, 0.3, 0.0]),
            stride_frequency=np.array([2.5, 1.5, 2.9, 2.0]),
        )
        target = driver.act(motion, command)
        driver.see(motion, command)
        for robot, one in enumerate(alone):
            ids = np.array([robot])
            own = one.act(motion.of(ids), command.of(ids))
            np.testing.assert_allclose(own[0], target[robot], rtol=1e-5, atol=1e-6)
            one.see(motion.of(ids), command.of(ids))
            assert one.machine_state[0] == driver.machine_state[robot]
            assert one.steps_in_state[0] == driver.steps_in_state[robot]
        ids, gait = plan.get(step, ([], "trot"))
        driver.switch(np.array(ids, dtype=int), gait, motion)
        for robot in ids:
            alone[robot].switch(np.array([0]), gait, motion.of(np.array([robot])))
        together += len(set(driver.gait.tolist())) == 3
    assert together > 5, "three gaits at a time"


def test_what_is_expected_of_a_robot_is_what_the_critic_of_its_own_gait_expects(tmp_path, policies):
    expecting = {
        gait: exported(tmp_path, gaits.load(gait), expected=value)
        for gait, value in (("trot", 3.0), ("bound", -4.0))
    }
    driver = Driver({**expecting, "pace": policies["pace"]}, 3, start="trot")
    motion, command = motion_of(["FL BR"] * 3), Command.straight(3)
    driver.switch(np.array([1]), "bound", motion)
    driver.act(motion, command)
    np.testing.assert_allclose(driver.value(), [3.0, -4.0, 3.0])
    driver.switch(np.array([2]), "pace", motion)
    np.testing.assert_allclose(driver.value(), [3.0, -4.0, 3.0], err_msg="of what was acted on")
    driver.act(motion, command)
    assert driver.value() is None, "the policy of pace has no critic"


def test_a_condition_that_looks_at_the_critics_value_is_shown_it(tmp_path):
    class Expectation:
        """The critic's value as it is."""

        unit, width, needs = "", 1, ("value",)

        def start(self, n):
            return None

        def step(self, state, signals):
            return None, signals.need("value", "expectation")[:, None]

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
    for step, motion in enumerate(staggering(1, 7)):
        driver.act(motion, Command.straight(1))
        driver.see(motion, Command.straight(1))
        switcher.step(step / 100, motion, driver, driver.own_command())
        seen.append(gaits_of(driver)[0])
    assert seen == ["trot", "trot", "bound", "bound", "trot", "trot", "trot"]


def test_a_switch_from_a_gait_to_itself_changes_no_bit(policies):
    plain, switched = (Driver(policies, 3, start="pace") for _ in range(2))
    command = Command.straight(3)
    for motion in staggering(3, 30):
        switched.switch(np.arange(3), "pace", motion)
        np.testing.assert_array_equal(switched.act(motion, command), plain.act(motion, command))
        plain.see(motion, command)
        switched.see(motion, command)
        switched.switch(np.array([1]), "pace", motion)
        np.testing.assert_array_equal(switched.machine_state, plain.machine_state)
        np.testing.assert_array_equal(switched.steps_in_state, plain.steps_in_state)
    assert plain.steps_in_state.min() > 0, "a shift would have set a counter back"


def test_all_robots_begin_in_the_first_state_of_the_gait_they_start_in(policies):
    driver = Driver(policies, 3, start="bound")
    assert gaits_of(driver) == ["bound"] * 3
    assert driver.machine_state.tolist() == driver.steps_in_state.tolist() == [0, 0, 0]


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
    motion = motion_of([*FITTING, "FL BR"])
    driver = Driver(policies, len(FITTING) + 1, start=other)
    for _ in range(3):
        driver.see(motion_of(["FL FR BL BR"] * (len(FITTING) + 1)), driver.own_command())
    driver.switch(np.arange(len(FITTING)), gait, motion)
    expected = [row[GAITS.index(gait)] for row in FITTING.values()]
    assert driver.machine_state.tolist() == [*expected, 0]
    assert driver.steps_in_state.tolist() == [0] * len(FITTING) + [3]
    assert gaits_of(driver) == [gait] * len(FITTING) + [other]


def test_a_machine_that_a_shift_began_and_that_stands_still_begins_anew(policies):
    """Trot's cycle takes 40 steps at 2.5 Hz: on four feet it waits for two of them, 80 steps."""
    driver = Driver(policies, 3, start="bound")
    standing = motion_of(["FL FR BL BR"] * 3)
    command = replace(driver.own_command(), stride_frequency=np.full(3, 2.5))
    driver.switch(np.array([0, 1]), "trot", motion_of(["FR BL"] * 3))
    assert driver.machine_state.tolist() == [1, 1, 0]
    for _ in range(80):
        driver.see(standing, command)
    assert driver.machine_state.tolist() == [1, 1, 0]
    driver.see(standing, command)
    assert driver.machine_state.tolist() == [0, 0, 0]
    assert driver.steps_in_state.tolist() == [0, 0, 81]
    for _ in range(81 + 30):
        driver.see(standing, command)
    assert driver.steps_in_state.tolist() == [30, 30, 192], "once more, for as long as it stands"


def test_a_machine_that_has_gone_round_since_the_shift_may_stand_still(policies):
    driver = Driver(policies, 2, start="bound")
    command = replace(driver.own_command(), stride_frequency=np.full(2, 2.5))
    driver.switch(np.arange(2), "trot", motion_of(["FL BR"] * 2))
    for feet in [("FL BR", "FL BR")] * 25 + [("FR BL", "FR BL")] * 25 + [("FL BR", "FR BL")]:
        driver.see(motion_of(feet), command)
    assert driver.machine_state.tolist() == [0, 1], "round, and half round"
    for _ in range(100):
        driver.see(motion_of(["FL FR BL BR"] * 2), command)
    assert driver.steps_in_state.tolist() == [100, 100 - (81 - 25)]
    assert driver.machine_state.tolist() == [0, 0]


def test_after_a_switch_the_new_policy_is_shown_its_own_machine_and_the_last_action(policies):
    driver = Driver(policies, 2, start="trot")
    motion = motion_of(["FR BL", "BL BR"])
    command = Command(
        forward_speed=np.array([1.2, 0.5]),
        yaw_rate=np.array([0.2, -0.1]),
        stride_frequency=np.array([2.0, 2.4]),
    )
    first = driver.act(motion, command)
    driver.see(motion, command)
    driver.switch(np.array([1]), "bound", motion)
    bound = policies["bound"]
    shown = Situation(
        machine_state=np.array([1]),
        steps_in_state=np.array([0]),
        motion=motion.of(np.array([1])),
        command=command.of(np.array([1])),
        last_action=(first[1:] - STANCE) / ANYMAL_B.action_scale,
        stance=STANCE,
        touch_height=motion.foot_height[1:],
    )
    expected = bound.target(bound(bound.observation(shown)))
    np.testing.assert_allclose(driver.act(motion, command)[1:], expected, atol=1e-6)


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
    driver.switch(np.array([1]), "slow", motion_of(["FL BR"] * 3))
    own = driver.own_command()
    np.testing.assert_allclose(own.forward_speed, [1.1, 0.6, 1.1])
    np.testing.assert_allclose(own.stride_frequency, [2.5, 2.0, 2.5])
    assert not own.yaw_rate.any()
    driver.switch(np.array([0, 1]), "quick", motion_of(["FL BR"] * 3))
    np.testing.assert_allclose(driver.own_command().forward_speed, 1.1)


def test_a_commanded_stride_frequency_holds_each_robots_machine_back_for_its_dwell(paced):
    # Strides of 50 and 33.3 steps: dwells of 25 and of 17 (34 steps) for all, whatever the gait;
    # strides of 10 and 200 steps end at the ranges, 10 and 40.
    driver = Driver(paced, 4, start="quick")
    driver.switch(np.array([1, 3]), "slow", motion_of(["FL BR", "FL FR"] * 2))
    command = Command(
        forward_speed=np.full(4, 1.0),
        yaw_rate=np.zeros(4),
        stride_frequency=np.array([2.0, 3.0, 10.0, 0.5]),
    )
    changed_at = {}
    for step in range(1, 60):
        driver.see(motion_of(["FR BL", "BL BR"] * 2), command)
        for robot in np.flatnonzero(driver.machine_state == 1):
            changed_at.setdefault(int(robot), step)
    assert changed_at == {0: 25, 1: 17, 2: 10, 3: 40}


def test_machines_go_on_as_the_feet_do(policies):
    driver = Driver(policies, 2, start="trot")
    dwell = gaits.load("trot").dwell
    # Robot 0 stands on its first diagonal for a dwell and then on the other; robot 1 stays.
    for step in range(dwell + 5):
        motion = motion_of(["FL BR" if step < dwell + 2 else "FR BL", "FL BR"])
        driver.see(motion, driver.own_command())
    assert driver.machine_state.tolist() == [1, 0]
    assert driver.steps_in_state.tolist() == [2, dwell + 5]


def test_a_stance_is_shown_where_the_feet_are_one_of_the_present_gaits(policies):
    contacts = ["FL BR", "FR BL", "FL FR", "FL BR", "BL BR", "FL BL", "FR BR"]
    driver = Driver(policies, 7, start="trot")
    motion = motion_of(contacts)
    driver.switch(np.array([3, 4]), "bound", motion)
    driver.switch(np.array([5]), "pace", motion)
    shown = driver.stance_shown(motion).tolist()
    assert shown == [True, True, False, False, True, True, False]


def test_a_driver_without_the_gait_to_start_in_is_refused(policies):
    with pytest.raises(GaitshiftError, match="trot, bound, pace, got 'canter'"):
        Driver(policies, 1, start="canter")


def test_policies_for_different_gains_cannot_be_shifted_between(policies, tmp_path):
    soft = exported(tmp_path, gaits.load("bound"), gains="paper")
    with pytest.raises(GaitshiftError) as caught:
        Driver({"trot": policies["trot"], "bound": soft}, 1, start="trot")
    line = str(caught.value)
    assert "policy of bound is for anymal_b with gains 'paper'" in line
    assert "trot for anymal_b with gains 'default'" in line


# The autonomous switcher ------------------------------------------------------------------------

CONDITION = Condition(alpha=0.05, beta=7.0, epsilon=1.0, alpha_back=0.03, beta_back=3.0)
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
    switcher = Autonomous(GaitGraph.of(CONDITION, flat="trot", rough="bound"), 2)
    for step, row in enumerate(TIMELINE):
        motion = motion_of(["FL FR BL BR"] * 2, np.array([row[0], row[4]]))
        driver.see(motion, driver.own_command())
        decision = switcher.step((step + 1) / 100, motion, driver, driver.own_command())
        yield row, driver, decision


def test_robots_shift_to_the_rough_gait_and_back_each_on_its_own(policies):
    for row, driver, _ in walk_the_timeline(policies):
        assert gaits_of(driver) == [row[1], row[5]]


def test_the_decision_tells_the_rule_in_force_and_the_heights_it_saw(policies):
    for row, _, decision in walk_the_timeline(policies):
        assert decision.threshold.tolist() == [row[3], row[7]]
        expected = np.array([row[0], row[4]]) - BASE_HEIGHT
        np.testing.assert_allclose(decision.foot_height, expected, atol=1e-12)


def test_the_decision_tells_the_counter_before_a_firing_sets_it_back(policies):
    told = [decision.k.tolist() for _, _, decision in walk_the_timeline(policies)]
    assert told == [[row[2], row[6]] for row in TIMELINE]


def test_a_shift_begins_the_new_machine_anew(policies):
    counters = [driver.steps_in_state.tolist() for _, driver, _ in walk_the_timeline(policies)]
    assert [row[0] for row in counters] == [1, 2, 3, 4, 0, 1, 2, 3, 4, 5, 0, 1, 2, 0]
    assert [row[1] for row in counters] == [1, 0, 1, 2, 3, 0, 1, 2, 3, 4, 5, 6, 7, 0]


def test_one_gait_for_flat_and_rough_is_refused():
    with pytest.raises(GaitshiftError, match="must differ, got 'trot'"):
        GaitGraph.of(CONDITION, flat="trot", rough="trot")


# The schedule -----------------------------------------------------------------------------------


def test_each_entry_of_a_schedule_is_carried_out_once_when_it_is_due(policies):
    driver = Driver(policies, 2, start="trot")
    switcher = Scheduled(((0.02, "bound"), (0.05, "pace"), (0.07, "trot")))
    motion = motion_of(["FL BR", "FR BL"])
    seen = []
    for step in range(8):
        switcher.step((step + 1) / 100, motion, driver, driver.own_command())
        seen.append(gaits_of(driver))
        if step == 2:  # whoever changes a gait by hand is not overruled before the next entry
            driver.switch(np.array([1]), "trot", motion)
    assert [row[0] for row in seen] == ["trot"] + ["bound"] * 3 + ["pace"] * 2 + ["trot"] * 2
    assert [row[1] for row in seen] == [
        *("trot", "bound", "bound", "trot", "pace", "pace", "trot", "trot")
    ]


def test_entries_that_fall_due_together_are_carried_out_in_order(policies):
    driver = Driver(policies, 1, start="trot")
    switcher = Scheduled(((3.0, "bound"), (3.0, "pace")))
    switcher.step(3.0, motion_of(["FL BL"]), driver, driver.own_command())
    assert gaits_of(driver) == ["pace"]


def test_a_schedule_has_no_counter_to_tell(policies):
    driver = Driver(policies, 3, start="trot")
    decision = Scheduled(((0.01, "pace"),)).step(
        0.01, motion_of(["FL"] * 3), driver, driver.own_command()
    )
    assert not decision.k.any()
    assert not decision.threshold.any()
    assert decision.foot_height.shape == (3, 4)


def test_both_switchers_are_switchers():
    assert isinstance(Autonomous(GaitGraph.of(CONDITION, flat="trot", rough="pace"), 1), Switcher)
    assert isinstance(Scheduled(()), Switcher)


@pytest.mark.parametrize("reset", [True, False])
def test_a_graph_of_a_condition_counts_as_the_condition_does(policies, reset):
    condition = replace(CONDITION, reset=reset)
    driver = Driver(policies, 2, start="trot")
    switcher = Autonomous(GaitGraph.of(condition, flat="trot", rough="bound"), 2)
    rng, state = np.random.default_rng(3), condition.start(2)
    shifted, shifts = np.array([False, False]), 0
    for step in range(200):
        feet = np.where(rng.random((2, 1)) < 0.5, ONE_UP, LEVEL)
        motion = motion_of(["FL FR BL BR"] * 2, feet)
        decision = switcher.step((step + 1) / 100, motion, driver, driver.own_command())
        state, fire = condition.step(state, Signals.from_motion(motion), shifted)
        np.testing.assert_array_equal(decision.k, state.counted)
        shifted, shifts = shifted ^ fire, shifts + fire.sum()
        assert gaits_of(driver) == ["bound" if one else "trot" for one in shifted]
    assert shifts > 20


def test_only_numbers_of_a_graph_can_be_retuned(policies):
    graph = GaitGraph.of(Condition(), flat="trot", rough="bound")
    switcher = Autonomous(graph, 1)
    switcher.retune(GaitGraph.of(Condition(alpha=0.1, beta=3.0), flat="trot", rough="bound"))
    assert switcher.graph.edges[0].rule.beta == 3.0
    for other in (
        GaitGraph.of(Condition(), flat="trot", rough="pace"),
        GaitGraph.of(Condition.paper(), flat="trot", rough="bound"),
    ):
        with pytest.raises(GaitshiftError, match="cannot change its edges or statistics"):
            switcher.retune(other)


def test_a_condition_of_other_numbers_is_another_condition(policies):
    driver = Driver(policies, 1, start="trot")
    switcher = Autonomous(GaitGraph.of(replace(CONDITION, beta=2.0), flat="trot", rough="bound"), 1)
    switcher.step(
        0.01, motion_of(["FL FR BL BR"], np.array([ONE_UP])), driver, driver.own_command()
    )
    assert gaits_of(driver) == ["bound"], "3 > 2 at the first step"
