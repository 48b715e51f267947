"""Pictures of a model, rendered by OpenGL into arrays, and the camera that follows a robot."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

import mujoco
import numpy as np
from jaxtyping import Float, UInt8

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.show.opengl import open_context
from gaitshift.show.plots.signals import period, smoothed

_MAX_GEOMS = 2000

_GLOW = 0.35
"""Emission of a ball, so that together with the scene's light it has about its own colour."""

_FONT = mujoco.mjtFontScale.mjFONTSCALE_100.value


class VideoUnavailable(GaitshiftError):  # noqa: N818  a state of the machine, not a mistake
    """Videos cannot be made on this machine; nothing else depends on them."""


@dataclass(frozen=True, kw_only=True)
class Camera:
    """Position and direction of a camera."""

    target: tuple[float, float, float]
    """World point in the middle of the picture [m]."""
    distance: float
    """Distance of the camera from there [m]."""
    azimuth: float
    """Heading in which it looks, about world z [degree]."""
    elevation: float
    """Pitch at which it looks, negative: down [degree]."""


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A ball that emits light, drawn over the model."""

    position: Float[np.ndarray, " 3"]
    """Centre, world frame [m]."""
    radius: float
    """[m]"""
    rgba: tuple[float, float, float, float]
    """Red, green, blue and opacity in [0, 1]."""


class Canvas:
    """Draws one model in one size; one at a time, to be closed when done.

    Raises `VideoUnavailable` where there is no OpenGL.
    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        self._model = model
        self._rect = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.empty((height, width, 3), dtype=np.uint8)
        self._gl: Any = None
        try:
            self._gl = open_context(width, height)
            self._context = mujoco.MjrContext(model, _FONT)
        except Exception as error:  # each way to OpenGL fails in its own class
            if self._gl is not None:
                self._gl.free()
            raise VideoUnavailable(
                f"videos need OpenGL ({_first_line(error)}); "
                "on Debian or Ubuntu: apt-get install libegl1 libgl1"
            ) from error
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._context)
        self._scene = mujoco.MjvScene(model, _MAX_GEOMS)
        self._scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
        self._scene.flags[mujoco.mjtRndFlag.mjRND_FOG] = 1
        self._options = mujoco.MjvOption()

    def close(self) -> None:
        """Frees OpenGL's memory."""
        self._context.free()
        self._gl.free()

    def upload_texture(self, texture: int) -> None:
        """Uploads the present content of the model's `tex_data`."""
        mujoco.mjr_uploadTexture(self._model, self._context, texture)

    def draw(
        self, data: mujoco.MjData, camera: Camera, balls: Sequence[Ball] = ()
    ) -> UInt8[np.ndarray, "height width 3"]:
        """The model at `data`, seen by `camera`: rows from the top, red, green, blue."""
        placed = mujoco.MjvCamera()
        placed.lookat[:] = camera.target
        placed.distance, placed.azimuth = camera.distance, camera.azimuth
        placed.elevation = camera.elevation
        every = mujoco.mjtCatBit.mjCAT_ALL.value
        mujoco.mjv_updateScene(self._model, data, self._options, None, placed, every, self._scene)
        for ball in balls:
            self._add(ball)
        mujoco.mjr_render(self._rect, self._scene, self._context)
        mujoco.mjr_readPixels(self._pixels, None, self._rect, self._context)
        return np.ascontiguousarray(self._pixels[::-1])

    def _add(self, ball: Ball) -> None:
        geom = cast("mujoco.MjvGeom", self._scene.geoms[self._scene.ngeom])
        mujoco.mjv_initGeom(
            geom,
            mujoco.mjtGeom.mjGEOM_SPHERE,
            np.full(3, ball.radius),
            ball.position,
            np.eye(3).ravel(),
            np.array(ball.rgba, dtype=np.float32),
        )
        geom.emission = _GLOW
        self._scene.ngeom += 1


def _first_line(error: Exception) -> str:
    return (str(error).strip() or type(error).__name__).splitlines()[0]


_DISTANCE = 2.25
"""[m]: the robot fills about a quarter of the picture's width."""

_AZIMUTH, _ELEVATION = 58.0, -18.0
"""View from the robot's right and slightly from behind, so that the ground ahead is visible."""

_LOWER = 0.14
"""Distance of the middle of the picture below the base [m]: half-way to the feet."""

_ALONG, _UP, _TURN = 0.5, 1.0, 1.5
"""Windows that smooth the course over the ground, in height and in heading [s]; longer than a
stride, so that the camera does not follow the body's oscillation."""


def follow(log: Log, robot: int) -> list[Camera]:
    """The camera that follows a robot smoothly, at each entry of the log."""
    step = period(log)
    x, y, z = log.truth.base_position_w[:, robot, :3].T
    yaw = smoothed(np.unwrap(log.sensed.yaw[:, robot]), step, _TURN)
    course = zip(
        smoothed(x, step, _ALONG).tolist(),
        smoothed(y, step, _ALONG).tolist(),
        (smoothed(z, step, _UP) - _LOWER).tolist(),
        (_AZIMUTH + np.degrees(yaw)).tolist(),
        strict=True,
    )
    return [
        Camera(target=(cx, cy, cz), distance=_DISTANCE, azimuth=azimuth, elevation=_ELEVATION)
        for cx, cy, cz, azimuth in course
    ]
