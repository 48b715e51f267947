"""Policies that nobody trained, and robots for drivers and switchers to look at."""

import numpy as np
import torch

from gaitshift.control import policy
from gaitshift.gait import gaits
from gaitshift.learn.export import describe, export
from gaitshift.learn.learner import Learner
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.state import Proprioception
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


def sensed_of(contacts, heights=None, *, time=0.0):
    """Robots upright; contacts such as "FL BR", and heights (N, 4) of the feet [m]."""
    n = len(contacts)
    foot = np.tile(
        [[0.34, 0.2, 0], [0.35, -0.21, 0], [-0.33, 0.22, 0], [-0.36, -0.23, 0]], (n, 1, 1)
    )
    foot[..., 2] = (0.0 if heights is None else np.asarray(heights)) - BASE_HEIGHT
    return Proprioception(
        contact=np.array([[name in contact.split() for name in FEET] for contact in contacts]),
        foot_position_b=foot,
        orientation=np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
        joint_position=np.tile(STANCE + 0.01 * np.arange(12), (n, 1)),
        joint_velocity=np.tile(0.1 * np.arange(12.0), (n, 1)),
        joint_torque=np.zeros((n, 12)),
        velocity_b=np.tile([0.9, 0.1, -0.05], (n, 1)),
        angular_velocity_b=np.tile([0.1, 0.2, 0.3], (n, 1)),
        time=time,
    )


def staggering(robots, steps):
    """What robots sense that stagger under arbitrary actions."""
    env = GaitEnv(gaits.load("trot"), flat(20.0, 20.0), robots, config=EnvConfig(), threads=1)
    env.reset(seed=0)
    rng, action = np.random.default_rng(1), np.zeros((robots, 12))
    for _ in range(steps):
        action = 0.8 * action + rng.normal(size=(robots, 12))
        env.step(action)
        yield env.world.sensed


def gaits_of(controller):
    """Names of the gaits that robots are in."""
    return [controller.repertoire.gaits[index] for index in controller.gait]
