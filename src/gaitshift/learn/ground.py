"""The ground of training: flat, then noise, slopes and stairs drawn anew every few iterations."""

from dataclasses import replace

import numpy as np

from gaitshift.learn.recipe import Stage
from gaitshift.sim.terrain import Terrain, flat, perlin, slope, stairs

FIELD = 20.0
"""Side of a training field [m]; ours: an episode of 10 s rarely leaves it."""

FIRST_SHARE = 0.3
"""Share of a stage's largest heights and slopes at its start; it grows to 1 by the middle."""

RUNS = {"stair": (0.30, 0.50), "step": (1.0, 2.5)}
"""Shortest and longest tread [m]; ours: those of staircases, and room for strides in between."""


def draw_grounds(stage: Stage, within: int, seed: int) -> tuple[Terrain, ...]:
    """The fields of a stage at its iteration `within`; the same for the same arguments.

    Amplitudes and angles are drawn between 0 and the present maximum, so that the policy does not
    forget gentle ground.
    """
    if not stage.is_rough:
        return (flat(FIELD, FIELD),)
    rng = np.random.default_rng((seed, within))
    grown = min(1.0, FIRST_SHARE + (1 - FIRST_SHARE) * within / max(1, stage.iterations / 2))
    return tuple(_draw(kind, stage, grown, rng) for kind in stage.fields)


def _draw(kind: str, stage: Stage, grown: float, rng: np.random.Generator) -> Terrain:
    if kind == "flat":
        return flat(FIELD, FIELD)
    share = grown * rng.uniform(0.0, 1.0) ** 0.5
    if kind == "slope":
        towards = rng.uniform(0.0, 360.0)
        return slope(share * stage.slope, towards=towards, length=FIELD, width=FIELD)
    if kind in RUNS:
        return _stairs(share * getattr(stage, kind), rng.uniform(*RUNS[kind]))
    return perlin(share * stage.amplitude, seed=rng, length=FIELD, width=FIELD)


def _stairs(rise: float, run: float) -> Terrain:
    """Stairs with faces as steep as in the trials; across them one sample per 10 cm is enough."""
    strip = stairs(rise, run=run, flight=1000, length=FIELD, width=FIELD / 4)
    return replace(strip, size=(FIELD, FIELD), origin=(0.0, -FIELD / 2))
