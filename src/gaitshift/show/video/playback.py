"""A log played back on the scene: the robot as it stood at each entry."""

import mujoco
import numpy as np
from jaxtyping import UInt8
from PIL import ImageColor

from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot
from gaitshift.robot.legs import LEGS
from gaitshift.show.plots.palette import gait_colours
from gaitshift.show.plots.signals import gait_at, ground_of
from gaitshift.show.video.camera import follow
from gaitshift.show.video.canvas import Ball, Canvas
from gaitshift.show.video.paint import Paint
from gaitshift.show.video.scene import build_scene

_GLOW = 1.3
"""Radius of the light on a foot that touches, of the foot's own."""


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
        self._views = follow(log, robot)
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
        return self._canvas.draw(self._data, self._views[entry], self._lights(entry))

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
        """A light on each foot that touches, in the gait's colour."""
        feet = self._log.truth.foot_position_w[entry, self._robot] + [0.0, 0.0, self._radius]
        red, green, blue = (v / 255 for v in ImageColor.getrgb(self._colour(entry))[:3])
        return [
            Ball(position=feet[leg], radius=_GLOW * self._radius, rgba=(red, green, blue, 1.0))
            for leg in range(len(LEGS))
            if self._log.sensed.contact[entry, self._robot, leg]
        ]

    def _colour(self, entry: int) -> str:
        return self._colours[gait_at(self._log, self._robot, entry)]
