"""The two records: hand tables, mechanics, invariances, any leading axes."""

from dataclasses import dataclass, fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jaxtyping import Float
from scipy.spatial.transform import Rotation

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import (
    Batch,
    Privileged,
    Proprioception,
    orientation_of,
    rotation_of,
    trailing_axes,
    turned,
)

HALF = np.sqrt(0.5)
UPRIGHT = (1.0, 0.0, 0.0, 0.0)
FEET = np.array([[0.3, 0.2, -0.5], [0.3, -0.2, -0.5], [-0.3, 0.2, -0.5], [-0.3, -0.2, -0.5]])
"""FL, FR, BL, BR of a robot that stands on level ground, 0.5 m under its base [m]."""
angles = st.floats(-3.1, 3.1)


def level(*batch, **given):
    """Robots that stand upright on `FEET`, with these leading axes."""
    values = {
        "contact": np.ones((*batch, 4), dtype=bool),
        "foot_position_b": np.broadcast_to(FEET, (*batch, 4, 3)).copy(),
        "orientation": np.broadcast_to(UPRIGHT, (*batch, 4)).copy(),
    }
    return Proprioception(**(values | given))


def random_quaternions(rng, *batch):
    quaternion = rng.normal(size=(*batch, 4))
    return quaternion / np.linalg.norm(quaternion, axis=-1, keepdims=True)


def random_sensed(*batch, seed=0):
    """Everything that can be sensed, at random, at 100 Hz along the first axis of two."""
    rng = np.random.default_rng(seed)
    return Proprioception(
        contact=rng.random((*batch, 4)) < 0.5,
        foot_position_b=rng.normal(size=(*batch, 4, 3)),
        orientation=random_quaternions(rng, *batch),
        joint_position=rng.normal(size=(*batch, 12)),
        joint_velocity=rng.normal(size=(*batch, 12)),
        joint_torque=rng.normal(size=(*batch, 12)),
        velocity_b=rng.normal(size=(*batch, 3)),
        angular_velocity_b=rng.normal(size=(*batch, 3)),
        time=0.01 * np.arange(1, batch[0] + 1) if len(batch) == 2 else 0.07,
        forward_speed_command=rng.normal(size=batch),
        yaw_rate_command=rng.normal(size=batch),
        stride_frequency_command=rng.normal(size=batch),
        value=rng.normal(size=batch),
    )


def random_truth(*batch, seed=1):
    rng = np.random.default_rng(seed)
    return Privileged(
        base_position_w=rng.normal(size=(*batch, 3)),
        base_quaternion_w=random_quaternions(rng, *batch),
        velocity_b=rng.normal(size=(*batch, 3)),
        foot_position_w=rng.normal(size=(*batch, 4, 3)),
        foot_velocity_w=rng.normal(size=(*batch, 4, 3)),
        foot_force=rng.normal(size=(*batch, 4)),
        clearance=rng.normal(size=(*batch, 4)),
        body_contact=rng.random(batch) < 0.5,
        diverged=rng.random(batch) < 0.5,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Entry(Batch):
    """A record of two records, an array of its own and a name, as a log is one."""

    sensed: Proprioception
    truth: Privileged
    k: Float[np.ndarray, "*batch"]
    heights: Float[np.ndarray, "rows cols"]
    name: str


def entry(*batch):
    return Entry(
        sensed=random_sensed(*batch),
        truth=random_truth(*batch),
        k=np.random.default_rng(2).normal(size=batch),
        heights=np.arange(6.0).reshape(3, 2),
        name="field",
    )


DERIVED = (
    *("gravity_b", "yaw", "power", "forward_speed", "foot_height", "foot_position_upright"),
    *("base_height", "rotation"),
)


def assert_same(one, other, *, also_time=True):
    """All fields of two records are the same, bit for bit."""
    for field in fields(one):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, Batch):
            assert_same(a, b, also_time=also_time)
        elif also_time or field.name != "time":
            np.testing.assert_array_equal(a, b, err_msg=field.name)


