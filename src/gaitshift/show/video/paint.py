"""The picture on the ground: its height in colour, squares, footprints, and the robot's shadow."""

import mujoco
import numpy as np
from jaxtyping import Float, UInt8
from PIL import Image, ImageColor, ImageDraw, ImageFilter

from gaitshift.show.video.scene import SUN, Scene

_LOW, _HIGH = np.array([126.0, 141.0, 134.0]), np.array([244.0, 232.0, 210.0])
"""Colours of the lowest and the highest ground (red, green, blue)."""

_RELIEF = 0.24
"""Least difference in height between the two [m], so that ripples do not look like mountains."""

_SQUARE, _CONTRAST = 0.5, 0.07
"""Side of the squares by which one sees the ground move [m]; how much darker every other is."""

_SHADE, _BLUR = 0.42, 0.025
"""How much light the shadow takes, and how soft its edge is [m]."""

_PATCH = 1.4
"""Half side of the square around the robot that its shadow lies in [m]."""

_PRINT, _OPACITY = 0.045, 165
"""Radius of a footprint [m], and how much of the ground it covers, of 255."""

_SMOOTH = 4
"""A footprint is a few points wide: drawn so many times as large and shrunk, it is round."""

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
        """Leaves a mark [m] that stays."""
        window, patch, corner = self._cut(self._dry, xy, 2 * _PRINT)
        middle, reach = self._texel(xy) - corner, _PRINT * self._fine
        large = Image.new("L", (_SMOOTH * patch.width, _SMOOTH * patch.height))
        box = [*(_SMOOTH * (middle - reach)).tolist(), *(_SMOOTH * (middle + reach)).tolist()]
        ImageDraw.Draw(large).ellipse(box, fill=_OPACITY)
        patch.paste(ImageColor.getrgb(colour), mask=large.reduce(_SMOOTH))
        self._dry[window] = np.asarray(patch)
        self._shown[window] = self._dry[window]

    def move_shadow(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Lays the shadow of the robot's visible parts where the sun casts it."""
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
        """World x, y of the shadow's corners [m]: eight of each part's box, laid on the ground."""
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
        """The square of half side `reach` [m] around a point: its place, a copy, its corner.

        Only what lies on the ground of it; where nothing does, one texel of the rim.
        """
        rows, columns = picture.shape[:2]
        low = np.clip(np.floor(self._texel(xy - reach)), 0, (columns - 1, rows - 1)).astype(int)
        high = np.clip(np.ceil(self._texel(xy + reach)), low + 1, (columns, rows)).astype(int)
        window = slice(low[1], high[1]), slice(low[0], high[0])
        return window, Image.fromarray(picture[window]), low.astype(float)
