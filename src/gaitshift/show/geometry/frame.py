"""One frame of N robots: a step of a log, and the last touch of each foot."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Float

from gaitshift.lab.log import Log

_PLANE = 0.55, 0.4
"""Half of the length and width of the plane through the touches [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Frame:
    """N robots at one instant."""

    step: Log
    """The step of the log."""
    touch_w: Float[np.ndarray, "N 4 3"]
    """Position of the last touch of each foot, world frame [m]; NaN before the first."""
    touch_height: Float[np.ndarray, "N 4"]
    """Its height above the base at that time, along the vertical [m]; NaN before the first."""

    @classmethod
    def after(cls, before: "Frame | None", step: Log) -> "Frame":
        """The frame of a step; `before` is the frame before it."""
        contact, feet, height = (
            step.sensed.contact,
            step.truth.foot_position_w,
            step.sensed.foot_height,
        )
        if before is None:
            unknown = np.full(contact.shape, np.nan)
            before_w, before_height = np.full(feet.shape, np.nan), unknown
        else:
            before_w, before_height = before.touch_w, before.touch_height
        return cls(
            step=step,
            touch_w=np.where(contact[..., None], feet, before_w),
            touch_height=np.where(contact, height, before_height),
        )

    @property
    def time(self) -> float:
        """Since the start [s]."""
        return float(self.step.sensed.time)


def frames_of(log: Log, every: int) -> list[Frame]:
    """Every `every`-th entry of a log, in double precision."""
    frames, frame = list[Frame](), None
    for t in range(len(log.time)):
        frame = Frame.after(frame, log[t].as_type(np.float64))
        if t % every == 0:
            frames.append(frame)
    return frames


def plane_corners(points: Float[np.ndarray, "4 3"]) -> Float[np.ndarray, "4 3"]:
    """Corners of a piece of the plane of least squares through points, about their middle [m]."""
    middle = points.mean(axis=0)
    offset = points - middle
    slope = cast(Any, np.linalg).lstsq(offset[:, :2], offset[:, 2], rcond=1e-3)[0]
    length, width = _PLANE
    corners = np.array([[-length, -width], [length, -width], [length, width], [-length, width]])
    return np.column_stack([corners, corners @ slope]) + middle
