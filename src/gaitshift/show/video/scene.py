"""The rendered model: the robot, light, sky, and the ground with a painted texture."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageColor, ImageDraw, ImageFilter

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
"""Distances at which the ground begins to fade, and at which it is invisible [m]."""

_FOG_CELL = 0.5
"""Distance of the samples of level ground [m]."""

_REACH = 14.0
"""Extent of the scene beyond the robot's course [m]: just beyond the visible range."""

_TEXELS = 1_200_000
"""Largest number of points of the ground's texture, which is painted for each frame."""

_FINEST = 64.0
"""Largest number of these points per metre."""


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A robot's model on a ground with a texture that can be painted."""

    model: mujoco.MjModel
    terrain: Terrain
    """The visible part of the ground."""
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
    """The part of a terrain in sight of the course; level ground extends beyond its border."""
    left, back = (float(end) for end in course.min(axis=0) - _REACH)
    right, front = (float(end) for end in course.max(axis=0) + _REACH)
    if terrain.is_flat:
        return Terrain(
            height=np.full(_fog_grid(right - left, front - back), terrain.height[0, 0]),
            size=(right - left, front - back),
            origin=(left, back),
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
    """Rows and columns of level ground: OpenGL computes fog at the samples and interpolates."""
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


_LOW, _HIGH = np.array([126.0, 141.0, 134.0]), np.array([244.0, 232.0, 210.0])
"""Colours of the lowest and the highest ground (red, green, blue)."""

_RELIEF = 0.24
"""Least difference in height between the two [m], so that small ripples keep a similar colour."""

_SQUARE, _CONTRAST = 0.5, 0.07
"""Side of the squares that show the motion of the ground [m], and how much darker every other
is."""

_SHADE, _BLUR = 0.42, 0.025
"""Darkness of the shadow, and width of its soft edge [m]."""

_PATCH = 1.4
"""Half side of the square around the robot that contains its shadow [m]."""

_PRINT, _OPACITY = 0.045, 165
"""Radius of a footprint [m], and how much of the ground it covers, of 255."""

_SMOOTH = 4
"""Oversampling of a footprint, which is only a few points wide, so that it is round."""

_CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
_FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
"""A box: its corners, and which of them each face has."""


class Paint:
    """Paints on the ground of a scene, in the texture's own memory."""

    def __init__(self, scene: Scene) -> None:
        model, terrain = scene.model, scene.terrain
        rows = int(model.tex_height[scene.texture])
        columns = int(model.tex_width[scene.texture])
        start = int(model.tex_adr[scene.texture])
        texels = model.tex_data[start : start + rows * columns * 3].reshape(rows, columns, 3)
        # MuJoCo's textures begin at the far edge; here rows run along +y, as in terrains.
        self._shown: UInt8[np.ndarray, "rows columns 3"] = texels[::-1]
        self._terrain = terrain
        self._fine = np.array([columns / terrain.size[0], rows / terrain.size[1]])
        self._dry = self._bare_ground(rows, columns)
        self._shown[:] = self._dry
        self._wet: tuple[slice, slice] | None = None
        self._solid = np.flatnonzero((model.geom_group <= 2) & (model.geom_bodyid > 0))

    def add_footprint(self, xy: Float[np.ndarray, " 2"], colour: str) -> None:
        """Leaves a permanent mark [m]."""
        window, patch, corner = self._cut(self._dry, xy, 2 * _PRINT)
        middle, reach = self._texel(xy) - corner, _PRINT * self._fine
        large = Image.new("L", (_SMOOTH * patch.width, _SMOOTH * patch.height))
        box = [*(_SMOOTH * (middle - reach)).tolist(), *(_SMOOTH * (middle + reach)).tolist()]
        ImageDraw.Draw(large).ellipse(box, fill=_OPACITY)
        patch.paste(ImageColor.getrgb(colour), mask=large.reduce(_SMOOTH))
        self._dry[window] = np.asarray(patch)
        self._shown[window] = self._dry[window]

    def move_shadow(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Paints the shadow of the robot's visible parts."""
        if self._wet is not None:
            self._shown[self._wet] = self._dry[self._wet]
        corners = self._cast(model, data)
        window, patch, corner = self._cut(self._dry, corners.mean(axis=(0, 1)), _PATCH)
        mask = Image.new("L", patch.size)
        pen = ImageDraw.Draw(mask)
        points = (self._texel(corners) - corner).reshape(len(corners), 8, 2)
        for box in points.tolist():
            for face in _FACES:
                pen.polygon([tuple(box[i]) for i in face], fill=255)
        mask = mask.filter(ImageFilter.GaussianBlur(_BLUR * float(self._fine[0])))
        light = 1.0 - _SHADE * (np.asarray(mask, dtype=np.float32) / 255.0)
        self._shown[window] = (np.asarray(patch) * light[..., None]).astype(np.uint8)
        self._wet = window

    def _bare_ground(self, rows: int, columns: int) -> UInt8[np.ndarray, "rows columns 3"]:
        x0, x1, y0, y1 = self._terrain.extent
        x = x0 + (np.arange(columns) + 0.5) / columns * (x1 - x0)
        y = y0 + (np.arange(rows) + 0.5) / rows * (y1 - y0)
        xy = np.stack(np.meshgrid(x, y), axis=-1)
        height = self._terrain.height_at(xy)
        low, high = float(height.min()), float(height.max())
        share = 0.5 + (height - (low + high) / 2) / max(high - low, _RELIEF)
        colour = _LOW + (_HIGH - _LOW) * share[..., None]
        odd = np.floor(xy / _SQUARE).sum(axis=-1) % 2
        return (colour * (1.0 - _CONTRAST * odd[..., None])).astype(np.uint8)

    def _cast(self, model: mujoco.MjModel, data: mujoco.MjData) -> Float[np.ndarray, "geoms 8 2"]:
        """World x, y of the shadow's corners [m]: eight per part's box, on the ground."""
        boxes, rotation = model.geom_aabb[self._solid], data.geom_xmat[self._solid]
        local = boxes[:, None, :3] + boxes[:, None, 3:] * _CORNERS
        corners = np.einsum("gij,gcj->gci", rotation.reshape(-1, 3, 3), local)
        corners += data.geom_xpos[self._solid][:, None]
        slope = np.array(SUN[:2]) / -SUN[2]
        over = corners[..., 2] - self._terrain.height_at(corners[..., :2])
        landing = corners[..., :2] + slope * over[..., None]
        over = corners[..., 2] - self._terrain.height_at(landing)
        return corners[..., :2] + slope * over[..., None]

    def _texel(self, xy: Float[np.ndarray, "*batch 2"]) -> Float[np.ndarray, "*batch 2"]:
        """Column and row of world points."""
        return (xy - np.array(self._terrain.origin)) * self._fine

    def _cut(
        self,
        picture: UInt8[np.ndarray, "rows columns 3"],
        xy: Float[np.ndarray, " 2"],
        reach: float,
    ) -> tuple[tuple[slice, slice], Image.Image, Float[np.ndarray, " 2"]]:
        """The square of half side `reach` [m] around a point: its slices, a copy, its corner.

        It is cut at the border of the texture; outside, it is one texel at the border.
        """
        rows, columns = picture.shape[:2]
        low = np.clip(np.floor(self._texel(xy - reach)), 0, (columns - 1, rows - 1)).astype(int)
        high = np.clip(np.ceil(self._texel(xy + reach)), low + 1, (columns, rows)).astype(int)
        window = slice(low[1], high[1]), slice(low[0], high[0])
        return window, Image.fromarray(picture[window]), low.astype(float)
