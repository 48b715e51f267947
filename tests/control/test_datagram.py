"""Datagrams: what is sent is what arrives, and what is not a datagram is dropped."""

import struct
import zlib
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gaitshift.control.deployment.datagram import (
    Command,
    Decision,
    Sensors,
    decode_command,
    decode_sensors,
    encode_command,
    encode_sensors,
)
from gaitshift.control.deployment.inbox import Inbox
from gaitshift.control.deployment.layout import (
    COMMAND_LAYOUT,
    RANGES,
    SENSORS_LAYOUT,
    Malformed,
)
from gaitshift.errors import GaitshiftError
from lockstep import standing, standing_sensed, trotting

DECISION = Decision(
    gait="trot",
    machine_state=1,
    stance_shown=True,
    k=2.5,
    threshold=9.0,
    forward_speed=1.2,
    lateral_speed=0.2,
    body_height=-0.03,
    yaw_rate=-0.1,
    stride_frequency=2.5,
)
COMMAND = Command(
    sequence=7,
    stamp=123_456_789,
    answered=6,
    target=0.1 * np.arange(12.0),
    kp=80.0,
    kd=2.0,
    is_stop=False,
    decision=DECISION,
)
COUNTS = st.integers(1, 2**64 - 1)
SMALL = st.floats(-10.0, 10.0)


def reals(*shape):
    return arrays(np.float64, shape, elements=SMALL)


@given(COUNTS, COUNTS, COUNTS, reals(3, 12), reals(4, 3), reals(4, 3), st.integers(0, 127))
def test_sensors_arrive_bit_by_bit(sequence, stamp, acknowledged, joints, feet, vectors, bits):
    flags = [bool(bits >> n & 1) for n in range(7)]
    turn = vectors[3, 0]
    sensed = standing_sensed(
        contact=np.array([flags[:4]]),
        foot_position_b=feet[None],
        orientation=np.array([[np.cos(turn), 0.0, 0.6 * np.sin(turn), 0.8 * np.sin(turn)]]),
        joint_position=joints[:1],
        joint_velocity=joints[1:2],
        joint_torque=joints[2:],
        angular_velocity_b=vectors[:1],
        velocity_b=vectors[1:2] if flags[4] else None,
        specific_force_b=vectors[2:3] if flags[5] else None,
        has_heading=flags[6],
    )
    sent = Sensors(
        sequence=sequence,
        stamp=stamp,
        acknowledged=acknowledged,
        sensed=sensed,
        is_stopped=flags[0],
    )
    got = decode_sensors(encode_sensors(sent))
    for field in fields(Sensors):
        if field.name != "sensed":
            assert getattr(got, field.name) == getattr(sent, field.name)
    for field in fields(sensed):
        np.testing.assert_array_equal(
            getattr(got.sensed, field.name), getattr(sensed, field.name), field.name
        )


@given(COUNTS, COUNTS, reals(12), st.floats(0.0, 500.0), st.booleans(), st.text(max_size=8))
def test_commands_arrive_bit_by_bit(sequence, stamp, target, gain, flag, gait):
    name = "".join(sign for sign in gait if sign.isprintable() and sign != "\0")
    decision = replace(DECISION, gait=name, stance_shown=flag, k=gain, threshold=np.nan)
    sent = replace(
        COMMAND,
        sequence=sequence,
        stamp=stamp,
        target=target,
        kp=gain,
        kd=gain / 3,
        is_stop=not flag,
        decision=decision,
    )
    got = decode_command(encode_command(sent))
    np.testing.assert_array_equal(got.target, target)
    assert np.isnan(got.decision.threshold)
    for field in fields(Command):
        if field.name not in ("target", "decision"):
            assert getattr(got, field.name) == getattr(sent, field.name)
    for field in fields(Decision):
        if field.name != "threshold":
            assert getattr(got.decision, field.name) == getattr(decision, field.name)


def test_the_layout_is_that_of_a_packed_little_endian_structure_in_c():
    """Written with `struct` from the table of the guide."""
    sensed = standing_sensed(specific_force_b=np.array([[0.5, -0.25, 9.75]]))
    sent = Sensors(sequence=258, stamp=3, acknowledged=4, sensed=sensed)
    body = struct.pack("<4sBBHQQQ4B", b"GAIT", 1, 1, 1 + 2 + 4, 258, 3, 4, 1, 1, 0, 1)
    for name in (
        *("joint_position", "joint_velocity", "joint_torque", "foot_position_b"),
        *("orientation", "angular_velocity_b", "specific_force_b", "velocity_b"),
    ):
        values = getattr(sensed, name).ravel().tolist()
        body += struct.pack(f"<{len(values)}d", *values)
    assert encode_sensors(sent) == body + struct.pack("<I", zlib.crc32(body))
    body = struct.pack("<4sBBHQQQ", b"GAIT", 1, 2, 2, 7, 123_456_789, 6)
    body += struct.pack("<14d32sB", *COMMAND.target, 80.0, 2.0, b"trot", 1)
    body += struct.pack("<7d", 2.5, 9.0, 1.2, -0.1, 2.5, 0.2, -0.03)
    assert encode_command(COMMAND) == body + struct.pack("<I", zlib.crc32(body))


