"""The ground as a mesh, coloured by height."""

import numpy as np
import trimesh
from jaxtyping import Float

from gaitshift.show.geometry.shape import coloured
from gaitshift.sim.terrain import Terrain

_FINE = 0.08
"""The ground is drawn with samples this far apart at the finest [m]."""

_LOW, _MIDDLE, _HIGH = (np.array(c) for c in ((150, 136, 120), (205, 194, 178), (242, 236, 226)))
"""Colours of the ground at its lowest, at level 0 and at its highest."""

_CHECK = 1.0
"""Edge of the squares on the ground, which show how fast a robot goes [m]."""


def ground_grid(
    ground: Terrain,
) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, " R"], Float[np.ndarray, "R C"]]:
    """Samples of a ground, as fine as is worth drawing: x, y, and the heights there [m]."""
    (dx, dy), (x0, y0) = ground.cell, ground.origin
    length, width = ground.size
    fine = 0.25 if ground.is_flat else _FINE
    x = x0 + np.linspace(0.0, length, max(2, round(length / max(fine, dx)) + 1))
    y = y0 + np.linspace(0.0, width, max(2, round(width / max(fine, dy)) + 1))
    return x, y, ground.height_at(np.stack(np.meshgrid(x, y), axis=-1))


def ground_mesh(ground: Terrain) -> trimesh.Trimesh:
    """A ground as a mesh, coloured by height, with squares of a metre."""
    columns, rows, height = ground_grid(ground)
    x, y = np.meshgrid(columns, rows)
    i, j = np.meshgrid(np.arange(len(rows) - 1), np.arange(len(columns) - 1), indexing="ij")
    corner = (i * len(columns) + j).ravel()
    right, above = corner + 1, corner + len(columns)
    faces = np.concatenate(
        [
            np.column_stack([corner, right, above + 1]),
            np.column_stack([corner, above + 1, above]),
        ]
    )
    mesh = trimesh.Trimesh(
        vertices=np.column_stack([x.ravel(), y.ravel(), height.ravel()]), faces=faces, process=False
    )
    return coloured(mesh, _ground_colours(x.ravel(), y.ravel(), height.ravel()))


def _ground_colours(
    x: Float[np.ndarray, " V"], y: Float[np.ndarray, " V"], height: Float[np.ndarray, " V"]
) -> np.ndarray:
    reach = max(float(np.abs(height).max()), 0.05)
    share = np.clip(height / reach, -1.0, 1.0)[:, None]
    colour = np.where(
        share < 0, _MIDDLE + share * (_MIDDLE - _LOW), _MIDDLE + share * (_HIGH - _MIDDLE)
    )
    is_dark = (np.floor(x / _CHECK) + np.floor(y / _CHECK)) % 2 == 0
    colour = colour * np.where(is_dark, 0.94, 1.0)[:, None]
    return np.column_stack([colour, np.full(len(colour), 255.0)]).astype(np.uint8)
