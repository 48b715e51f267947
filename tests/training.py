"""Tiny trainings, broken off where a test wants it, and what they leave behind."""

import csv
from dataclasses import replace

import torch

from gaitshift.gait import gaits
from gaitshift.learn.recipe import PpoConfig, Recipe, Stage
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig
from gaitshift.sim.env import EnvConfig

TROT = gaits.load("trot")
TINY = Recipe(
    env=EnvConfig(episode_steps=30, command_interval=11),
    ppo=PpoConfig(hidden=(16, 8), epochs=2, mini_batches=2),
    stages=(
        Stage(name="flat", iterations=3, push=50.0),
        Stage(
            name="rough",
            iterations=3,
            amplitude=0.1,
            slope=8.0,
            stair=0.04,
            step=0.06,
            redraw_every=2,
            push=100.0,
            swing_factor=1.5,
            kl_factor=3.0,
            horizon_factor=2.0,
            trace_factor=2.5,
            mixed_starts=0.5,
            settle=1.0,
            averaged=0.8,  # iterations 3.6 to 6: two checkpoints
        ),
    ),
    robots=4,
    steps=8,
    strict_from=1,
    strict_until=4,
    command_from=0,
    command_until=5,
    checkpoint_every=2,
    threads=1,
)
ABC = replace(
    TINY,
    stages=(
        Stage(name="a", iterations=3),
        Stage(name="b", iterations=4, amplitude=0.1),
        Stage(name="c", iterations=5, amplitude=0.2),
    ),
)


class KilledError(Exception):
    """Stands for whatever ends a process."""


def kill_at(iteration, error=KilledError):
    """A report that breaks the run off after this iteration, before its checkpoint."""

    def report(row):
        if row["iteration"] == iteration:
            raise error

    return report


def create(folder, *, seed=7, recipe=TINY, **options):
    config = RunConfig(machine=TROT, recipe=recipe, seed=seed, command="gaitshift train trot")
    return Run.create(folder, config, **options)


def rows(folder):
    """progress.csv without the one column that depends on the clock."""
    with (folder / "progress.csv").open(newline="") as file:
        return [
            {name: value for name, value in row.items() if name != "wall_s"}
            for row in csv.DictReader(file)
        ]


def weights(run):
    """Every number of networks, statistics and optimiser, by name."""
    flat_state = {}

    def collect(name, value):
        if isinstance(value, dict):
            for key, part in value.items():
                collect(f"{name}/{key}", part)
        elif isinstance(value, list | tuple):
            for key, part in enumerate(value):
                collect(f"{name}/{key}", part)
        else:
            flat_state[name] = value.clone() if isinstance(value, torch.Tensor) else value

    collect("", run.learner.ppo.save())
    return flat_state


def same_bits(one, other):
    return one.keys() == other.keys() and all(
        torch.equal(value, other[name]) if isinstance(value, torch.Tensor) else value == other[name]
        for name, value in one.items()
    )