def resealed(data, at, part):
    """The datagram with other bytes at a place, and the CRC that belongs to them."""
    changed = data[:at] + part + data[at + len(part) : -4]
    return changed + struct.pack("<I", zlib.crc32(changed))


def places(layout):
    """Every number of a datagram: name, place, size, greatest magnitude."""
    for name, most in RANGES.items():
        if name in layout.names:
            kind, at = layout.fields[name][:2]
            for index in range(int(np.prod(kind.shape, dtype=int))):
                yield name, at + 8 * index, most


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1.0001, -1.0001])
def test_every_number_out_of_range_is_found_whatever_its_crc(wrong):
    sensors = standing(1, 0.0, specific_force_b=np.zeros((1, 3)))
    for data, layout, decode in (
        (sensors, SENSORS_LAYOUT, decode_sensors),
        (encode_command(COMMAND), COMMAND_LAYOUT, decode_command),
    ):
        found = list(places(layout))
        assert len(found) == (36 + 12 + 4 + 9 if layout == SENSORS_LAYOUT else 12 + 2 + 7)
        for name, at, most in found:
            value = wrong * most if np.isfinite(wrong) else wrong
            changed = resealed(data, at, struct.pack("<d", value))
            if np.isnan(wrong) and name in ("k", "threshold"):
                decode(changed)
                continue
            with pytest.raises(Malformed):
                decode(changed)


@pytest.mark.parametrize(
    ("at", "part"),
    [
        (0, b"gait"),
        (4, b"\2"),  # version
        (5, b"\2"),  # kind
        (6, b"\x10"),  # a flag that there is not
        (8, bytes(8)),  # sequence 0
        (32, b"\2"),  # a contact that is neither 0 nor 1
    ],
)
def test_a_header_that_is_wrong_is_found_whatever_its_crc(at, part):
    with pytest.raises(Malformed):
        decode_sensors(resealed(standing(1, 0.0), at, part))


def test_a_name_that_cannot_be_printed_and_negative_gains_are_found():
    data, at = encode_command(COMMAND), COMMAND_LAYOUT.fields
    for name, part in (
        ("gait", b"tr\nt"),
        ("gait", b"\xff"),
        ("kp", struct.pack("<d", -1.0)),
        ("kd", struct.pack("<d", -0.1)),
    ):
        with pytest.raises(Malformed):
            decode_command(resealed(data, at[name][1], part))


def test_what_is_no_datagram_cannot_be_sent():
    with pytest.raises(GaitshiftError, match="target"):
        encode_command(replace(COMMAND, target=np.full(12, np.nan)))
    with pytest.raises(GaitshiftError, match="gaits"):
        encode_command(replace(COMMAND, decision=replace(DECISION, gait="long" * 9)))
    with pytest.raises(GaitshiftError, match="joint_torque"):
        standing(1, 0.0, joint_torque=None)


def test_only_datagrams_that_rise_in_number_and_time_are_taken():
    inbox = Inbox(decode_sensors)
    taken = []
    for sequence, now in ((5, 0.5), (5, 0.5), (4, 0.6), (6, 0.4), (7, 0.7), (8, 0.8), (7, 0.7)):
        taken.append(inbox.add(standing(sequence, now), now))
    assert taken == [True, False, False, False, True, True, False]
    assert (inbox.counts.accepted, inbox.counts.late, inbox.counts.malformed) == (3, 4, 0)
    assert inbox.newest.sequence == 8
    assert inbox.arrived == 0.8


def fuzzed(rng, good):
    """Random bytes, a datagram with some flipped bits, or a part of one, with or without more."""
    kind = rng.integers(4)
    if kind == 0:
        return rng.bytes(int(rng.integers(0, 2 * len(good))))
    if kind == 1:
        return good[: rng.integers(len(good))]
    if kind == 2:
        return good + rng.bytes(int(rng.integers(1, 600)))
    flipped = bytearray(good)
    for bit in rng.choice(8 * len(good), int(rng.integers(1, 40)), replace=False).tolist():
        flipped[bit // 8] ^= 1 << bit % 8
    return bytes(flipped)


@pytest.mark.parametrize("count", [2000, pytest.param(100_000, marks=pytest.mark.slow)])
def test_no_fuzzed_datagram_raises_or_changes_a_target(count):
    rng = np.random.default_rng(count)
    deployment, quiet = trotting(watchdog=10.0), trotting(watchdog=10.0)
    steps = 20
    for number in range(1, steps + 1):
        good = standing(number, 0.01 * number)
        for _ in range(count // steps):
            deployment.receive(fuzzed(rng, standing(number + 1, 0.01 * number + 1)), 0.01 * number)
        for one in (deployment, quiet):
            one.receive(good, 0.01 * number)
            one.step(0.01 * number)
        np.testing.assert_array_equal(deployment.last.target, quiet.last.target)
    assert deployment.inbox.counts.malformed == count
    assert deployment.inbox.counts.accepted == steps
