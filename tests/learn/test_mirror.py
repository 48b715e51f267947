"""Mirror augmentation against a mirrored simulation: whole environments, gait by gait."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from gaitshift.gait import gaits
from gaitshift.learn.learner import Learner
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.env import Curriculum, EnvConfig, GaitEnv
from gaitshift.sim.env.privileged import PRIVILEGED_SIZE, privileged_mirror
from gaitshift.sim.terrain import flat
from gaitshift.sim.world.randomisation import SAME, Randomisation
from symmetric import symmetric_robot

MIRRORED = {
    # gait: what a mirror makes of each of its states
    "trot": [1, 0],
    "pace": [1, 0],
    "bound": [0, 1],
    "pronk": [0, 1],
    "walk": [2, 3, 0, 1],
    "three_one": [2, 3, 0, 1],
    "half_bound": [2, 3, 0, 1],
}
FEET = ("FL", "FR", "BL", "BR")
OTHER_SIDE = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8]
"""The joints, HAA HFE KFE of FL FR BL BR, with left and right changed."""
OUTWARDS = np.array([-1.0, 1.0, 1.0] * 4)
"""A leg that moves to the left is seen to move to the right; one that folds is seen to fold."""
ACROSS = np.array([1.0, -1.0, 1.0])
FOLD = {"F": np.array([0.0, 1.0, -2.0]), "B": np.array([0.0, -1.0, 2.0])}
"""Actions that lift a fore and a hind foot."""
ROBOTS, STEPS = 6, 50


def mirrored_joints(joints):
    return OUTWARDS * joints[:, OTHER_SIDE]


def stepping(machine, state, rng):
    """Actions (N, 12) that lift what the next state has off the ground and push on the others."""
    following = {edge.source: edge.target for edge in machine.edges}
    stances = {s.name: s.stance for s in machine.states}
    action = np.empty((len(state), 12))
    for robot, u in enumerate(state):
        due = stances[following[machine.states[u].name]]
        legs = [-0.3 * FOLD[foot[0]] if foot in due else 1.5 * FOLD[foot[0]] for foot in FEET]
        action[robot] = np.concatenate(legs)
    return action + 0.15 * rng.normal(size=action.shape)


def twins(gait, robot, *, steps=STEPS, bodies=SAME):
    """Robots under stepping actions and, after them in the same arrays, their mirror images.

    The images' starts, commands and actions are written from the geometry; all else is up to the
    environment. Asked for as little as can be (short dwells, no swing height), so that machines
    change their states.
    """
    machine = gaits.load(gait)
    machine = replace(machine, dwell_range=(4, machine.dwell_range[1]))
    config = EnvConfig(command_interval=10_000, randomisation=bodies)
    env = GaitEnv(machine, flat(20.0, 20.0), 2 * ROBOTS, config=config, robot=robot, threads=1)
    env.curriculum = Curriculum(strictness=0.0)
    env.reset(seed=1)
    if bodies.varies:
        names = list(bodies.ranges())
        drawn = env.world.bodies[:ROBOTS]
        drawn[:, names.index("payload_y")] *= -1.0
        for number, values in enumerate(drawn, start=ROBOTS):
            env.world._models._set(number, values)
    rng = np.random.default_rng(2)

    def pair(one, image):
        return np.concatenate([one, image])

    xy, yaw = rng.uniform(-1, 1, (ROBOTS, 2)), rng.uniform(-3, 3, ROBOTS)
    velocity = rng.uniform(-0.3, 0.3, (ROBOTS, 3))
    joints = robot.stance_angles + rng.uniform(-0.1, 0.1, (ROBOTS, 12))
    heading = yaw + rng.uniform(-0.3, 0.3, ROBOTS)
    speed = rng.uniform(*machine.speed_range, ROBOTS)
    frequency = 100.0 / np.array([machine.stride(int(d)) for d in rng.integers(4, 9, ROBOTS)])
    env.world.place(
        np.arange(2 * ROBOTS),
        xy=pair(xy, ACROSS[:2] * xy),
        yaw=pair(yaw, -yaw),
        joint_position=pair(joints, mirrored_joints(joints)),
        base_velocity_w=pair(velocity, ACROSS * velocity),
    )
    env._commander.heading = pair(heading, -heading)
    first = pair(np.zeros(ROBOTS, dtype=int), np.full(ROBOTS, MIRRORED[gait][0]))
    env._state = env.walker.begin(env.world.sensed, first)
    env._commander.command = replace(
        env._commander.command,
        forward_speed=pair(speed, speed),
        stride_frequency=pair(frequency, frequency),
    )
    env._update_command()
    seen, known, rewards, terms, changed = [], [], [], [], []
    for _ in range(steps):
        action = stepping(machine, env._state.machine_state[:ROBOTS], rng)
        action = pair(action, mirrored_joints(action))
        observation, reward, terminated, truncated, info = env.step(action)
        if (terminated | truncated).any():
            break
        seen.append(observation)
        known.append(env.privileged())
        rewards.append(reward)
        terms.append(np.stack(list(info["reward_terms"].values())))
        changed.append(info["changed"])
    return SimpleNamespace(
        env=env,
        seen=np.stack(seen),
        known=np.stack(known),
        reward=np.stack(rewards),
        terms=np.stack(terms),
        changed=np.stack(changed),
    )


@pytest.fixture(scope="module", params=MIRRORED)
def walked(request, tmp_path_factory):
    """A symmetric robot and its mirror image in one of the gaits."""
    robot = symmetric_robot(tmp_path_factory.mktemp("robot"))
    return request.param, twins(request.param, robot)


def test_every_gait_has_a_mirror_image_but_the_one_with_a_leading_side():
    found = {name: gaits.load(name).mirrored_states() for name in gaits.names()}
    assert found == {
        **{name: tuple(images) for name, images in MIRRORED.items()},
        "gallop": None,
        "stand": (0,),
    }


def test_the_mirror_image_is_seen_as_the_mirrored_observation_says(walked):
    _, both = walked
    order, signs = both.env.walker.observation.mirror
    robots, images = both.seen[:, :ROBOTS], both.seen[:, ROBOTS:]
    # Sums taken in another order differ in the last bit, and contacts make more of that: 5e-6.
    np.testing.assert_allclose(signs * robots[:, :, order], images, atol=1e-4)
    moved = (order != np.arange(len(order))) | (signs < 0)
    apart = np.abs(robots - images).max(axis=(0, 1))
    assert (apart[moved] > 0.01).all(), "without the mirror each of these entries would differ"
    np.testing.assert_allclose(apart[~moved], 0.0, atol=1e-4)


def test_the_mirror_image_of_what_the_critic_alone_sees_is_that_of_the_mirrored_robot(tmp_path):
    bodies = Randomisation(friction=(0.5, 1.0), payload=(2.0, 5.0), payload_y=(-0.1, 0.1))
    both = twins("trot", symmetric_robot(tmp_path), bodies=bodies)
    order, signs = (np.array(one) for one in privileged_mirror())
    robots, images = both.known[:, :ROBOTS], both.known[:, ROBOTS:]
    assert robots.shape == (STEPS, ROBOTS, PRIVILEGED_SIZE)
    np.testing.assert_allclose(signs * robots[:, :, order], images, atol=1e-4)
    moved = (order != np.arange(len(order))) | (signs < 0)
    apart = np.abs(robots - images).max(axis=(0, 1))
    assert (apart[moved] > 0.01).all(), "without the mirror each of these entries would differ"
    np.testing.assert_allclose(apart[~moved], 0.0, atol=1e-4)


def test_the_mirror_image_is_paid_the_same_term_by_term_and_for_the_same_changes(walked):
    _, both = walked
    np.testing.assert_array_equal(both.changed[:, :ROBOTS], both.changed[:, ROBOTS:])
    np.testing.assert_allclose(both.terms[..., :ROBOTS], both.terms[..., ROBOTS:], atol=5e-3)
    np.testing.assert_allclose(both.reward[:, :ROBOTS], both.reward[:, ROBOTS:], atol=5e-3)
    # Much has happened: nearly all robots changed their state, and were paid very differently.
    assert np.count_nonzero(both.changed[:, :ROBOTS].sum(axis=0) >= 2) >= ROBOTS - 1
    assert len(both.changed) == STEPS
    assert np.ptp(both.reward) > 200


def test_training_augments_with_what_the_mirrored_simulation_shows(walked):
    gait, both = walked
    recipe = Recipe(robots=2 * ROBOTS, steps=2, ppo=PpoConfig(hidden=(4,)), threads=1)
    mirror = Learner(both.env, recipe).ppo.mirror
    seen = both.seen[-1]
    actions = np.random.default_rng(0).normal(size=(ROBOTS, 12)).astype(np.float32)
    image = mirror.observation(torch.from_numpy(seen[:ROBOTS])).numpy()
    np.testing.assert_allclose(image, seen[ROBOTS:], atol=1e-4, err_msg=gait)
    imaged = mirror.action(torch.from_numpy(actions)).numpy()
    np.testing.assert_array_equal(imaged, mirrored_joints(actions))


def test_the_shipped_robot_is_paid_nearly_as_its_mirror_image_at_first():
    # The centre of mass of its trunk is 1.4 mm off the middle. Before a foot lands a step later on
    # one side than on the other, that makes 0.06 of rewards that span 18 (measured).
    both = twins("trot", ANYMAL_B, steps=3)
    difference = np.abs(both.reward[:, :ROBOTS] - both.reward[:, ROBOTS:])
    assert difference.max() < 0.2
    assert difference.max() > 1e-3, "or it would be a symmetric robot"
