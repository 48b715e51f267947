"""The loops about a command, on robots in closed form."""

import numpy as np
import pytest

from gaitshift.robot.command import CONTROL_PERIOD, Command, HeadingLoop, SpeedLoop

WANTED = 1.2


def run(robot, seconds, loop=None):
    """Asks a robot (speed of what is asked and when) by the loop; what was asked at the end."""
    loop = SpeedLoop() if loop is None else loop
    wanted = np.full(1, WANTED)
    state, asked = loop.start(1), wanted
    for step in range(round(seconds / CONTROL_PERIOD)):
        speed = np.array([robot(asked[0], step * CONTROL_PERIOD)])
        state, asked = loop.step(state, wanted, speed)
    return asked[0]


@pytest.mark.parametrize(("share", "off"), [(1.0, 0.1), (1.08, 0.0), (0.95, -0.03), (1.1, -0.05)])
def test_a_robot_that_is_off_by_a_little_is_asked_for_what_brings_the_wanted_speed(share, off):
    """Share · asked + off = wanted has one solution."""
    asked = run(lambda asked, time: share * asked + off, 10.0)
    assert share * asked + off == pytest.approx(WANTED, abs=0.002)


def test_the_swing_of_the_speed_within_a_stride_hardly_shows():
    steady = run(lambda asked, time: asked + 0.05 + 0.3 * np.sin(2 * np.pi * 2.9 * time), 10.0)
    assert steady == pytest.approx(WANTED - 0.05, abs=0.015)


def test_a_robot_that_is_held_up_is_not_asked_to_run():
    """Slowed down to a half for 5 s, it is asked for what it was asked before, and a little more.

    While the mean falls by 0.25 m/s, in under half a second, the trim grows by under 0.15.
    """
    held = run(lambda asked, time: asked if time < 5.0 else 0.5 * WANTED, 10.0)
    assert WANTED <= held <= WANTED + 0.15
    longer = run(lambda asked, time: asked if time < 5.0 else 0.5 * WANTED, 60.0)
    assert longer == held


def test_the_trim_is_bounded_and_may_slow_down_by_more():
    slow = run(lambda asked, time: WANTED - 0.2, 30.0)
    assert slow == pytest.approx(WANTED + 0.15)
    fast = run(lambda asked, time: WANTED + 0.2, 30.0)
    assert fast == pytest.approx(WANTED - 0.35)


def test_a_robot_that_answers_half_as_strongly_is_slowed_to_what_is_wanted():
    """0.74 + asked / 2 = 1.2 at 0.92: it is 0.14 too fast at first, and needs 0.28 less."""
    asked = run(lambda asked, time: 0.74 + 0.5 * asked, 30.0)
    assert asked == pytest.approx(WANTED - 0.28, abs=0.002)


def test_without_gain_the_speed_is_asked_for_as_it_is():
    assert run(lambda asked, time: WANTED + 0.2, 10.0, SpeedLoop(gain=0.0)) == WANTED


def test_robots_do_not_know_of_each_other():
    loop, rng = SpeedLoop(), np.random.default_rng(0)
    wanted = rng.uniform(0.4, 1.6, 5)
    state, alone = loop.start(5), loop.start(1)
    for _ in range(200):
        speed = rng.uniform(0.0, 2.0, 5)
        state, asked = loop.step(state, wanted, speed)
        alone, one = loop.step(alone, wanted[3:4], speed[3:4])
        assert asked[3] == one[0]


def test_a_robot_left_of_its_line_turns_right_and_not_too_fast():
    loop = HeadingLoop()
    zero = np.zeros(3)
    rate = loop.yaw_rate(zero, zero, np.array([0.1, -0.1, 100.0]))
    assert rate[0] < 0 < rate[1]
    assert rate[2] == -loop.yaw_rate_limit


def test_a_robot_that_turns_as_commanded_gets_the_commanded_rate_and_no_more():
    """Its yaw follows the heading exactly: after 4 s at 0.5 rad/s it has turned by 2 rad."""
    loop, yaw, heading = HeadingLoop(), np.array([3.0]), np.array([3.0])
    for _ in range(400):
        heading, rate = loop.turning(yaw, heading, 0.5)
        yaw = yaw + 0.5 * CONTROL_PERIOD  # beyond π: angles wrap
        assert rate == pytest.approx([0.5], abs=0.01)
    assert np.exp(1j * heading) == pytest.approx(np.exp(1j * np.array([5.0])))


def test_a_robot_that_cannot_turn_is_not_turned_later():
    """It is held for 10 s; let go, and commanded straight on, it turns by the limit at most."""
    loop, held, heading = HeadingLoop(), np.array([0.1]), np.array([0.1])
    for _ in range(1000):
        heading, rate = loop.turning(held, heading, 0.4)
    assert heading == pytest.approx([0.1 + loop.heading_limit])
    assert rate == pytest.approx([1.5 * 0.4]), "half more than the robot is asked for, at most"
    again, rate = loop.turning(held, heading, 0.0)
    assert again == heading
    assert rate == loop.yaw_rate(held, heading)


def test_parts_of_a_command_that_are_not_given_are_0_and_all_are_sensed():
    command = Command(
        forward_speed=np.array([1.0, 0.5]),
        yaw_rate=np.array([0.1, 0.2]),
        stride_frequency=np.array([2.0, 2.5]),
        body_height=np.array([-0.1, 0.05]),
    )
    second = command.of(np.array([1])).sensed()
    assert {name: value.item() for name, value in second.items()} == {
        "forward_speed_command": 0.5,
        "yaw_rate_command": 0.2,
        "stride_frequency_command": 2.5,
        "lateral_speed_command": 0.0,
        "body_height_command": 0.05,
    }
