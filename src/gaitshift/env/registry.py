"""The ids by which Gymnasium knows the gaits: `gaitshift/trot-v0` and so on."""

import gymnasium as gym

from gaitshift import gaits


def register_gaits() -> None:
    """Registers `gaitshift/<gait>-v0` for every shipped gait, on flat ground unless told otherwise."""
    for name in gaits.names():
        gym.register(
            id=f"gaitshift/{name}-v0",
            entry_point="gaitshift.env.registry:make_single",
            vector_entry_point="gaitshift.env.registry:make_vector",
            kwargs={"gait": name},
        )


def make_vector(gait: str, num_envs: int = 1, **options: object):  # noqa: ANN201
    return None
