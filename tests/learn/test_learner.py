"""Values with a closed form, and the mirror image of a batch."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from tensordict import TensorDict

from gaitshift.gait import RewardMachine, gaits
from gaitshift.learn.learner import Learner, as_tensors
from gaitshift.learn.ppo import adapted
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.env.privileged import PRIVILEGED_SIZE
from gaitshift.sim.terrain import flat
from training import TINY, TROT

DISCOUNT = 0.9
ORACLE = Recipe(
    env=EnvConfig(observed=("contact",)),
    ppo=PpoConfig(
        hidden=(32,),
        discount=DISCOUNT,
        epochs=4,
        mini_batches=2,
        learning_rate=5e-3,
        desired_kl=0.0,
        reward_scale=1.0,
        mirror=False,
    ),
    robots=32,
    steps=16,
    threads=1,
)


def learned_values(env, recipe, observations, *, iterations):
    """V of the observations, as the critic has it after some iterations; the actor stays as it is.

    All actions earn the same here, so an actor that learns drifts, and so do its observations.
    """
    torch.set_num_threads(1)
    torch.manual_seed(0)
    learner = Learner(env, recipe)
    learner.ppo.actor.requires_grad_(False)
    for _ in range(iterations):
        learner.iterate()
    seen = torch.from_numpy(np.asarray(observations, dtype=np.float32))
    with torch.no_grad():
        return learner.ppo.critic(TensorDict({"policy": seen}, batch_size=[len(seen)])).squeeze(1)


class EveryStepIsWorthOne(GaitEnv):
    """The true environment with another reward."""

    falls = cuts = 0

    def step(self, actions):
        observation, reward, terminated, truncated, info = super().step(actions)
        self.falls += int(terminated.sum())
        self.cuts += int(truncated.sum())
        return observation, np.ones_like(reward), terminated, truncated, info


@pytest.mark.slow
def test_a_reward_of_one_for_ever_is_worth_its_geometric_sum_though_episodes_are_cut_short():
    # 1 + γ + γ² + … = 1 / (1 - γ) = 10; five steps alone would be worth at most 4.1.
    # Only the action is shown: the critic must not tell by the observation that an episode is over.
    config = EnvConfig(observed=("last_action",), episode_steps=5)
    recipe = replace(ORACLE, env=config, robots=16)
    env = EveryStepIsWorthOne(TROT, flat(20.0, 20.0), 16, config=config, threads=1)
    seen = 0.5 * np.random.default_rng(0).normal(size=(400, 12))
    values = learned_values(env, recipe, seen, iterations=60)
    assert (env.falls, env.cuts) == (0, 16 * 60 * 16 // 5)
    assert values.mean().item() == pytest.approx(10.0, rel=0.02)


class Toss(GaitEnv):
    """Noise to look at, a reward of 1 a step, and an end by the toss of a coin."""

    chance = 0.25

    def __init__(self):
        super().__init__(TROT, flat(20.0, 20.0), 32, config=ORACLE.env, threads=1)
        self.rng = np.random.default_rng(0)

    def step(self, actions):
        ended = self.rng.random(32) < self.chance
        none = np.zeros(32, dtype=bool)
        info = {"reward_terms": {}, "bonus": none, "changed": none, "shows_stance": none}
        info |= {
            "forward_speed": np.zeros(32),
            "diverged": none,
            "final_obs": self.noise(),
            "_final_obs": ended,
        }
        return self.noise(), np.ones(32), ended, none, info

    def noise(self):
        return self.rng.normal(size=(32, 4)).astype(np.float32)


@pytest.mark.parametrize("scale", [1.0, 0.5])
def test_nothing_is_earned_after_a_fall(scale):
    # V = 1 + γ (1 - p) V, so V = 1 / (1 - 0.9 · 0.75) = 3.077; the scale is PPO's alone.
    recipe = replace(ORACLE, ppo=replace(ORACLE.ppo, reward_scale=scale))
    seen = np.random.default_rng(1).normal(size=(400, 4))
    values = learned_values(Toss(), recipe, seen, iterations=60)
    assert values.mean().item() == pytest.approx(scale * 3.077, rel=0.1)


class Entrance(GaitEnv):
    """Two places: an episode begins in A, whose step costs 10, and stays in B, worth 1 a step.

    In B episodes are cut by the toss of a coin; they end in B, and the next begins in A.
    """

    a, b = np.eye(4, dtype=np.float32)[:2]

    def __init__(self):
        super().__init__(TROT, flat(20.0, 20.0), 32, config=ORACLE.env, threads=1)
        self.rng = np.random.default_rng(0)
        self.in_b = np.zeros(32, dtype=bool)

    def reset(self, **_):
        self.in_b[:] = False
        return self.look(), {}

    def look(self):
        return np.where(self.in_b[:, None], self.b, self.a)

    def step(self, actions):
        reward = np.where(self.in_b, 1.0, -10.0)
        cut = self.in_b & (self.rng.random(32) < 0.3)
        self.in_b = np.ones(32, dtype=bool)
        final = self.look()
        self.in_b = ~cut
        none = np.zeros(32, dtype=bool)
        info = {"reward_terms": {}, "bonus": none, "changed": none, "shows_stance": none}
        info |= {
            "forward_speed": np.zeros(32),
            "diverged": none,
            "final_obs": final,
            "_final_obs": cut,
        }
        return self.look(), reward, none, cut, info


def test_a_cut_episode_is_worth_what_its_true_last_observation_is_worth():
    # V(B) = 1 / (1 - γ) = 10 and V(A) = -10 + γ V(B) = -1, as if nothing were cut. Valued by the
    # first observation of the next episode, B would lose: V(B) = 1 + γ (0.7 V(B) + 0.3 V(A)).
    recipe = replace(ORACLE, ppo=replace(ORACLE.ppo, normalize_observations=False))
    a, b = learned_values(Entrance(), recipe, [Entrance.a, Entrance.b], iterations=100)
    assert b.item() == pytest.approx(10.0, rel=0.1)
    assert a.item() == pytest.approx(-1.0, abs=1.0)


class Hidden(GaitEnv):
    """All robots look alike; a reward of 1 or of 0 for ever, and only the critic may know which."""

    worth = np.repeat([0.0, 1.0], 16)

    def __init__(self):
        super().__init__(TROT, flat(20.0, 20.0), 32, config=ORACLE.env, threads=1)

    def reset(self, **_):
        return np.zeros((32, 4), dtype=np.float32), {}

    def privileged(self):
        return np.repeat(self.worth[:, None], PRIVILEGED_SIZE, axis=1).astype(np.float32)

    def step(self, actions):
        none = np.zeros(32, dtype=bool)
        info = {"reward_terms": {}, "bonus": none, "changed": none, "shows_stance": none}
        info |= {"forward_speed": np.zeros(32), "diverged": none}
        return self.reset()[0], self.worth, none, none, info


@pytest.mark.parametrize("adapts", ["update", "mini_batch"])
def test_a_critic_tells_apart_what_only_it_can_see(adapts):
    # A reward of 1 for ever is worth 1 / (1 - γ) = 10; a critic that could not tell would say 5.
    env, ppo = replace(ORACLE.env, privileged=True), replace(ORACLE.ppo, adapts=adapts)
    recipe = replace(ORACLE, env=env, ppo=ppo)
    torch.set_num_threads(1)
    torch.manual_seed(0)
    learner = Learner(env := Hidden(), recipe)
    learner.ppo.actor.requires_grad_(False)
    for _ in range(60):
        learner.iterate()
    seen = as_tensors(env.reset()[0], env.privileged())
    with torch.no_grad():
        values = learner.ppo.critic(seen).squeeze(1).numpy()
    np.testing.assert_allclose(values, 10.0 * Hidden.worth, atol=0.5)


SEEN = ("machine_state", "contact", "base_linear_velocity_b", "yaw_rate_command", "joint_position")


def learner_of(machine, **ppo):
    config = EnvConfig(observed=SEEN)
    env = GaitEnv(machine, flat(20.0, 20.0), 2, config=config, threads=1)
    torch.manual_seed(0)
    recipe = replace(TINY, env=config, ppo=PpoConfig(hidden=(8,), **ppo), robots=2, steps=4)
    learner = Learner(env, recipe)
    learner.start_episodes(0)
    return learner


@pytest.mark.parametrize(("gait", "states"), [("trot", [0.0, 1.0]), ("bound", [1.0, 0.0])])
def test_a_mirror_image_is_what_would_be_seen_and_done_on_the_other_side(gait, states):
    mirror = learner_of(gaits.load(gait)).ppo.mirror
    # In the first state, on FL and BL, drifting left and turning right, joints 1 … 12 tenths.
    joints = [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2]
    mirrored_joints = [-0.4, 0.5, 0.6, -0.1, 0.2, 0.3, -1.0, 1.1, 1.2, -0.7, 0.8, 0.9]
    seen = torch.tensor([[1.0, 0, 1, 0, 1, 0, 1.2, 0.3, -0.1, -0.4, *joints], [0.0] * 22])
    image = torch.tensor([*states, 0, 1, 0, 1, 1.2, -0.3, -0.1, 0.4, *mirrored_joints])
    torch.testing.assert_close(mirror.observation(seen)[0], image)
    assert not mirror.observation(seen)[1].any()
    torch.testing.assert_close(mirror.action(torch.tensor(joints)), torch.tensor(mirrored_joints))


def weights_after(learner, *, critic=True):
    """Weights of both networks, or of the actor alone, after one iteration."""
    learner.iterate()
    models = (learner.ppo.actor, learner.ppo.critic) if critic else (learner.ppo.actor,)
    return torch.cat([one.detach().flatten() for model in models for one in model.parameters()])


@pytest.mark.parametrize("mirror", [True, False])
def test_with_a_fixed_rate_an_update_is_that_of_rsl_rl(mirror):
    """One mini-batch a pass leaves nothing to the order in which samples are drawn.

    With a mirror the critic learns from samples and images in turn, and only actors are alike.
    """
    settings = {"mini_batches": 1, "epochs": 3, "desired_kl": 0.0, "mirror": mirror}
    ours, theirs, faster = (
        weights_after(learner_of(TROT, **settings, **other), critic=not mirror)
        for other in ({}, {"adapts": "mini_batch"}, {"learning_rate": 1.1e-3})
    )
    torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-6)
    assert (ours - faster).abs().max() > 1e-4, "a tenth of the rate is noticed"


def test_a_mirror_changes_what_is_learned():
    settings = {"mini_batches": 1, "epochs": 3, "desired_kl": 0.0}
    with_, without = (weights_after(learner_of(TROT, mirror=m, **settings)) for m in (True, False))
    assert (with_ - without).abs().max() > 1e-4


def steps_taken(learner):
    """Steps of the optimiser in an iteration."""
    taken = []
    step = learner.ppo.optimizer.step
    learner.ppo.optimizer.step = lambda: (taken.append(1), step())
    learner.iterate()
    return len(taken)


def test_an_update_that_goes_too_far_ends_and_the_next_one_is_slower():
    settings = {"epochs": 10, "mini_batches": 2, "learning_rate": 1e-2}
    bold = learner_of(TROT, desired_kl=1e-4, **settings)
    assert steps_taken(bold) < 20
    assert bold.ppo.learning_rate == pytest.approx(1e-2 / 1.5)
    patient = learner_of(TROT, desired_kl=10.0, **{**settings, "learning_rate": 1e-4})
    assert steps_taken(patient) == 20
    assert patient.ppo.learning_rate == pytest.approx(1.5e-4)


@pytest.mark.parametrize(
    ("rate", "excess", "expected"),
    [
        (1e-3, 1.0, 1e-3),
        (1e-3, 1.4, 1e-3),
        (1e-3, 1.6, 1e-3 / 1.5),
        (1e-3, 0.7, 1e-3),
        (1e-3, 0.6, 1.5e-3),
        (1.2e-5, 9.0, 1e-5),
        (9e-3, 0.1, 1e-2),
    ],
)
def test_the_rate_follows_the_divergence_within_bounds(rate, excess, expected):
    assert adapted(rate, excess) == pytest.approx(expected)


def test_a_checkpoint_keeps_the_rate():
    one, other = (learner_of(TROT, learning_rate=1e-4) for _ in range(2))
    one.iterate()
    assert one.ppo.learning_rate != other.ppo.learning_rate
    other.ppo.load(one.ppo.save(), None, True)
    assert other.ppo.learning_rate == one.ppo.learning_rate


def test_a_gait_with_a_leading_side_and_a_recipe_without_mirror_learn_from_what_was_seen_alone():
    assert learner_of(TROT, mirror=False).ppo.mirror is None
    leading = {
        "name": "three-beat",
        "title": "Three beats",
        "description": "Always the left front foot first.",
        "dwell": 5,
        "ideal_phase": {"FL": 0.0, "FR": 0.3, "BL": 0.6, "BR": 0.6},
        "state": [
            {"name": "FL", "stance": ["FL"]},
            {"name": "FR", "stance": ["FR"]},
            {"name": "hind", "stance": ["BL", "BR"]},
        ],
        "transition": [
            {"from": "FL", "to": "FR", "down": ["FR"], "up": ["FL"]},
            {"from": "FR", "to": "hind", "down": ["BL", "BR"], "up": ["FR"]},
            {"from": "hind", "to": "FL", "down": ["FL"], "up": ["BL", "BR"]},
        ],
    }
    machine = RewardMachine.from_dict(leading)
    assert machine.mirrored_states() is None
    assert learner_of(machine, mirror=True).ppo.mirror is None
