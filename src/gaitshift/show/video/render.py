"""A log as an MP4 file: the robot on its ground, and the signals of the shift condition below."""

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any, cast

import imageio_ffmpeg
import mujoco
import numpy as np
from jaxtyping import UInt8
from PIL import ImageColor

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.legs import LEGS
from gaitshift.show.plots.signals import (
    check_robot,
    gait_at,
    ground_of,
    period,
    smoothed,
    walks_on_kept_ground,
    window,
)
from gaitshift.show.plots.style import gait_colours
from gaitshift.show.video.canvas import Ball, Canvas, VideoUnavailable, follow
from gaitshift.show.video.scene import Paint, build_scene
from gaitshift.show.video.strip import Reading, Strip
from gaitshift.whole_file import replacing

_QUALITY = 25
"""x264's constant rate factor."""

_RATE = 900
"""Most kilobits a second: 30 s stay below 4 MB."""


class FilmWriter:
    """Writes pictures of one size into an MP4 file, whole or not at all; a context manager."""

    def __init__(self, path: Path, width: int, height: int, fps: int) -> None:
        self._path, self._file = path, ExitStack()
        self._pictures = 0
        self._part = part = self._file.enter_context(replacing(path))
        try:
            self._frames = imageio_ffmpeg.write_frames(
                str(part),
                (width, height),
                fps=fps,
                codec="libx264",
                pix_fmt_out="yuv420p",
                macro_block_size=2,
                quality=cast(Any, None),
                output_params=[
                    *("-f", "mp4", "-movflags", "+faststart"),
                    *("-preset", "veryfast", "-crf", str(_QUALITY)),
                    *("-maxrate", f"{_RATE}k", "-bufsize", f"{2 * _RATE}k"),
                ],
            )
            self._frames.send(None)
        except RuntimeError as error:
            raise VideoUnavailable(
                f"videos need ffmpeg ({error}); install imageio[ffmpeg]"
            ) from error

    def add(self, picture: UInt8[np.ndarray, "height width 3"]) -> None:
        """Appends a picture: rows from the top, red, green, blue."""
        try:
            self._frames.send(np.ascontiguousarray(picture))
        except OSError as error:
            reason = str(error).splitlines()[0]
            raise GaitshiftError(f"{self._path} cannot be written: {reason}") from error
        self._pictures += 1

    def __enter__(self) -> "FilmWriter":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._frames.close()
        if error is not None:
            self._file.__exit__(kind, error, trace)
            return
        with self._file:
            self._check_whole()

    def _check_whole(self) -> None:
        """`GaitshiftError` where the file lacks pictures: ffmpeg's end says nothing of it."""
        try:
            pictures, _ = imageio_ffmpeg.count_frames_and_secs(str(self._part))
        except RuntimeError:
            pictures = 0
        if pictures != self._pictures:
            raise GaitshiftError(
                f"{self._path} cannot be written: ffmpeg kept {pictures} of {self._pictures} "
                "pictures; is the disk full?"
            )


_GLOW = 1.3
"""Radius of the light on a foot in contact, as a multiple of the foot's radius."""


class Playback:
    """Draws one robot of a log. A context manager: OpenGL's memory is freed at its end."""

    def __init__(self, log: Log, robot: int, description: Robot, width: int, height: int) -> None:
        self._log, self._robot = log, robot
        self._qpos = log.qpos[:, robot]
        self._radius = description.foot_radius
        self._colours = gait_colours(log.gaits)
        place = log.truth.base_position_w[:, robot, :2]
        scene = build_scene(description, ground_of(log), place, width, height)
        self._texture = scene.texture
        self._model, self._data = scene.model, mujoco.MjData(scene.model)
        self._paint = Paint(scene)
        self._cameras = follow(log, robot)
        self._printed = 0
        self._canvas = Canvas(scene.model, width, height)

    def __enter__(self) -> "Playback":
        return self

    def __exit__(self, *_: object) -> None:
        self._canvas.close()

    def picture(self, entry: int) -> UInt8[np.ndarray, "height width 3"]:
        """The robot at an entry, the prints of all touches up to it on the ground."""
        self._data.qpos[:] = self._qpos[entry]
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._print_touches(entry)
        self._paint.move_shadow(self._model, self._data)
        self._canvas.upload_texture(self._texture)
        return self._canvas.draw(self._data, self._cameras[entry], self._lights(entry))

    def _print_touches(self, entry: int) -> None:
        """Leaves the prints of the touches since the last picture."""
        contact = self._log.sensed.contact[:, self._robot]
        for now in range(self._printed, entry + 1):
            touching = contact[now] & ~contact[now - 1] if now else contact[now]
            for leg in np.flatnonzero(touching).tolist():
                xy = self._log.truth.foot_position_w[now, self._robot, leg, :2]
                self._paint.add_footprint(xy, self._colour(now))
        self._printed = entry + 1

    def _lights(self, entry: int) -> list[Ball]:
        """A light on each foot in contact, in the gait's colour."""
        feet = self._log.truth.foot_position_w[entry, self._robot] + [0.0, 0.0, self._radius]
        red, green, blue = (v / 255 for v in ImageColor.getrgb(self._colour(entry))[:3])
        return [
            Ball(position=feet[leg], radius=_GLOW * self._radius, rgba=(red, green, blue, 1.0))
            for leg in range(len(LEGS))
            if self._log.sensed.contact[entry, self._robot, leg]
        ]

    def _colour(self, entry: int) -> str:
        return self._colours[gait_at(self._log, self._robot, entry)]


