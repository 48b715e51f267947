"""A recipe from the `config.json` of a run."""

from typing import Any

from gaitshift.command import HeadingLoop
from gaitshift.env import EnvConfig
from gaitshift.reward import RewardConfig
from gaitshift.training.recipe import PpoConfig, Recipe, Stage
from gaitshift.world import PushConfig


def recipe_from_dict(data: dict[str, Any]) -> Recipe:
    """The recipe that `dataclasses.asdict` and JSON made `data` of."""
    env = dict(data["env"])
    env["reward"] = RewardConfig(**env["reward"])
    env["push"] = PushConfig(**env["push"])
    env["heading_loop"] = HeadingLoop(**env["heading_loop"])
    env["observed"] = tuple(env["observed"])
    ppo = {**data["ppo"], "hidden": tuple(data["ppo"]["hidden"])}
    return Recipe(
        **{
            **data,
            "env": EnvConfig(**env),
            "ppo": PpoConfig(**ppo),
            "stages": tuple(Stage(**stage) for stage in data["stages"]),
        }
    )
