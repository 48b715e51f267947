"""What robots sense, made up: standing still, at random, and on a stroll over given ground."""

import math
from dataclasses import replace

import numpy as np

from gaitshift.robot.state import Proprioception, orientation_of
from turning import rotation

PERIOD = 0.01
"""A control step [s]."""
DOWN = np.array([0.0, 0.0, -1.0])
FEET = np.array(
    [[0.34, 0.21, -0.5], [0.35, -0.22, -0.5], [-0.33, 0.23, -0.5], [-0.36, -0.24, -0.5]]
)
"""Feet of a robot that stands on level ground, unlike for each leg [m]."""
ONE_UP = FEET.copy()
"""The first foot 10 cm above the others: three pairs differ by that."""
ONE_UP[0, 2] += 0.1
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])


def standing(n=1, feet=FEET, **others):
    """Robots that stand upright on all feet and know no heading."""
    given = {
        "contact": np.ones((n, 4), dtype=bool),
        "foot_position_b": np.tile(feet, (n, 1, 1)),
        "orientation": np.tile(UPRIGHT, (n, 1)),
        "has_heading": False,
    }
    return Proprioception(**(given | others))


def tilted(sensed, gravity_b):
    """The same in bodies that see gravity so."""
    return replace(sensed, orientation=orientation_of(gravity_b))


def headed(sensed, yaw):
    """The same with these headings [rad]."""
    return replace(sensed, orientation=orientation_of(sensed.gravity_b, yaw), has_heading=True)


def random_sensed(rng, n, step):
    """What robots sense, unlike for every robot, foot and step."""
    gravity = DOWN + 0.3 * rng.normal(size=(n, 3))
    gravity /= np.linalg.norm(gravity, axis=1, keepdims=True)
    # No two alike, and steady: nothing is known of a robot that is thrown off its heading.
    yaw = np.linspace(-2.0, 2.0, n) + 0.005 * rng.normal(size=n)
    return Proprioception(
        contact=rng.random((n, 4)) < 0.6,
        foot_position_b=FEET + rng.normal(scale=0.1, size=(n, 4, 3)),
        orientation=orientation_of(gravity, yaw),
        joint_velocity=rng.normal(size=(n, 12)),
        joint_torque=rng.normal(scale=30.0, size=(n, 12)),
        velocity_b=rng.normal(size=(n, 3)),
        angular_velocity_b=rng.normal(size=(n, 3)),
        mass=30.0,
        time=PERIOD * step,
        forward_speed_command=rng.random(n),
        stride_frequency_command=1.0 / (0.3 + rng.random(n)),
        value=rng.normal(size=n),
    )


def strolling(height, *, seconds=4.0, speed=1.0, turn=0.2, wobble=0.15):
    """A robot that trots over ground of a height(x, y): where its base is [m], what it senses.

    Feet stand still in the world while they touch, and the body rolls and pitches meanwhile.
    """
    stride, phase = 0.5, np.array([0.0, 0.5, 0.5, 0.0])
    plan = FEET[:, :2]
    stood = [None] * 4
    for step in range(round(seconds / PERIOD)):
        time = step * PERIOD
        yaw = turn * math.sin(time)
        base = np.array([speed * time, 0.1 * math.sin(time), 0.0])
        base[2] = 0.5 + height(*base[:2])
        turned = rotation(wobble * math.sin(9 * time), wobble * math.cos(7 * time), yaw)
        feet, contact = np.empty((4, 3)), np.zeros(4, dtype=bool)
        for leg in range(4):
            within = (time / stride + phase[leg]) % 1.0
            contact[leg] = within < 0.55
            xy = base[:2] + rotation(0, 0, yaw)[:2, :2] @ plan[leg]
            if contact[leg] and stood[leg] is None:
                stood[leg] = np.array([*xy, height(*xy)])
            if not contact[leg]:
                stood[leg] = None
            feet[leg] = stood[leg] if contact[leg] else [*xy, height(*xy) + 0.1]
        yield (
            base,
            Proprioception(
                contact=contact[None],
                foot_position_b=((feet - base) @ turned)[None],
                orientation=orientation_of((DOWN @ turned)[None], np.array([yaw])),
                time=time,
            ),
        )


def course(statistic, height, **walk):
    """What a statistic of one number says in each step of a stroll over height(x, y)."""
    state, seen = statistic.start(1), []
    for _, sensed in strolling(height, **walk):
        state, value = statistic.step(state, sensed)
        seen.append(value[0, 0])
    return np.array(seen)
