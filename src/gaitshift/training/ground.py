"""The ground of training: flat, then Perlin fields drawn anew every few iterations."""

import numpy as np

from gaitshift.terrain import Terrain, flat, perlin
from gaitshift.training.recipe import Recipe, Stage

FIELD = 20.0
"""Side of a training field [m]; ours: an episode of 10 s rarely leaves it."""

FIRST_SHARE = 0.3
"""Share of a stage's amplitude that its first fields reach; it grows to 1 by the middle."""


def stage_at(recipe: Recipe, iteration: int) -> tuple[Stage, int]:
    """The stage of an iteration and the iteration's number within it."""
    for stage in recipe.stages:
        if iteration < stage.iterations:
            return stage, iteration
        iteration -= stage.iterations
    return recipe.stages[-1], recipe.stages[-1].iterations + iteration


def draw_ground(stage: Stage, within: int, seed: int) -> Terrain:
    """The ground of a stage at its iteration `within`; the same for the same numbers.

    Amplitudes are uniform from 0 to the largest of the moment, so that gentle ground is never
    forgotten.
    """
    if stage.amplitude == 0:
        return flat(FIELD, FIELD)
    rng = np.random.default_rng((seed, within))
    grown = min(1.0, FIRST_SHARE + (1 - FIRST_SHARE) * within / max(1, stage.iterations / 2))
    amplitude = stage.amplitude * grown * rng.uniform(0.0, 1.0) ** 0.5
    return perlin(amplitude, seed=rng, length=FIELD, width=FIELD)
