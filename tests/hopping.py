"""Environments of a gait of two states, in which something happens under arbitrary actions too."""

from dataclasses import replace

import numpy as np

from gaitshift.control.observation import FULL_SLICES
from gaitshift.gait import RewardMachine
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat

FLAT = flat(20.0, 20.0)
FEET = ("FL", "FR", "BL", "BR")
STANCE = ANYMAL_B.stance_angles
DWELL, SWING_HEIGHT = 3, 0.004
EDGES = {0: ({1}, {0}, 1, 1.0), 1: ({0}, {1}, 0, 0.5)}
"""By state: feet that must be down, feet that must be up, next state, multiplier of b."""
HOP = RewardMachine.from_dict(
    {
        "name": "hop",
        "title": "Hop",
        "description": "The front feet take turns: something happens under arbitrary actions too.",
        "dwell": DWELL,
        "swing_height": SWING_HEIGHT,
        "ideal_phase": {"FL": 0.0, "FR": 0.5, "BL": 0.5, "BR": 0.0},
        "state": [
            {"name": "FL", "stance": ["FL", "BL", "BR"]},
            {"name": "FR", "stance": ["FR", "BL", "BR"]},
        ],
        "transition": [
            {"from": "FL", "to": "FR", "down": ["FR"], "up": ["FL"]},
            {"from": "FR", "to": "FL", "down": ["FL"], "up": ["FR"], "bonus": 0.5},
        ],
    }
)
RANGED = replace(
    HOP,
    dwell_range=(2, 8),
    speed=0.9,
    speed_range=(0.4, 1.5),
    lateral_speed=0.3,
    height=-0.02,
    height_range=(-0.1, 0.05),
)
"""The same gait for several commands."""
UNHURRIED = RewardMachine.from_dict(
    HOP.to_dict()
    | {
        "dwell": 8,
        "dwell_range": [8, 8],
        "transition": [
            edge.to_dict() | {"dwell": 8, "bonus": 1.0, "swing_height": 0.0} for edge in HOP.edges
        ],
    }
)
"""The same gait at a slow stride, whatever the height of the swing."""
FOLD = np.array([[0.0, 4.0, -6.0] * 2 + [0.0, -4.0, 6.0] * 2])
"""An action that folds all legs, so that the body comes to the ground."""


def hop(n=3, *, ground=FLAT, threads=1, **config):
    return GaitEnv(HOP, ground, n, config=EnvConfig(**config), threads=threads)


def ranged(n, **config):
    config = EnvConfig(observed=FULL_SLICES, **config)
    return GaitEnv(RANGED, FLAT, n, config=config, threads=1)


def arbitrary_actions(seed, steps, n, size=1.0):
    """Actions (T, N, 12) that stagger about."""
    rng, action, actions = np.random.default_rng(seed), np.zeros((n, 12)), []
    for _ in range(steps):
        action = 0.8 * action + size * rng.normal(size=(n, 12))
        actions.append(action)
    return np.array(actions)


def run(env, actions, seed=5):
    """Everything that reset and the steps return."""
    return [env.reset(seed=seed), *(env.step(action) for action in actions)]


def keep_steps(env, monkeypatch):
    """What was sensed, and the truth, after each physics step, before any robot starts anew."""
    steps, step = [], env.world.step

    def kept(target):
        steps.append(step(target))
        return steps[-1]

    monkeypatch.setattr(env.world, "step", kept)
    return steps


def feed(env, monkeypatch):
    """Contacts (N, 4) to write into: the feet touch as they say, and are 0.2 m high where not."""
    contact, step = np.ones((env.num_envs, 4), dtype=bool), env.world.step

    def fed(target):
        sensed, truth = step(target)
        env.world.sensed = replace(sensed, contact=contact.copy())
        force, clearance = np.where(contact, 70.0, 0.0), np.where(contact, 0.0, 0.2)
        env.world.truth = replace(truth, foot_force=force, clearance=clearance)
        return env.world.sensed, env.world.truth

    monkeypatch.setattr(env.world, "step", fed)
    return contact


def commanded(env, observation):
    """Speeds [m/s] and strides [control steps] that an observation shows, (N,) each."""
    speed, stride = (
        observation[:, env.walker.observation.slices[name]][:, 0].astype(float)
        for name in ("forward_speed_command", "stride_command")
    )
    return speed, 20.0 * stride  # in units of 20 steps


def with_swing_height(height):
    """HOP with another swing height [m] in every guard."""
    edges = (replace(edge, swing_height=height) for edge in HOP.edges)
    return replace(HOP, edges=tuple(edges))
