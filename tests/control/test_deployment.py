"""The loop of a robot under a fake clock: limits, watchdog, soft stop, deadlines."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitshift.control import Driver, Scheduled
from gaitshift.control.deployment import Deployment, DeploymentConfig, Timing, run
from gaitshift.control.deployment.datagram import decode_command
from gaitshift.control.deployment.joint_limits import JointLimits
from gaitshift.control.deployment.timing import Pace
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from lockstep import ANGLES, PERIOD, standing, standing_sensed, trotting, walked

EFFORT, KP, KD = 80.0, 80.0, 2.0
"""Of ANYmal B and its default gains [N·m], [N·m/rad], [N·m·s/rad]."""
LIMITS = JointLimits.of(ANYMAL_B)


def joints(most):
    return arrays(np.float64, (12,), elements=st.floats(-most, most))


@given(joints(10.0), joints(2.0), joints(15.0), st.floats(1.0, 200.0))
def test_a_target_never_asks_for_more_than_the_effort_limit(target, position, velocity, kp):
    kept = LIMITS.clipped(target, position, velocity, kp, KD)
    assert (np.abs(kp * (kept - position) - KD * velocity) <= EFFORT * (1 + 1e-9)).all()


@given(joints(10.0), joints(10.0))
def test_a_target_stays_in_the_joints_range_where_the_effort_limit_lets_it(target, spread):
    position = np.clip(spread, LIMITS.low, LIMITS.high)
    kept = LIMITS.clipped(target, position, np.zeros(12), KP, KD)
    assert (kept >= LIMITS.low).all()
    assert (kept <= LIMITS.high).all()


def test_a_target_within_the_limits_keeps_its_bits():
    target = ANGLES + np.linspace(-0.3, 0.3, 12)
    np.testing.assert_array_equal(
        LIMITS.clipped(target, ANGLES, np.linspace(-3, 3, 12), KP, KD), target
    )


def test_a_joint_that_flees_is_braked_with_the_whole_effort_and_no_more():
    velocity = np.full(12, 50.0)  # damping alone would take 100 N·m
    kept = LIMITS.clipped(ANGLES, ANGLES, velocity, KP, KD)
    np.testing.assert_allclose(KP * (kept - ANGLES) - KD * velocity, -EFFORT)


def test_nothing_is_sent_before_the_first_sensors():
    deployment = trotting()
    assert deployment.step(0.0) is None
    deployment.receive(b"noise", 0.0)
    assert deployment.step(0.01) is None
    deployment.stop(0.02)
    assert deployment.is_over


def test_a_step_without_new_sensors_acts_on_the_last_ones():
    """As if the robot had measured the same once more."""
    held, told = trotting(), trotting()
    for number in range(1, 8):
        now = PERIOD * number
        if number not in (4, 5):
            held.receive(standing(number, now), now)
        told.receive(standing(number, now), now)
        assert held.step(now) is not None
        told.step(now)
        np.testing.assert_array_equal(held.last.target, told.last.target)
        assert held.last.sequence == (3 if number in (4, 5) else number)
        assert held.last.sensed.time == pytest.approx(now - PERIOD)


def stopped(deployment, now, steps=120):
    """The commands from this time on, with no sensors any more, and when each is sent."""
    times = now + PERIOD * np.arange(steps)
    return times, [decode_command(deployment.step(time)) for time in times.tolist()]


@pytest.mark.parametrize("watchdog", [0.02, 0.05, 0.2])
def test_the_soft_stop_begins_when_sensors_are_silent_for_the_watchdogs_time(watchdog):
    deployment = trotting(watchdog=watchdog)
    walked(deployment, 5)
    times, commands = stopped(deployment, 6 * PERIOD)
    silence = times - 5 * PERIOD
    begins = [command.is_stop for command in commands].index(True)
    assert silence[begins] > watchdog >= silence[begins - 1] - 1e-9
    assert all(command.is_stop for command in commands[begins:])
    assert "sensors" in deployment.fault


def test_a_soft_stop_is_slow_ends_where_the_joints_are_and_without_stiffness():
    deployment = trotting()
    last = walked(deployment, 5)[-1]
    _, commands = stopped(deployment, 5 * PERIOD + 0.06)
    targets = np.array([last.target, *(command.target for command in commands)])
    stiffness = np.array([command.kp for command in commands])
    assert np.abs(np.diff(targets, axis=0)).max() <= 2.0 * PERIOD + 1e-12
    distance = np.abs(targets - ANGLES)
    assert (np.diff(distance, axis=0) <= 1e-12).all()
    np.testing.assert_allclose(targets[-1], ANGLES, atol=1e-12)
    since = PERIOD * np.arange(len(commands))
    np.testing.assert_allclose(stiffness, KP * np.clip(1.0 - since, 0.0, 1.0), atol=1e-6)
    assert {command.kd for command in commands} == {KD}
    torque = stiffness[:, None] * (targets[1:] - ANGLES)
    assert np.abs(torque).max() <= np.abs(KP * (targets[0] - ANGLES)).max() + 1e-9
    assert deployment.is_over


def test_sensors_that_come_back_do_not_end_a_stop():
    deployment = trotting()
    walked(deployment, 5)
    stopped(deployment, 0.2, steps=10)
    deployment.receive(standing(6, 0.3), 0.3)
    assert decode_command(deployment.step(0.3)).is_stop
    assert not deployment.is_over


def test_late_sensors_do_not_feed_the_watchdog():
    deployment = trotting()
    walked(deployment, 5)
    for number in range(6, 14):
        now = PERIOD * number
        deployment.receive(standing(number % 5 + 1, now), now)  # numbers of before
        command = decode_command(deployment.step(now))
    assert command.is_stop
    assert deployment.inbox.counts.late == 8


def test_sensors_that_lose_a_signal_on_the_way_are_dropped():
    deployment = trotting()
    walked(deployment, 3)
    deployment.receive(standing(4, 0.04, velocity_b=None), 0.04)
    deployment.receive(standing(5, 0.05, has_heading=False), 0.05)
    assert deployment.inbox.counts.malformed == 2
    assert deployment.inbox.newest.sequence == 3


def test_a_robot_that_does_not_measure_what_the_policy_needs_is_sent_nothing():
    deployment = trotting()
    deployment.receive(standing(1, 0.01, velocity_b=None), 0.01)
    with pytest.raises(GaitshiftError, match="velocity_b"):
        deployment.step(0.01)
    assert deployment.is_over


@pytest.mark.parametrize(
    ("config", "says"),
    [
        ({"watchdog": 0.001}, "watchdog"),
        ({"watchdog": np.nan}, "watchdog"),
        ({"speed": -1.0}, "speed"),
        ({"speed": 9.0}, "speed"),
    ],
)
def test_settings_out_of_range_are_refused(config, says):
    with pytest.raises(GaitshiftError, match=says):
        DeploymentConfig(**config)


def test_a_deployment_is_of_one_robot():
    with pytest.raises(GaitshiftError, match="got 2"):
        Deployment(Driver.load(("trot",), 2), Scheduled(()), DeploymentConfig())


def test_deadlines_do_not_drift_and_none_is_made_up_for():
    pace, began, missed = Pace(3.0), [], []
    for work in (0.001, 0.009, 0.012, 0.001, 0.035, 0.002):
        now = max(pace.deadline, began[-1][1] if began else 0.0)
        began.append((now, now + work))
        missed.append(pace.advance(now + work))
    starts = [start for start, _ in began]
    assert starts == pytest.approx([3.0, 3.01, 3.02, 3.032, 3.04, 3.075])
    assert missed == [0, 0, 1, 0, 3, 0]
    assert pace.deadline == pytest.approx(3.08)


class StandingLink:
    """A robot that stands still under a clock that moves when the loop waits or works."""

    def __init__(self, *, work=0.0, silent_from=np.inf):
        self.time, self._work, self._silent_from = 5.0, work, silent_from
        self._measured = 0
        self.commands, self.sent_at = [], []

    def now(self):
        return self.time

    def receive(self, until):
        got = []
        while (due := 5.0 + PERIOD * (self._measured + 1)) <= until:
            self._measured += 1
            if due < self._silent_from:
                got.append((standing(self._measured, due), due))
        self.time = max(self.time, until)
        return got

    def send(self, data):
        self.sent_at.append(self.time)
        self.commands.append(decode_command(data))
        self.time += self._work


def driven(link, **others):
    deployment, timing = trotting(), Timing()
    run(deployment, link, **{"seconds": 0.3, "wait": 1.0, "timing": timing} | others)
    return deployment, timing


def test_a_run_sends_at_100_hz_and_ends_with_a_soft_stop():
    link, seen = StandingLink(work=0.004), []
    deployment, timing = driven(link, see=seen.append)
    np.testing.assert_allclose(np.diff(link.sent_at), PERIOD)
    assert [command.is_stop for command in link.commands[:31]] == [False] * 30 + [True]
    assert all(command.is_stop for command in link.commands[30:])
    assert link.commands[-1].kp == 0.0
    assert len(seen) == 30
    assert deployment.fault == ""
    assert timing.misses == 0
    assert timing.summary()["work_ms"]["p50"] == pytest.approx(4.0)
    assert timing.summary()["jitter_ms"]["max"] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_a_run_that_is_interrupted_stops_softly_first(error):
    link = StandingLink()

    def see(step):
        if step.sequence == 7:
            raise error

    with pytest.raises(error):
        driven(link, see=see)
    assert link.commands[-1].is_stop
    assert link.commands[-1].kp == 0.0
    assert link.sent_at[-1] - link.sent_at[6] > 1.0


def test_a_policy_that_gives_no_numbers_is_not_followed():
    link, deployment = StandingLink(), trotting()
    act = deployment.controller.act
    deployment.controller.act = lambda sensed, command: (
        act(sensed, command) if len(link.commands) < 5 else np.full((1, 12), np.nan)
    )
    with pytest.raises(GaitshiftError, match="target"):
        run(deployment, link, seconds=1.0, wait=1.0, timing=Timing())
    assert [command.is_stop for command in link.commands[:6]] == [False] * 5 + [True]
    assert link.commands[-1].kp == 0.0


def test_a_peer_that_vanishes_ends_the_run_after_the_soft_stop():
    link = StandingLink(silent_from=5.1)
    with pytest.raises(GaitshiftError, match="50 ms"):
        driven(link, seconds=10.0)
    assert link.commands[-1].kp == 0.0
    assert link.sent_at[-1] < 5.1 + 0.05 + 1.0 + 10 * PERIOD


def test_a_peer_that_never_comes_ends_the_run():
    link = StandingLink(silent_from=0.0)
    with pytest.raises(GaitshiftError, match="within 1 s"):
        driven(link)
    assert link.commands == []


def test_speed_is_that_of_the_gait_unless_another_one_is_asked_for():
    own, slow = trotting(), trotting(speed=0.7)
    assert walked(own, 2)[-1].decision.forward_speed == 1.2
    assert walked(slow, 2)[-1].decision.forward_speed == 0.7


def test_a_robot_without_a_heading_is_not_turned():
    turned = standing_sensed().orientation.copy()
    turned[0] = np.cos(0.4), 0.0, 0.0, np.sin(0.4)
    known, unknown = trotting(), trotting()
    for number, orientation in enumerate((standing_sensed().orientation, turned, turned), start=1):
        now = PERIOD * number
        known.receive(standing(number, now, orientation=orientation), now)
        unknown.receive(standing(number, now, orientation=orientation, has_heading=False), now)
        rates = [decode_command(one.step(now)).decision.yaw_rate for one in (known, unknown)]
    assert rates == [-0.5, 0.0]  # 0.8 rad to the left; the loop's limit
