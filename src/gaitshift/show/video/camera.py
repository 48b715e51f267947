"""A camera that walks along with a robot, calmly."""

import numpy as np

from gaitshift.lab.log import Log
from gaitshift.show.plots.signals import period, smoothed
from gaitshift.show.video.canvas import View

_DISTANCE = 2.25
"""[m]: the robot fills about a quarter of the picture's width."""

_AZIMUTH, _ELEVATION = 58.0, -18.0
"""Seen from its right and a little from behind, so that the ground ahead is in the picture."""

_LOWER = 0.14
"""How far below the base the middle of the picture is [m]: half-way to the feet."""

_ALONG, _UP, _TURN = 0.5, 1.0, 1.5
"""Windows that the course is smoothed in, over the ground, in height and in heading [s]: longer
than a stride, so that the camera does not bob with the body."""


def follow(log: Log, robot: int) -> list[View]:
    """The view at each entry of the log."""
    step = period(log)
    x, y, z = log.truth.base_position_w[:, robot, :3].T
    yaw = smoothed(np.unwrap(_heading(log, robot)), step, _TURN)
    course = zip(
        smoothed(x, step, _ALONG).tolist(),
        smoothed(y, step, _ALONG).tolist(),
        (smoothed(z, step, _UP) - _LOWER).tolist(),
        (_AZIMUTH + np.degrees(yaw)).tolist(),
        strict=True,
    )
    return [
        View(target=(cx, cy, cz), distance=_DISTANCE, azimuth=azimuth, elevation=_ELEVATION)
        for cx, cy, cz, azimuth in course
    ]


def _heading(log: Log, robot: int) -> np.ndarray:
    return log.sensed.yaw[:, robot]