_SPEED_SIGMA = 0.3
"""Width of the window that smooths the displayed speed [s], so that the number can be read."""

_SMALLEST = 160
"""Least width and height [pixel]."""


def render(
    log: Log,
    path: Path,
    robot: int = 0,
    *,
    description: Robot = ANYMAL_B,
    width: int = 1280,
    height: int = 720,
    fps: int = 30,
    t0: float = 0.0,
    t1: float = float("inf"),
    report: Callable[[int, int], None] = lambda done, total: None,
) -> None:
    """Writes an MP4 video (H.264) of one robot from `t0` to `t1` [s], in a log of such robots.

    Feet in contact glow in the colour of the gait and leave prints. The strip below shows the gait,
    k and its threshold, the forward speed and the time. `report` is called with the number of
    pictures done and the total.

    Raises:
        VideoUnavailable: no OpenGL, or no ffmpeg, on this machine.
        GaitshiftError: no such robot, a log of another kind of robot, an empty time span, a robot
            whose ground is not in the log, an invalid size or rate, another file ending, or no
            such folder.
    """
    _check_target(path, width, height, fps)
    _check_log(log, robot, description)
    log = window(log, t0, t1)
    entries = _entries(log, fps)
    readings = _readings(log, robot)
    strip = Strip(width, height)
    with (
        Playback(log, robot, description, width, height - strip.height) as playback,
        FilmWriter(path, width, height, fps) as film,
    ):
        for done, entry in enumerate(entries):
            film.add(np.concatenate([playback.picture(entry), strip.draw(readings[entry])]))
            report(done + 1, len(entries))


def _check_target(path: Path, width: int, height: int, fps: int) -> None:
    if path.suffix.lower() != ".mp4":
        raise GaitshiftError(f"{path}: the name of a video must end in .mp4")
    if not path.parent.is_dir():
        raise GaitshiftError(f"{path}: no folder {path.parent}")
    if min(width, height) < _SMALLEST or width % 2 or height % 2:
        raise GaitshiftError(
            f"width and height must be even and {_SMALLEST} or more, got {width} × {height}"
        )
    if not 1 <= fps <= 120:
        raise GaitshiftError(f"fps must be 1 to 120, got {fps}")


def _check_log(log: Log, robot: int, description: Robot) -> None:
    check_robot(log, robot)
    description.check_is(log.robot, "the log")
    if not walks_on_kept_ground(log, robot):
        raise GaitshiftError(
            f"robot must be 0 where robots have different terrains, as the log keeps only that of "
            f"robot 0, got {robot}"
        )


def _entries(log: Log, fps: int) -> list[int]:
    """The entry of each picture."""
    times = np.arange(log.time[0], log.time[-1] + 1e-9, 1 / fps)
    return np.searchsorted(log.time, times - 1e-9).tolist()


def _readings(log: Log, robot: int) -> list[Reading]:
    """The content of the strip at each entry."""
    colours = gait_colours(log.gaits)
    speed = smoothed(log.truth.forward_speed[:, robot], period(log), _SPEED_SIGMA)
    gaits = [gait_at(log, robot, entry) for entry in range(len(log.time))]
    return [
        Reading(
            gait=gait,
            colour=colours[gait],
            k=float(log.k[entry, robot]),
            threshold=float(log.threshold[entry, robot]),
            speed=float(speed[entry]),
            time=float(log.time[entry]),
            fallen=bool(log.fallen[entry, robot]),
        )
        for entry, gait in enumerate(gaits)
    ]