# What is derived --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("orientation", "down"),
    [
        (UPRIGHT, (0, 0, -1)),
        ((HALF, HALF, 0, 0), (0, -1, 0)),  # rolled by 90°: its right side is down
        ((HALF, -HALF, 0, 0), (0, 1, 0)),
        ((HALF, 0, HALF, 0), (1, 0, 0)),  # pitched by 90°: its nose is down
        ((HALF, 0, -HALF, 0), (-1, 0, 0)),
        ((0, 1, 0, 0), (0, 0, 1)),  # on its back
        ((HALF, 0, 0, HALF), (0, 0, -1)),  # turned to the left: still upright
        # Rolled by 30°, and pitched by 30°: sin and cos of it.
        ((np.cos(np.pi / 12), np.sin(np.pi / 12), 0, 0), (0, -0.5, -np.sqrt(0.75))),
        ((np.cos(np.pi / 12), 0, np.sin(np.pi / 12), 0), (0.5, 0, -np.sqrt(0.75))),
    ],
)
def test_gravity_in_the_body_is_that_of_the_hand_table(orientation, down):
    sensed = level(1, orientation=np.array([orientation], dtype=float))
    np.testing.assert_allclose(sensed.gravity_b, [down], rtol=0, atol=1e-15)


@given(yaw=angles, pitch=st.floats(-1.5, 1.5), roll=angles)
def test_the_heading_is_the_first_of_the_three_turns(yaw, pitch, roll):
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    sensed = level(1, orientation=turn.as_quat(scalar_first=True)[None])
    difference = sensed.yaw - yaw
    np.testing.assert_allclose(np.sin(difference / 2), 0.0, atol=1e-9)
    assert -np.pi <= sensed.yaw.item() <= np.pi


@pytest.mark.parametrize("joint", range(12))
def test_each_joint_adds_the_size_of_its_torque_times_its_speed(joint):
    """3 N·m at -2 rad/s are 6 W; a joint that pushes or turns alone has no power."""
    torque, velocity = np.zeros((3, 12)), np.zeros((3, 12))
    torque[0, joint], velocity[0, joint] = 3.0, -2.0
    torque[1, joint], velocity[1, joint - 1] = 3.0, 2.0
    torque[2], velocity[2] = 1.0, 0.5
    sensed = level(3, joint_torque=torque, joint_velocity=velocity)
    np.testing.assert_array_equal(sensed.power, [6.0, 0.0, 6.0])


@given(roll=st.floats(-1.5, 1.5))
def test_a_roll_lifts_the_feet_of_the_left_side_by_trigonometry(roll):
    """A foot at (y, z) of a body rolled by r is y·sin r + z·cos r above the base."""
    orientation = np.array([[np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0]])
    left, right = (y * np.sin(roll) - 0.5 * np.cos(roll) for y in (0.2, -0.2))
    sensed = level(1, orientation=orientation)
    np.testing.assert_allclose(sensed.foot_height, [[left, right, left, right]], atol=1e-12)
    np.testing.assert_allclose(sensed.base_height, [-min(left, right)], atol=1e-12)


@given(pitch=st.floats(-1.5, 1.5))
def test_a_pitch_lowers_the_front_feet_by_trigonometry(pitch):
    """A foot at (x, z) of a body pitched by p is -x·sin p + z·cos p above the base."""
    orientation = np.array([[np.cos(pitch / 2), 0.0, np.sin(pitch / 2), 0.0]])
    front, back = (-x * np.sin(pitch) - 0.5 * np.cos(pitch) for x in (0.3, -0.3))
    sensed = level(1, orientation=orientation)
    np.testing.assert_allclose(sensed.foot_height, [[front, front, back, back]], atol=1e-12)


@given(turn=angles)
def test_a_turn_about_the_vertical_changes_the_heading_alone(turn):
    sensed = random_sensed(6)
    seen = replace(sensed, orientation=turned(sensed.orientation, np.full(6, turn)))
    for name in ("gravity_b", "foot_height", "base_height", "power", "forward_speed"):
        np.testing.assert_allclose(
            getattr(seen, name), getattr(sensed, name), rtol=0, atol=1e-12, err_msg=name
        )
    np.testing.assert_allclose(np.sin((seen.yaw - sensed.yaw - turn) / 2), 0.0, atol=1e-9)


