"""How fast a training's policies walk for each commanded speed, checkpoint by checkpoint.

    python tools/speed_answers.py RUN [--offsets 0 -0.15] [--rough]

The robots are those of the training, with its noise of the actions, on level ground or (`--rough`)
on the ground of the run's last iteration. With an offset, policies are given so much less or more
[m/s] than they are rewarded for: where the reward then grows, a policy does not walk as it should.
Prints a table, a row for each checkpoint, offset and range of commands.
"""

import argparse
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float

from gaitshift import table
from gaitshift.learn import checkpoint
from gaitshift.learn.ground import FIELD, draw_grounds
from gaitshift.learn.learner import as_tensors
from gaitshift.learn.run import Run
from gaitshift.sim.terrain import flat

SEED, STEPS, START = 5, 700, 100
"""Seed of bodies, commands and starts; control steps, and those at the start that do not count."""
BINS = (0.0, 0.3, 0.6, 0.9, 1.2, 1.5, 3.0)
"""Ends of the ranges of commanded speeds [m/s]."""
HEAD = ("iteration", "offset [m/s]", "commanded [m/s]", "speed [m/s]", "reward a step", "falls")


def walked(run: Run, offset: float) -> tuple[Float[np.ndarray, "3 M"], int]:
    """Commanded speeds, speeds and rewards of all robots and steps, and the number of falls."""
    env, actor = run.learner.env, run.learner.ppo.actor
    place = env.walker.observation.slices["forward_speed_command"]
    observation, _ = env.reset(seed=SEED)
    seen: list[tuple[np.ndarray, ...]] = []
    falls = 0
    for step in range(STEPS):
        commanded = observation[:, place][:, 0].copy()
        observation[:, place] += offset
        with torch.inference_mode():
            action = actor(as_tensors(observation), stochastic_output=True).numpy()
        observation, reward, terminated, _, info = env.step(action)
        falls += int(terminated.sum())
        if step >= START:
            seen.append((commanded, info["forward_speed"], reward))
    return np.concatenate(seen, axis=1), falls


def rows(run: Run, offsets: list[float], *, rough: bool) -> Iterator[tuple[str, ...]]:
    """The table's rows."""
    stage = run.recipe.stages[-1]
    ground = draw_grounds(stage, stage.iterations, run.config.seed) if rough else flat(FIELD, FIELD)
    iterations = [int(path.stem) for path in checkpoint.files(run.folder)]
    for iteration in filter(None, iterations):  # before the first one nothing walks
        run.go_to(iteration)
        run.learner.ppo.actor.eval()
        env = run.learner.env
        env.set_terrain(ground, stage.fidelity)
        env.push_at_most(stage.push if rough else 0.0)
        env.curriculum = run.recipe.curriculum(run.iteration)
        for offset in offsets:
            torch.manual_seed(SEED)
            (commanded, speed, reward), falls = walked(run, offset)
            for low, high in pairwise(BINS):
                here = (commanded >= low) & (commanded < high)
                if here.any():
                    means = (f"{part[here].mean():.2f}" for part in (commanded, speed, reward))
                    yield (str(run.iteration), f"{offset:g}", *means, str(falls))


def main() -> None:
    """Prints the table of a run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("--offsets", type=float, nargs="+", default=[0.0])
    parser.add_argument("--rough", action="store_true")
    options = parser.parse_args()
    run = Run.resume(options.run)
    print(table.markdown(HEAD, list(rows(run, options.offsets, rough=options.rough))))


if __name__ == "__main__":
    main()
