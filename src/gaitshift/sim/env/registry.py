"""The Gymnasium ids of the gaits: `gaitshift/trot-v0` and so on."""

import gymnasium as gym

from gaitshift.gait import gaits
from gaitshift.sim.env.config import EnvConfig
from gaitshift.sim.env.gait_env import GaitEnv
from gaitshift.sim.env.single import SingleGaitEnv
from gaitshift.sim.terrain import from_spec

_FIELD = 20.0
"""Side of the ground of a registered environment [m]; ours: an episode of 10 s stays on it."""


def register_gaits() -> None:
    """Registers `gaitshift/<gait>-v0` for every shipped gait.

    `gymnasium.make` and `make_vec` take the keywords of `make_vector` below.
    """
    for name in gaits.names():
        gym.register(
            id=f"gaitshift/{name}-v0",
            entry_point="gaitshift.sim.env.registry:make_single",
            vector_entry_point="gaitshift.sim.env.registry:make_vector",
            kwargs={"gait": name},
        )


def make_vector(
    gait: str,
    num_envs: int = 1,
    *,
    terrain: str = "flat",
    terrain_seed: int = 0,
    config: EnvConfig | None = None,
) -> GaitEnv:
    """The environment of a shipped gait, or of a machine file, on a terrain given by its spec."""
    ground = from_spec(terrain, seed=terrain_seed, length=_FIELD, width=_FIELD)
    return GaitEnv(gaits.load(gait), ground, num_envs, config=config)


def make_single(
    gait: str,
    *,
    terrain: str = "flat",
    terrain_seed: int = 0,
    config: EnvConfig | None = None,
) -> SingleGaitEnv:
    """`make_vector` for one robot, as a plain `gymnasium.Env`."""
    ground = from_spec(terrain, seed=terrain_seed, length=_FIELD, width=_FIELD)
    return SingleGaitEnv(gaits.load(gait), ground, config=config)
