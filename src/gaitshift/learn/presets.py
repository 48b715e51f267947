"""Recipes by name: the default, earlier ones, one for a robot that exists, and the paper's."""

from dataclasses import replace

from gaitshift.control.observation import FULL_SLICES
from gaitshift.learn.recipe import POLISH, ROUGH, PpoConfig, Recipe, Stage, shared_out
from gaitshift.sim.env import EnvConfig
from gaitshift.sim.reward import RewardConfig
from gaitshift.sim.sensor_config import ANYMAL
from gaitshift.sim.world import Randomisation

_EACH_MINI_BATCH = PpoConfig(adapts="mini_batch", epochs=5, desired_kl=0.01)
"""PPO as in rsl_rl."""


def three_stage() -> Recipe:
    """The recipe by which the shipped trot and bound are trained."""
    stages = (
        Stage(name="flat", iterations=450),
        *(replace(s, kl_factor=2.0) for s in (ROUGH, POLISH)),
    )
    return Recipe(ppo=_EACH_MINI_BATCH, stages=stages)


def two_stage() -> Recipe:
    """`three_stage` without the last stage, by which the other shipped policies are trained.

    The last 35 % of all iterations settle, and actors are averaged over the last 24 %.
    """
    rough, total = replace(ROUGH, kl_factor=2.0, trace_factor=1.0), 350 + ROUGH.iterations
    settle, averaged = (share * total / ROUGH.iterations for share in (0.35, 0.24))
    last = replace(rough, settle=settle, averaged=averaged)
    return Recipe(ppo=_EACH_MINI_BATCH, stages=(Stage(name="flat", iterations=350), last))


def deployable() -> Recipe:
    """For a robot that exists: sensors like ANYmal's with delay, estimated velocity, many bodies.

    Ranges are those in which the shipped policies shall walk, and somewhat more of friction. The
    rough ground is mild and has no edges: on rougher ground robots that differ hurry where they are
    asked to walk slowly (docs/results/training-recipe.md).
    """
    bodies = Randomisation(
        friction=(0.25, 1.25),
        payload=(-5.0, 5.0),
        payload_x=(-0.1, 0.1),
        payload_y=(-0.05, 0.05),
        strength=(0.8, 1.2),
        kp=(0.75, 1.25),
        kd=(0.5, 1.5),
        softness=(1.0, 3.0),
    )
    env = EnvConfig(
        reward=RewardConfig(stance_pattern=17.0, stance_punctuality=1.0, chatter=-160.0),
        observed=FULL_SLICES,
        sensors=replace(ANYMAL, name="deployable", delay=(0.0, 0.03)),
        randomisation=bodies,
        privileged=True,
        height_span=0.03,
        turn_share=0.2,
        speed_margin=0.15,
        stall=2.0,
    )
    rough = Stage(
        name="rough",
        iterations=350,
        amplitude=0.13,
        slope=12.0,
        push=130.0,
        swing_factor=1.1,
        fields=shared_out(flat=6, perlin=4, slope=2),
        settle=0.9,
        averaged=0.4,
    )
    return Recipe(
        env=env,
        ppo=replace(_EACH_MINI_BATCH, normalize_commands="range"),
        stages=(Stage(name="flat", iterations=700), rough),
    )


def deployable_gradual() -> Recipe:
    """`deployable` with a smaller weight of the stance on flat ground, 12 in place of 17.

    A pace learns slow speeds and a gallop learns to leap by it; a walk does not become clean.
    """
    recipe = deployable()
    flat, rough = recipe.stages
    return replace(recipe, stages=(replace(flat, stance_factor=0.7), rough))


def paper() -> Recipe:
    """The paper's: 30 robots × 100 steps × 500 iterations, Table I and b, flat ground.

    PPO has these defaults of stable-baselines3, the library that the paper names: 10 epochs,
    mini-batches of 64 (63 here, as 47 parts of 3000), learning rate 3e-4 without adaptation,
    γ, λ, clipping, no entropy bonus, no normalisation of observations. Four settings stay those
    of rsl_rl: the weight of the value loss (1; stable-baselines3: 0.5), the largest norm of
    gradients (1 for each network; 0.5 for both), the normalisation of advantages (over the
    batch; over each mini-batch) and Adam's ε (1e-8; 1e-5).
    """
    return Recipe(
        env=EnvConfig.paper(),
        ppo=PpoConfig(
            epochs=10,
            mini_batches=47,
            learning_rate=3e-4,
            adapts="mini_batch",
            desired_kl=0.0,
            entropy=0.0,
            initial_std=1.0,
            reward_scale=1.0,
            normalize_observations=False,
            mirror=False,
            fused_adam=True,
        ),
        stages=(Stage(name="flat", iterations=500, settle=0.0, averaged=0.0),),
        robots=30,
        steps=100,
        strict_share=0.0,
    )


PRESETS = {
    "default": Recipe,
    "three-stage": three_stage,
    "two-stage": two_stage,
    "deployable": deployable,
    "deployable-gradual": deployable_gradual,
    "paper": paper,
}
"""Recipes by the name that `gaitshift train --preset` takes."""