def test_the_forward_speed_is_the_first_of_the_velocity_in_the_body():
    velocity = np.array([[1.2, 0.3, -0.1], [-0.4, 0.0, 0.2]])
    np.testing.assert_array_equal(level(2, velocity_b=velocity).forward_speed, [1.2, -0.4])
    truth = replace(random_truth(2), velocity_b=velocity)
    np.testing.assert_array_equal(truth.forward_speed, [1.2, -0.4])


# Quaternions ------------------------------------------------------------------------------------


def test_rotations_and_turns_are_those_of_scipy():
    rng = np.random.default_rng(0)
    quaternion, yaw = random_quaternions(rng, 50), rng.uniform(-3, 3, 50)
    rotation = Rotation.from_quat(quaternion, scalar_first=True)
    np.testing.assert_allclose(rotation_of(quaternion), rotation.as_matrix(), rtol=0, atol=1e-14)
    both = Rotation.from_euler("Z", yaw[:, None]) * rotation
    np.testing.assert_allclose(
        rotation_of(turned(quaternion, yaw)), both.as_matrix(), rtol=0, atol=1e-14
    )


@given(yaw=angles, tilt=st.floats(0.0, 3.0), towards=angles)
def test_the_orientation_of_a_gravity_and_a_heading_gives_both_back(yaw, tilt, towards):
    """For any tilt but where the body's x axis is vertical: it has no heading there."""
    gravity = np.array([np.sin(tilt) * np.cos(towards), np.sin(tilt) * np.sin(towards)])
    gravity = np.array([[*gravity, -np.cos(tilt)]])
    orientation = orientation_of(gravity, np.array([yaw]))
    np.testing.assert_allclose(np.linalg.norm(orientation, axis=1), 1.0, atol=1e-12)
    sensed = level(1, orientation=orientation)
    np.testing.assert_allclose(sensed.gravity_b, gravity, rtol=0, atol=1e-12)
    if abs(gravity[0, 0]) < 0.999:
        np.testing.assert_allclose(np.sin((sensed.yaw - yaw) / 2), 0.0, atol=1e-9)


def test_a_level_body_without_a_turn_has_the_unit_quaternion():
    np.testing.assert_array_equal(orientation_of(np.array([0.0, 0.0, -1.0])), UPRIGHT)


# Leading axes -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DERIVED)
def test_steps_and_robots_have_the_numbers_that_each_alone_has(name):
    log = random_sensed(5, 3)
    whole = getattr(log, name)
    assert whole.shape[:2] == (5, 3)
    for t in range(5):
        np.testing.assert_array_equal(whole[t], getattr(log[t], name))
        for robot in range(3):
            alone = log[t].robots(np.array([robot]))
            np.testing.assert_array_equal(whole[t, robot], getattr(alone, name)[0])


def test_axes_behind_the_robots_are_counted_from_the_annotations():
    axes = trailing_axes(Proprioception)
    assert {name: axes[name] for name in ("value", "contact", "foot_position_b")} == {
        "value": 0,
        "contact": 1,
        "foot_position_b": 2,
    }
    assert axes["time"] is axes["period"] is axes["has_heading"] is None


def test_steps_put_together_are_the_record_that_they_were_taken_from():
    log = entry(5, 3)
    again = Entry.stack([log[t] for t in range(5)])
    assert_same(again, log)
    assert again.sensed.time.tolist() == log.sensed.time.tolist()


def test_a_step_has_its_own_time_and_a_stretch_has_its_times():
    log = entry(5, 3)
    assert log[2].sensed.time == log.sensed.time[2] == 0.03
    assert isinstance(log[2].sensed.time, float)
    assert log[1:4].sensed.time.tolist() == log.sensed.time[1:4].tolist()
    np.testing.assert_array_equal(log[1:4].k, log.k[1:4])
    np.testing.assert_array_equal(log[1:4].truth.clearance, log.truth.clearance[1:4])


