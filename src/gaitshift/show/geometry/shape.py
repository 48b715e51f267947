"""Shapes in three dimensions: the robot's bodies, and the ground as a mesh coloured by height."""

from dataclasses import dataclass
from typing import Any, cast

import mujoco
import numpy as np
import trimesh
from jaxtyping import Float, Shaped, UInt8

from gaitshift.robot.description import Robot
from gaitshift.show.geometry.meshes import VISUAL, put_on
from gaitshift.sim.terrain import Terrain

_GEOM = mujoco.mjtGeom

_GAMMA = 2.2
"""Exponent that approximates sRGB."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Body:
    """A rigid part of the robot."""

    name: str
    """As in the model."""
    index: int
    """Of the model's body."""
    mesh: trimesh.Trimesh
    """Its surface in the body's frame [m], coloured at its vertices."""


class Shape:
    """A robot's bodies, and their poses for any `qpos`."""

    def __init__(self, robot: Robot) -> None:
        spec = robot.spec(robot.gains_of("default"))
        put_on(spec, robot)
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self.bodies = tuple(
            Body(name=self._model.body(index).name, index=index, mesh=mesh)
            for index in range(1, self._model.nbody)
            if (mesh := _mesh_of(self._model, index)) is not None
        )

    def poses(
        self, qpos: Float[np.ndarray, "N 19"]
    ) -> tuple[Float[np.ndarray, "B N 3"], Float[np.ndarray, "B N 4"]]:
        """Positions [m] and quaternions (w, x, y, z) of each body of N robots, world frame."""
        rows = [body.index for body in self.bodies]
        position, rotation = list[np.ndarray](), list[np.ndarray]()
        for one in qpos:
            self._data.qpos[:] = one
            mujoco.mj_kinematics(self._model, self._data)
            position.append(self._data.xpos[rows].copy())
            rotation.append(self._data.xquat[rows].copy())
        return np.stack(position, axis=1), np.stack(rotation, axis=1)


def _mesh_of(model: mujoco.MjModel, body: int) -> trimesh.Trimesh | None:
    """The visual shapes of a body as one mesh: groups up to `VISUAL`, as in MuJoCo."""
    first, count = int(model.body_geomadr[body]), int(model.body_geomnum[body])
    parts = [
        _geom(model, geom)
        for geom in range(first, first + count)
        if model.geom_group[geom] <= VISUAL
    ]
    return cast(Any, trimesh.util).concatenate(parts) if parts else None


def _geom(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """One shape in its body's frame."""
    kind = int(model.geom_type[geom])
    if kind == _GEOM.mjGEOM_MESH:
        mesh = _surface(model, int(model.geom_dataid[geom]))
    else:
        mesh = _primitive(kind, model.geom_size[geom])
    pose = np.eye(4)
    turned = np.zeros(9)
    mujoco.mju_quat2Mat(turned, model.geom_quat[geom])
    pose[:3, :3], pose[:3, 3] = turned.reshape(3, 3), model.geom_pos[geom]
    mesh.apply_transform(pose)
    material = int(model.geom_matid[geom])
    rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    colour = np.rint(255 * np.asarray(rgba)).astype(np.uint8)
    return coloured(mesh, np.tile(colour, (len(mesh.vertices), 1)))


def _surface(model: mujoco.MjModel, mesh: int) -> trimesh.Trimesh:
    """A mesh of the model, in its geom's frame."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    face, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    return trimesh.Trimesh(
        model.mesh_vert[first : first + count], model.mesh_face[face : face + faces], process=False
    )


def coloured(mesh: trimesh.Trimesh, rgba: UInt8[np.ndarray, "V 4"]) -> trimesh.Trimesh:
    """The mesh itself, with a colour at each vertex, given as it is to look (sRGB).

    Kept are linear values, which is what glTF and three.js take a vertex's colour for.
    """
    kept = np.column_stack([linear(rgba[:, :3]), rgba[:, 3]])
    mesh.visual = cast(Any, trimesh).visual.ColorVisuals(mesh, vertex_colors=kept)
    return mesh


def linear(rgb: Shaped[np.ndarray, "*colours 3"]) -> UInt8[np.ndarray, "*colours 3"]:
    """Linear values, 0 to 255, of colours given as they are to look (sRGB), 0 to 255."""
    return np.rint(255.0 * (rgb / 255.0) ** _GAMMA).astype(np.uint8)


def _primitive(kind: int, size: Float[np.ndarray, " 3"]) -> trimesh.Trimesh:
    """A shape of MuJoCo's about the origin; sizes are half lengths and radii [m]."""
    make = cast(Any, trimesh.creation)
    if kind == _GEOM.mjGEOM_BOX:
        return make.box(extents=2 * size)
    if kind == _GEOM.mjGEOM_SPHERE:
        return make.icosphere(subdivisions=2, radius=size[0])
    if kind == _GEOM.mjGEOM_ELLIPSOID:
        mesh = make.icosphere(subdivisions=3, radius=1.0)
        mesh.apply_scale(size)
        return mesh
    if kind == _GEOM.mjGEOM_CYLINDER:
        return make.cylinder(radius=size[0], height=2 * size[1], sections=24)
    if kind == _GEOM.mjGEOM_CAPSULE:
        return make.capsule(radius=size[0], height=2 * size[1], count=[12, 12])
    raise TypeError(f"cannot draw a geom of type {kind}")


_FINE = 0.08
"""Least distance between the samples of the drawn ground [m]."""

_LOW, _MIDDLE, _HIGH = (np.array(c) for c in ((150, 136, 120), (205, 194, 178), (242, 236, 226)))
"""Colours of the lowest ground, of height 0 and of the highest."""

_CHECK = 1.0
"""Edge of the squares on the ground, which show the speed of a robot [m]."""


def ground_grid(
    ground: Terrain,
) -> tuple[Float[np.ndarray, " C"], Float[np.ndarray, " R"], Float[np.ndarray, "R C"]]:
    """Samples of a ground at the drawn resolution: x, y, and the heights there [m]."""
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
