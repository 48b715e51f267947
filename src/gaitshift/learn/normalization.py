"""Observations as the networks see them: with mean 0 and standard deviation 1."""

from collections.abc import Mapping

import torch
from rsl_rl.modules import EmpiricalNormalization


class RangeNormalization(EmpiricalNormalization):
    """Running moments, and those of a uniform draw for entries whose range is known.

    Ours: a curriculum widens the ranges of the commands, so their running deviation grows for as
    long as a training goes on. The policy's answer to a command is divided by it, and shrinks
    faster than PPO can restore it.
    """

    def __init__(self, size: int, ranges: Mapping[int, tuple[float, float]]) -> None:
        """For observations of `size` entries; `ranges` holds lowest and highest value by place."""
        super().__init__(size)
        self._places = list(ranges)
        low, high = torch.tensor(list(ranges.values()), dtype=torch.float32).reshape(-1, 2).T
        self._middle, width = 0.5 * (low + high), (high - low).abs()
        # An entry that never differs is 0 behind the normalisation, whatever its deviation.
        self._deviation = torch.where(width > 0, width / 12**0.5, 1.0)
        self._set_ranges()

    def update(self, x: torch.Tensor) -> None:
        """Learns from a batch of observations, (N, size)."""
        super().update(x)
        self._set_ranges()

    def _set_ranges(self) -> None:
        self._mean[0, self._places] = self._middle
        self._std[0, self._places] = self._deviation
        self._var[0, self._places] = self._deviation.square()
