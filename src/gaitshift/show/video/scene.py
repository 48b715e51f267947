"""The model to look at: the robot, the ground with a picture on it, light and sky."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from gaitshift.robot.description import Robot
from gaitshift.show.geometry import put_on
from gaitshift.sim.terrain import Terrain, to_unit_interval

GROUND = "ground"
"""Name of the ground's geom and of its texture."""

SUN = (-0.35, 0.45, -1.0)
"""Direction in which the sunlight falls, world frame; shadows are cast along it."""

_HORIZON, _ZENITH = (0.93, 0.95, 0.97), (0.55, 0.68, 0.84)
"""Colours of the sky (red, green, blue)."""

_FOG = (5.0, 13.0)
"""Where the ground begins to fade into the horizon, and where it is gone [m]."""

_FOG_CELL = 0.5
"""Distance of the samples of level ground [m]."""

_REACH = 14.0
"""How far the scene goes beyond the robot's course [m]: just further than one sees."""

_TEXELS = 1_200_000
"""Most points of the picture on the ground: it is drawn anew for each frame."""

_FINEST = 64.0
"""Most of them a metre."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A robot's model on a ground that can be painted on."""

    model: mujoco.MjModel
    terrain: Terrain
    """The part of the ground that can be seen."""
    texture: int
    """Id of the ground's texture."""


def build_scene(
    robot: Robot, terrain: Terrain, course: Float[np.ndarray, "T 2"], width: int, height: int
) -> Scene:
    """The scene for a robot that walks along `course` (x, y) [m], for pictures of this size."""
    seen = _around(terrain, course)
    spec = robot.spec(robot.gains_of("default"))
    put_on(spec, robot)
    _set_look(spec, width, height)
    field = to_unit_interval(seen)
    rows, columns = _texture_shape(seen)
    spec.add_texture(
        name=GROUND,
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        width=columns,
        height=rows,
        nchannel=3,
    )
    material = spec.add_material(name=GROUND, specular=0.0, shininess=0.0, reflectance=0.0)
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = GROUND
    spec.add_hfield(
        name=GROUND,
        nrow=field.data.shape[0],
        ncol=field.data.shape[1],
        size=field.size,
        userdata=field.data.ravel().tolist(),
    )
    spec.worldbody.add_geom(
        name=GROUND,
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname=GROUND,
        material=GROUND,
        pos=field.position,
    )
    model = spec.compile()
    return Scene(model=model, terrain=seen, texture=model.texture(GROUND).id)


def _set_look(spec: mujoco.MjSpec, width: int, height: int) -> None:
    """Light, sky, fog and the size of the picture; lengths are multiples of the extent, 1 m."""
    spec.stat.extent = 1.0
    look = spec.visual
    look.global_.offwidth, look.global_.offheight = width, height
    look.quality.offsamples = 0
    look.map.znear, look.map.zfar = 0.05, 60.0
    look.map.fogstart, look.map.fogend = _FOG
    look.rgba.fog = np.array([*_HORIZON, 1.0], dtype=np.float32)
    look.headlight.ambient = np.full(3, 0.42, dtype=np.float32)
    look.headlight.diffuse = np.full(3, 0.30, dtype=np.float32)
    look.headlight.specular = np.full(3, 0.05, dtype=np.float32)
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=_ZENITH,
        rgb2=_HORIZON,
        width=128,
        height=128 * 6,
    )
    spec.worldbody.add_light(
        name="sun",
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        dir=SUN,
        diffuse=[0.62, 0.60, 0.56],
        specular=[0.2] * 3,
        castshadow=False,
    )


def _around(terrain: Terrain, course: Float[np.ndarray, "T 2"]) -> Terrain:
    """The part of a terrain in sight of the course; level ground goes on beyond its border."""
    (left, back), (right, front) = course.min(axis=0) - _REACH, course.max(axis=0) + _REACH
    if terrain.is_flat:
        return Terrain(
            height=np.full(_fog_grid(right - left, front - back), terrain.height[0, 0]),
            size=(float(right - left), float(front - back)),
            origin=(float(left), float(back)),
            name=terrain.name,
        )
    (dx, dy), (x0, y0) = terrain.cell, terrain.origin
    rows, columns = terrain.height.shape
    i0, i1 = _inside((back - y0) / dy, (front - y0) / dy, rows)
    j0, j1 = _inside((left - x0) / dx, (right - x0) / dx, columns)
    return Terrain(
        height=terrain.height[i0 : i1 + 1, j0 : j1 + 1],
        size=((j1 - j0) * dx, (i1 - i0) * dy),
        origin=(x0 + j0 * dx, y0 + i0 * dy),
        name=terrain.name,
    )


def _fog_grid(length: float, width: float) -> tuple[int, int]:
    """Rows and columns of level ground: fog is reckoned at the samples, and straight between."""
    return int(np.ceil(width / _FOG_CELL)) + 1, int(np.ceil(length / _FOG_CELL)) + 1


def _inside(low: float, high: float, count: int) -> tuple[int, int]:
    """First and last sample of an axis in a range of sample numbers, at least two samples."""
    first = min(max(int(np.floor(low)), 0), count - 2)
    return first, max(min(int(np.ceil(high)), count - 1), first + 1)


def _texture_shape(terrain: Terrain) -> tuple[int, int]:
    """Rows and columns of the picture on the ground."""
    length, width = terrain.size
    fine = min(_FINEST, float(np.sqrt(_TEXELS / (length * width))))
    return max(2, round(width * fine)), max(2, round(length * fine))
