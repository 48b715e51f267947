"""The checkpoints of a run: files from which it goes on, one for each of some iterations."""

from collections.abc import Iterable
from copy import deepcopy
from pathlib import Path
from typing import Any

import torch

from gaitshift.errors import GaitshiftError
from gaitshift.learn.run_folder import CHECKPOINTS
from gaitshift.whole_file import replacing

_PARTS = {"iteration": int, "wall_s": float, "torch_rng": torch.Tensor, "ppo": dict}
"""What a checkpoint holds."""


def file_of(folder: Path, iteration: int) -> Path:
    """The file of an iteration in the folder of a run."""
    return folder / CHECKPOINTS / f"{iteration:06d}.pt"


def files(folder: Path) -> list[Path]:
    """The files of a run's checkpoints, in their order."""
    found = (folder / CHECKPOINTS).glob("*.pt")
    return sorted(path for path in found if path.stem.isdecimal())


def write(folder: Path, state: dict[str, Any]) -> None:
    """Writes the checkpoint of the iteration that it names."""
    path = file_of(folder, state["iteration"])
    path.parent.mkdir(exist_ok=True)
    with replacing(path) as part:
        torch.save(state, part)


def read(path: Path) -> dict[str, Any]:
    """A checkpoint.

    Raises:
        GaitshiftError: it is missing or damaged.
    """
    try:
        state = torch.load(path, weights_only=True)
        for name, kind in _PARTS.items():
            if not isinstance(state[name], kind):
                raise TypeError(f"'{name}' is a {type(state[name]).__name__}")
        return state
    except Exception as error:  # torch has no common class for a damaged file
        raise GaitshiftError(
            f"{path} is damaged; remove it to resume from the checkpoint before it"
        ) from error


def averaged(layers: torch.nn.Sequential, paths: Iterable[Path]) -> torch.nn.Sequential:
    """A copy of an actor's layers, their weights averaged with those of these checkpoints."""
    mean = deepcopy(layers)
    total = {name: weights.clone() for name, weights in mean.state_dict().items()}
    count = 1
    for path in paths:
        state = read(path)["ppo"]["actor_state_dict"]
        for name, weights in total.items():
            weights += state[f"mlp.{name}"]
        count += 1
    mean.load_state_dict({name: weights / count for name, weights in total.items()})
    return mean
