"""Contact sequences with known answers, and logs around them."""

from dataclasses import fields, replace

import numpy as np

from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.state import Privileged, Proprioception

TABLE = {
    # gait: (touchdowns of each foot in one cycle [cycle], share of the cycle each is down)
    "trot": (((0.0,), (0.5,), (0.5,), (0.0,)), (0.50, 0.50, 0.50, 0.50)),
    "pace": (((0.0,), (0.5,), (0.0,), (0.5,)), (0.50, 0.50, 0.50, 0.50)),
    "bound": (((0.0,), (0.0,), (0.5,), (0.5,)), (0.50, 0.50, 0.50, 0.50)),
    "pronk": (((0.0,), (0.0,), (0.0,), (0.0,)), (0.50, 0.50, 0.50, 0.50)),
    "walk": (((0.0,), (0.5,), (0.75,), (0.25,)), (0.75, 0.75, 0.75, 0.75)),
    "three_one": (((0.0,), (0.5,), (0.0, 0.5), (0.0, 0.5)), (0.50, 0.50, 0.66, 0.66)),
    "half_bound": (((0.0, 0.5), (0.0, 0.5), (0.75,), (0.25,)), (0.50, 0.50, 0.25, 0.25)),
    "gallop": (((0.0,), (0.8,), (0.5,), (0.3,)), (0.25, 0.25, 0.25, 0.25)),
}
"""Written by hand from what each gait is: feet FL, FR, BL, BR."""


def contacts(
    touchdowns,
    duty,
    *,
    frequency,
    seconds=10.0,
    robots=4,
    jitter=0.0,
    seed=0,
):
    """Contacts (T, N, 4) at 100 Hz of feet that come down at these fractions of each cycle.

    Every robot starts at a phase of its own, and every touchdown and liftoff comes early or late by
    up to `jitter` [s].
    """
    rng = np.random.default_rng(seed)
    steps = round(100 * seconds)
    contact = np.zeros((steps, robots, 4), dtype=bool)
    clock = np.arange(steps) / 100
    for robot in range(robots):
        offset = rng.uniform()
        for leg in range(4):
            stance = duty[leg] / len(touchdowns[leg])
            for cycle in range(-2, round(frequency * seconds) + 3):
                for at in touchdowns[leg]:
                    down, up = rng.uniform(-jitter, jitter, 2)
                    begin = (cycle + at - offset) / frequency + down
                    end = (cycle + at + stance - offset) / frequency + up
                    contact[(clock >= begin) & (clock < end), robot, leg] = True
    return contact


def log_of(contact, *, gaits=("trot",), terrain=None, **changes):
    """A log at 100 Hz of robots that have contacts and stand level at the origin, 0.45 m high.

    `changes` are arrays by name, as for `changed`; what is not given is zero. `terrain` is the
    ground that the log keeps.
    """
    steps, n, _ = contact.shape
    shape, size, origin = (steps, n), np.ones(2), np.zeros(2)
    if terrain is not None:
        size, origin = np.array(terrain.size), np.array(terrain.origin)
    standing = np.tile([1.0, 0.0, 0.0, 0.0], (*shape, 1))
    sensed = Proprioception(
        contact=contact,
        foot_position_b=np.tile([0.0, 0.0, -0.45], (*shape, 4, 1)),
        orientation=standing,
        joint_position=np.tile(ANYMAL_B.stance_angles, (*shape, 1)),
        joint_velocity=np.zeros((*shape, 12)),
        joint_torque=np.zeros((*shape, 12)),
        velocity_b=np.zeros((*shape, 3)),
        angular_velocity_b=np.zeros((*shape, 3)),
        mass=ANYMAL_B.mass,
        time=np.arange(1, steps + 1) / 100,
        forward_speed_command=np.full(shape, 1.2),
        yaw_rate_command=np.zeros(shape),
        stride_frequency_command=np.full(shape, 2.5),
    )
    truth = Privileged(
        base_position_w=np.tile([0.0, 0.0, 0.45], (*shape, 1)),
        base_quaternion_w=standing.copy(),
        velocity_b=np.zeros((*shape, 3)),
        foot_position_w=np.zeros((*shape, 4, 3)),
        foot_velocity_w=np.zeros((*shape, 4, 3)),
        foot_force=np.where(contact, 70.0, 0.0),
        clearance=np.zeros((*shape, 4)),
        body_contact=np.zeros(shape, dtype=bool),
        diverged=np.zeros(shape, dtype=bool),
    )
    log = Log(
        sensed=sensed,
        truth=truth,
        k=np.zeros(shape),
        threshold=np.zeros(shape),
        gait=np.zeros(shape, dtype=np.int64),
        machine_state=np.zeros(shape, dtype=np.int64),
        stance_shown=np.zeros(shape, dtype=bool),
        fallen=np.zeros(shape, dtype=bool),
        gaits=gaits,
        robot="anymal_b",
        terrain="flat" if terrain is None else terrain.name,
        terrain_height=np.zeros((2, 2)) if terrain is None else terrain.height,
        terrain_size=size,
        terrain_origin=origin,
    )
    return changed(log, **changes)


def changed(log, **changes):
    """The log with other arrays, each in whichever of its records it belongs to.

    An array is broadcast to the shape of the one that it replaces. `quaternion` is the attitude in
    both records, as `velocity_b` is the velocity in both; feet in `contact` bear 70 N.
    """
    if "quaternion" in changes:
        quaternion = changes.pop("quaternion")
        changes |= {"orientation": quaternion, "base_quaternion_w": quaternion}
    if "contact" in changes:
        changes.setdefault("foot_force", np.where(changes["contact"], 70.0, 0.0))
    records = {"sensed": log.sensed, "truth": log.truth}
    known = {field.name for record in (log, *records.values()) for field in fields(record)}
    assert set(changes) <= known, set(changes) - known
    made = {name: _replaced(record, changes) for name, record in records.items()}
    return replace(_replaced(log, changes), **made)


def _replaced(record, changes):
    names = {field.name for field in fields(record)} & set(changes)
    return replace(record, **{name: _like(getattr(record, name), changes[name]) for name in names})


def _like(before, value):
    if not isinstance(before, np.ndarray) or np.shape(value) == before.shape:
        return value
    return np.broadcast_to(value, before.shape).copy()


def turned(yaw):
    """Unit quaternions (w, x, y, z) of level bodies with this heading [rad]."""
    zero = np.zeros_like(yaw)
    return np.stack([np.cos(yaw / 2), zero, zero, np.sin(yaw / 2)], axis=-1)
