"""A robot's surfaces from its URDF and COLLADA files, as light meshes of one colour each."""

import io
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast
from xml.etree import ElementTree

import numpy as np
import trimesh
from jaxtyping import Float, Int

_LEGS = {"LF": "FL", "RF": "FR", "LH": "BL", "RH": "BR"}
"""Its names of the legs, and ours."""

_CARBON = "0.2 0.2 0.21 1"
"""Stands for the pictures of carbon fibre."""

_PLAIN = (0.45, 0.45, 0.46)
"""Of parts without a material."""

_KEPT = 0.09
"""Share of the triangles that is kept of each part."""

_FEWEST = 150
"""Parts with fewer triangles stay as they are."""


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
    """The surfaces of all links that have one, in the frames of our model's bodies."""
    parts = list[Part]()
    for link in ElementTree.parse(urdf).getroot().iter("link"):
        mesh, origin = link.find("visual/geometry/mesh"), link.find("visual/origin")
        if mesh is None or origin is None:
            continue
        leg, _, name = link.attrib["name"].partition("_")
        body = f"{_LEGS[leg]}_{name.lower()}" if name else leg
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
    """A COLLADA file as one light mesh a colour."""
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
    """The file with plain colours for its pictures, one of which names a file that is not there."""
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
