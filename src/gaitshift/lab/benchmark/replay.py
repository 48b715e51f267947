"""How long it takes to replay a rule over recordings, for every α and β of a grid."""

import time

import numpy as np

from gaitshift.lab.identification import first_firings
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.shift import Rule

EPISODES, SECONDS = 1000, 20.0
ALPHAS, BETAS = np.linspace(0.002, 0.2, 100), np.arange(1000.0)


def replay_speed(seed: int) -> dict[str, float]:
    """Time [s] to find the first firings of six pairs of feet over the whole grid.

    Heights change at random times, as touches do; with a leak the counter must be run through step
    by step.
    """
    rng, steps = np.random.default_rng(seed), round(SECONDS / CONTROL_PERIOD)
    touched = rng.random((steps, EPISODES, 1)) < 0.1
    touched[0] = True
    which = np.maximum.accumulate(np.where(touched[..., 0], np.arange(steps)[:, None], 0), axis=0)
    drawn = np.abs(rng.normal(scale=0.05, size=(steps, EPISODES, 6)))
    values = np.take_along_axis(drawn, which[..., None], axis=0)
    alive = np.ones((steps, EPISODES), dtype=bool)
    seconds: dict[str, float] = {}
    for name, leak in (("no_leak", 0.0), ("leak", 0.5)):
        rule = Rule(alpha=0.1, beta=100.0, leak=leak)
        start = time.perf_counter()
        first_firings(values, alive, rule, ALPHAS, BETAS)
        seconds[f"{name}_s"] = time.perf_counter() - start
    return seconds
