"""A channel for datagrams that delays, disorders and loses them, drawn from a seed."""

import heapq
from dataclasses import dataclass

import numpy as np

from gaitshift.data import check_ranges


@dataclass(frozen=True, kw_only=True)
class ChannelConfig:
    """How datagrams travel, one way."""

    delay: float = 0.0
    """Least time from sending to arrival [s], 0 to 0.1."""
    jitter: float = 0.0
    """Each datagram takes up to so much longer, evenly distributed [s], 0 to 0.1; above 0.01 s
    datagrams overtake each other."""
    loss: float = 0.0
    """Share of datagrams that never arrive, 0 to 0.9."""

    def __post_init__(self) -> None:
        check_ranges(self, delay=(0.0, 0.1), jitter=(0.0, 0.1), loss=(0.0, 0.9))


class Channel:
    """Datagrams on their way; the same seed loses and delays the same ones."""

    def __init__(self, config: ChannelConfig, rng: np.random.Generator) -> None:
        """Draws two numbers from `rng` for each datagram."""
        self._config, self._rng = config, rng
        self._put = 0
        self._waiting = list[tuple[float, int, bytes]]()

    def put(self, data: bytes, now: float) -> None:
        """Sends a datagram at this time [s]."""
        lost, late = self._rng.random(2)
        self._put += 1
        if lost >= self._config.loss:
            due = now + self._config.delay + self._config.jitter * float(late)
            heapq.heappush(self._waiting, (due, self._put, data))

    def take(self, now: float) -> list[tuple[bytes, float]]:
        """The datagrams that have arrived by this time [s], and when, in that order."""
        got = list[tuple[bytes, float]]()
        while self._waiting and self._waiting[0][0] <= now:
            due, _, data = heapq.heappop(self._waiting)
            got.append((data, due))
        return got

    @property
    def next_due(self) -> float:
        """When the next datagram arrives [s]; infinite if none is on its way."""
        return self._waiting[0][0] if self._waiting else np.inf
