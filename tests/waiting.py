"""Waiting for a state: tests wait for what they assert, and never for a time."""

import time
from collections.abc import Callable

PATIENCE = 400.0
"""Longest wait [s]; ours: a busy machine is ten times slower than a quiet one, a fault lasts."""


def wait_until(true: Callable[[], bool], pause: float = 0.3) -> None:
    """Returns as soon as the state holds; looks at it again after each pause [s]."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end, f"not so after {PATIENCE:.0f} s"
        time.sleep(pause)
