"""Pushes: forces on the base origin along x, y and z, for a short while, at random times."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from gaitshift.errors import GaitshiftError


@dataclass(frozen=True, kw_only=True)
class PushConfig:
    """When and how hard robots are pushed (paper III-D: forces at the origin of the base frame)."""

    force: float = 0.0
    """Largest size of a push [N]; 0 means none. The paper gives no figure."""
    duration: int = 20
    """Control steps a push lasts (0.2 s); ours."""
    interval: int = 200
    """Control steps from one push to the next (2 s); ours."""
    vertical: float = 0.3
    """Vertical part of a push as a fraction of its size; ours."""

    def __post_init__(self) -> None:
        if not 0 <= self.force <= 1000:
            raise GaitshiftError(f"push must be 0 to 1000 N, got {self.force}")
        if not 0 < self.duration < self.interval:
            raise GaitshiftError(
                f"duration of a push must be 1 step or more and below the interval, "
                f"{self.interval} steps, got {self.duration}"
            )


class Pusher:
    """Draws the present force on each of N robots, step after step.

    Every robot has its own clock: pushes begin `interval` steps apart. The first push begins in a
    step drawn from the first `interval - duration` steps, the very first included.
    """

    def __init__(self, config: PushConfig, n: int, rng: np.random.Generator) -> None:
        self.config = config
        self._rng = rng
        # Every robot starts somewhere in its pause: one in 180 at its end, pushed in step 0.
        self._clock: Int[np.ndarray, " N"] = rng.integers(config.duration, config.interval, size=n)
        self._force_w: Float[np.ndarray, "N 3"] = np.zeros((n, 3))

    def step(self) -> Float[np.ndarray, "N 3"]:
        """Force on each base origin during the next control step, world frame [N]."""
        if self.config.force == 0:
            return self._force_w
        self._clock += 1
        self._force_w[self._clock == self.config.duration] = 0.0
        due = np.flatnonzero(self._clock >= self.config.interval)
        if due.size:
            self._clock[due] = 0
            self._force_w[due] = self._draw(due.size)
        return self._force_w

    def clear(self, ids: Int[np.ndarray, " K"]) -> None:
        """Ends the pushes of robots that restart, and draws a new time to their next push."""
        self._force_w[ids] = 0.0
        self._clock[ids] = self._rng.integers(
            self.config.duration, self.config.interval, size=len(ids)
        )

    def _draw(self, count: int) -> Float[np.ndarray, "K 3"]:
        angle = self._rng.uniform(-np.pi, np.pi, count)
        size = self._rng.uniform(0.0, self.config.force, count)
        up = self.config.vertical * self._rng.uniform(-1.0, 1.0, count)
        return size[:, None] * np.stack([np.cos(angle), np.sin(angle), up], axis=1)
