"""What a training run was given: its config file."""

import json
import platform
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cattrs

from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.learn.recipe import Recipe
from gaitshift.learn.run_folder import CONFIG, read_config
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.robot_file import from_dict, to_dict
from gaitshift.whole_file import write_text

_STRICT = cattrs.Converter(forbid_extra_keys=True)


@dataclass(frozen=True, kw_only=True)
class RunConfig:
    """Everything that decides what a run does."""

    machine: RewardMachine
    """The gait."""
    recipe: Recipe
    """How it is trained."""
    seed: int
    """Of networks, exploration, terrains and pushes."""
    command: str
    """The command that began the run."""
    robot: Robot = ANYMAL_B
    """Which robot learns."""

    def __post_init__(self) -> None:
        samples = self.recipe.robots * self.recipe.steps
        if self.recipe.ppo.mini_batches > samples:
            raise GaitshiftError(
                f"mini_batches must be 1 to robots × steps, {samples}, got "
                f"{self.recipe.ppo.mini_batches}"
            )

    def write(self, folder: Path) -> None:
        """Writes the config file of a run in this folder."""
        config: dict[str, Any] = {
            "command": self.command,
            "seed": self.seed,
            "machine": self.machine.to_dict(),
            "recipe": asdict(self.recipe),
            "versions": versions(),
        }
        if self.robot != ANYMAL_B:
            config["robot"] = to_dict(self.robot)
        write_text(folder / CONFIG, json.dumps(config, indent=2) + "\n")

    @classmethod
    def read(cls, folder: Path) -> "RunConfig":
        """The inverse of `write`.

        Raises:
            GaitshiftError: the folder has no config file, or the file is damaged.
        """
        config, path = read_config(folder), folder / CONFIG
        try:
            return cls(
                machine=RewardMachine.from_dict(config["machine"]),
                recipe=_STRICT.structure(config["recipe"], Recipe),
                seed=config["seed"],
                command=config["command"],
                robot=from_dict(config["robot"]) if "robot" in config else ANYMAL_B,
            )
        except cattrs.BaseValidationError as error:
            faults = "; ".join(cattrs.transform_error(error))
            raise GaitshiftError(f"{path} is damaged: {faults}") from error
        except GaitshiftError as error:
            raise GaitshiftError(f"{path}: {error}") from error
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
            raise GaitshiftError(f"{path} is damaged: {error}") from error


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that decide what a training gives."""
    packages = ("gaitshift", "mujoco-core", "numpy", "torch", "rsl-rl-lib", "gymnasium")
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}
