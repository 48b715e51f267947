"""The robot's detailed meshes, read from COLLADA files, simplified, and put on its model."""

import io
import os
import zipfile
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any, cast
from xml.etree import ElementTree

import mujoco
import numpy as np
import trimesh
from jaxtyping import Float, Int

from gaitshift.robot.description import Robot
from gaitshift.robot.urdf import LEGS_BY_URDF, WHEEL, urdf_of
from gaitshift.whole_file import replacing

_CARBON = "0.2 0.2 0.21 1"
"""Colour in place of the textures of carbon fibre."""

_PLAIN = (0.45, 0.45, 0.46)
"""Colour of parts without a material."""

_KEPT = 0.09
"""Share of the triangles of each part that remains after simplification."""

_FEWEST = 150
"""Parts with fewer triangles are not simplified."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Part:
    """A surface of one colour."""

    body: str
    """The model's body that it belongs to."""
    vertices: Float[np.ndarray, "V 3"]
    """In the body's frame [m]."""
    faces: Int[np.ndarray, "F 3"]
    """Corners of the triangles."""
    colour: Float[np.ndarray, " 3"]
    """Red, green, blue, 0 to 1."""


def convert(urdf: Path) -> list[Part]:
    """The surfaces of all links that have one, in the frames of the model's bodies."""
    parts = list[Part]()
    for link in ElementTree.parse(urdf).getroot().iter("link"):
        mesh, origin = link.find("visual/geometry/mesh"), link.find("visual/origin")
        if mesh is None or origin is None:
            continue
        leg, _, name = link.attrib["name"].partition("_")
        body = f"{LEGS_BY_URDF[leg]}_{name.lower()}" if name else leg
        file = urdf.parents[2] / mesh.attrib["filename"].partition("/robots/")[2]
        roll, pitch, yaw = (float(value) for value in origin.attrib["rpy"].split())
        pose = cast(Any, trimesh.transformations).euler_matrix(roll, pitch, yaw)
        pose[:3, 3] = [float(value) for value in origin.attrib["xyz"].split()]
        for colour, surface in _surfaces(file).items():
            moved = surface.copy()
            moved.apply_transform(pose)
            parts.append(
                Part(
                    body=body,
                    vertices=np.asarray(moved.vertices, dtype=float),
                    faces=np.asarray(moved.faces, dtype=int),
                    colour=np.array(colour, dtype=float),
                )
            )
    return parts


def _surfaces(file: Path) -> dict[tuple[float, ...], trimesh.Trimesh]:
    """A COLLADA file as one simplified mesh per colour."""
    from collada import Collada

    found: dict[tuple[float, ...], list[trimesh.Trimesh]] = {}
    scene = cast(Any, Collada(io.BytesIO(_without_pictures(file)))).scene
    for geometry in scene.objects("geometry"):
        for triangles in geometry.primitives():
            effect = triangles.material.effect if triangles.material else None
            diffuse = tuple(effect.diffuse[:3]) if effect and effect.diffuse else _PLAIN
            colour = tuple(round(float(value), 2) for value in diffuse)
            mesh = trimesh.Trimesh(triangles.vertex, triangles.vertex_index)
            found.setdefault(colour, []).append(_light(mesh))
    return {colour: cast(Any, trimesh.util).concatenate(m) for colour, m in found.items()}


def _light(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    mesh.merge_vertices()
    if len(mesh.faces) < _FEWEST:
        return mesh
    return mesh.simplify_quadric_decimation(face_count=max(_FEWEST, int(_KEPT * len(mesh.faces))))


def _without_pictures(file: Path) -> bytes:
    """The file with plain colours in place of its textures, one of which is missing."""
    root = ElementTree.parse(file).getroot()
    space = root.tag.partition("}")[0] + "}"
    for profile in root.iter(f"{space}profile_COMMON"):
        for parameter in profile.findall(f"{space}newparam"):
            profile.remove(parameter)
        for diffuse in profile.iter(f"{space}diffuse"):
            for picture in diffuse.findall(f"{space}texture"):
                diffuse.remove(picture)
                ElementTree.SubElement(diffuse, f"{space}color").text = _CARBON
    return ElementTree.tostring(root)


VISUAL = 2
"""Group of the visual shapes in the models."""

_NEEDED = ("collada", "fast_simplification")


def has_meshes(robot: Robot) -> bool:
    """Whether the robot's own surfaces are available."""
    return _description(robot) is not None


def put_on(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Replaces the visual shapes of a robot's model by its own surfaces, if available."""
    parts = _parts(robot)
    replaced = {part.body for part in parts}
    for geom in cast("list[mujoco.MjsGeom]", spec.geoms):
        is_shape = geom.group == VISUAL and geom.conaffinity == 0
        if is_shape and cast(Any, geom.parent).name in replaced:
            spec.delete(geom)
    for number, part in enumerate(parts):
        name = f"{part.body}_{number}"
        spec.add_mesh(
            name=name,
            uservert=part.vertices.ravel().tolist(),
            userface=part.faces.ravel().tolist(),
            inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
        )
        cast(Any, spec.body(part.body)).add_geom(
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            group=VISUAL,
            contype=0,
            conaffinity=0,
            rgba=[*part.colour, 1.0],
        )


def _parts(robot: Robot) -> list[Part]:
    """All surfaces of a robot, from the cache if present; none without the extra `meshes`."""
    urdf = _description(robot)
    if urdf is None:
        return []
    cache = _cache(robot)
    if cache is None:
        return convert(urdf)
    if cache.is_file():
        try:
            return _read(cache)
        except (OSError, ValueError, KeyError, zipfile.BadZipFile):
            pass  # damaged: made anew
    parts = convert(urdf)
    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        _write(cache, parts)
    except OSError:
        pass  # a home that cannot be written to: converted anew each time
    return parts


def _cache(robot: Robot) -> Path | None:
    """The file that keeps a robot's surfaces; None for a user without a home."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    except RuntimeError:
        return None
    return base / "gaitshift" / f"{robot.name}-{metadata.version(WHEEL)}.npz"


def _description(robot: Robot) -> Path | None:
    """The robot's URDF in the wheel, if all of the extra is installed."""
    return urdf_of(robot) if all(find_spec(name) for name in _NEEDED) else None


def _write(path: Path, parts: list[Part]) -> None:
    arrays: dict[str, Any] = {"body": np.array([part.body for part in parts])}
    for number, part in enumerate(parts):
        arrays[f"vertices_{number}"] = part.vertices.astype(np.float32)
        arrays[f"faces_{number}"] = part.faces.astype(np.int32)
        arrays[f"colour_{number}"] = part.colour
    with replacing(path) as part, part.open("wb") as file:
        np.savez_compressed(file, **arrays)


def _read(path: Path) -> list[Part]:
    with np.load(path) as kept:
        return [
            Part(
                body=str(body),
                vertices=kept[f"vertices_{number}"].astype(float),
                faces=kept[f"faces_{number}"].astype(int),
                colour=kept[f"colour_{number}"],
            )
            for number, body in enumerate(kept["body"])
        ]
