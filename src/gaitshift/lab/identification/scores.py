"""What the firings of a grid are worth: detections with their delays, and false shifts."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from gaitshift.lab.identification.grid import steps_alive
from gaitshift.lab.identification.labelled_run import LabelledRun


@dataclass(frozen=True, kw_only=True, eq=False)
class Detections:
    """Of the robots that came to rough ground without having fired, at each α and β."""

    came: Int[np.ndarray, "A B"]
    """Robots."""
    detected: Int[np.ndarray, "A B"]
    """Those of them that fired before the rough ground, or their run, ended."""
    delay_s: Float[np.ndarray, "N A B"]
    """From coming to it until firing [s]; NaN where not detected."""
    delay_m: Float[np.ndarray, "N A B"]
    """The same as a way [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class FalseShifts:
    """Of robots on smooth ground, until they come to rough ground, at each α and β."""

    fired: Int[np.ndarray, "A B"]
    """Robots that fired."""
    robots: int
    """Robots."""
    km: Float[np.ndarray, "A B"]
    """Way that was walked until firing or to the end [km]."""


def detections(recording: LabelledRun, first: Int[np.ndarray, "N A B"]) -> Detections:
    """How the firings `first` of one recording met its first stretch of rough ground."""
    entry, end = _stretch(recording)
    came = (entry[:, None, None] < end[:, None, None]) & (first >= entry[:, None, None])
    detected = came & (first < end[:, None, None])
    last = len(recording.time) - 1
    at = np.minimum(first, last)
    robots = np.arange(recording.robots)
    start = np.minimum(entry, last)
    delay = recording.time[at] - recording.time[start][:, None, None]
    way = recording.distance[at, robots[:, None, None]]
    way = way - recording.distance[start, robots][:, None, None]
    return Detections(
        came=came.sum(axis=0),
        detected=detected.sum(axis=0),
        delay_s=np.where(detected, delay, np.nan),
        delay_m=np.where(detected, way, np.nan),
    )


def false_shifts(recording: LabelledRun, first: Int[np.ndarray, "N A B"]) -> FalseShifts:
    """The firings before any rough ground, and the way walked until then."""
    entry, _ = _stretch(recording)
    limit = np.minimum(entry, steps_alive(recording.alive))[:, None, None]
    fired = first < limit
    until = np.maximum(np.where(fired, first, limit) - 1, 0)
    way = recording.distance[until, np.arange(recording.robots)[:, None, None]]
    return FalseShifts(
        fired=fired.sum(axis=0), robots=recording.robots, km=way.sum(axis=0) / 1000.0
    )


def _stretch(recording: LabelledRun) -> tuple[Int[np.ndarray, " N"], Int[np.ndarray, " N"]]:
    """Steps at which each robot comes to its first rough ground, and leaves it; T if never."""
    steps = len(recording.time)
    rough = recording.rough & recording.alive
    some = rough.any(axis=0)
    entry = np.where(some, rough.argmax(axis=0), steps)
    after = ~rough & (np.arange(steps)[:, None] >= entry)
    end = np.where(after.any(axis=0), after.argmax(axis=0), steps)
    return entry, end