def test_some_of_the_robots_are_those_of_the_last_leading_axis_in_the_order_asked_for():
    log, ids = entry(5, 3), np.array([2, 0])
    some = log.robots(ids)
    np.testing.assert_array_equal(some.k, log.k[:, ids])
    np.testing.assert_array_equal(some.sensed.foot_position_b, log.sensed.foot_position_b[:, ids])
    np.testing.assert_array_equal(some.truth.body_contact, log.truth.body_contact[:, ids])
    assert_same(log[3].robots(ids), some[3])
    np.testing.assert_array_equal(some.sensed.time, log.sensed.time)
    assert_same(log.robots(slice(0, 3)), log)


def test_what_is_of_no_robot_stays_as_it_is():
    log = entry(5, 3)
    for part in (log[2], log[1:3], log.robots(np.array([1])), Entry.stack([log[0], log[1]])):
        np.testing.assert_array_equal(part.heights, log.heights)
        assert part.name == "field"
        assert part.sensed.period == log.sensed.period


def test_robots_put_back_take_the_places_of_those_they_were():
    step, ids = random_truth(4), np.array([3, 1])
    other = random_truth(2, seed=9)
    merged = step.with_robots(ids, other)
    assert_same(merged.robots(ids), other)
    rest = np.array([0, 2])
    assert_same(merged.robots(rest), step.robots(rest))
    assert_same(step, random_truth(4))  # nothing was written to


@pytest.mark.parametrize("field", [field.name for field in fields(Proprioception)])
def test_a_copy_with_another_field_derives_what_a_new_record_would(field):
    one, other = random_sensed(3), random_sensed(3, seed=5)
    for name in DERIVED:
        getattr(one, name)  # computed before the copy
    other = replace(other, has_heading=not one.has_heading)
    values = {field: getattr(other, field)}
    copy, anew = one.having(**values), replace(one, **values)
    assert_same(copy, anew)
    for name in DERIVED:
        np.testing.assert_array_equal(getattr(copy, name), getattr(anew, name), err_msg=name)


def test_a_copy_shares_what_was_computed_where_it_still_holds():
    blind = replace(random_sensed(3), velocity_b=None)
    rotation, velocity = blind.rotation, np.ones((3, 3))
    seeing = blind.having(velocity_b=velocity, time=3.0)
    assert seeing.rotation is rotation
    assert seeing.forward_speed.tolist() == [1.0] * 3
    assert seeing.having(velocity_b=2 * velocity).forward_speed.tolist() == [2.0] * 3


def test_single_precision_is_of_real_numbers_alone():
    log = entry(5, 3)
    single = log.as_type(np.float32)
    assert single.sensed.contact.dtype == single.truth.body_contact.dtype == bool
    assert single.sensed.orientation.dtype == single.k.dtype == np.float32
    assert single.sensed.time.dtype == np.float64
    np.testing.assert_array_equal(single.truth.clearance, log.truth.clearance.astype(np.float32))


def test_what_a_robot_lacks_stays_lacking():
    sensed = level(5, 3, time=np.arange(5.0))
    for part in (sensed[1], sensed.robots(np.array([0])), sensed.as_type(np.float32)):
        assert part.value is None
        assert part.joint_torque is None
    assert Proprioception.stack([sensed[0], sensed[1]]).velocity_b is None


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("power", "'power' needs 'joint_torque', which is not given"),
        ("forward_speed", "'forward speed' needs 'velocity_b', which is not given"),
    ],
)
def test_a_field_that_is_not_given_is_named_in_one_line(name, line):
    with pytest.raises(GaitshiftError) as error:
        getattr(level(2), name)
    assert str(error.value) == line
    with pytest.raises(GaitshiftError) as error:
        level(2).need("value", "value_drop")
    assert str(error.value) == "'value_drop' needs 'value', which is not given"
