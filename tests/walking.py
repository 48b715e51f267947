"""Robots that walk now, by shipped policies."""

from functools import cache

from gaitshift.control import policy
from gaitshift.show.viewer.live import LiveConfig, LiveRun


@cache
def _policies():
    return {name: policy.load(name) for name in ("trot", "bound", "pace")}


def live_run(**config):
    """Robots of this `LiveConfig` that trot, bound or pace."""
    return LiveRun(LiveConfig(**config), _policies())


def walk(run, seconds):
    """Frames until so many seconds after the start, or until the run is over."""
    frames = [run.step()]
    while frames[-1].time < seconds - 1e-9 and not run.is_over:
        frames.append(run.step())
    return frames
