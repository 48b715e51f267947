"""The robot's own surfaces in place of our primitives, where the extra `[meshes]` is installed.

ANYmal's are those of ANYbotics in the wheel `example-robot-data` (BSD-3-Clause): COLLADA, which
MuJoCo does not read. They are converted once, to some 53 000 triangles, and kept in the cache.
"""

import os
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np

from gaitshift.robot.description import Robot
from gaitshift.show.geometry.collada import Part, convert

VISUAL = 2
"""The models' group of shapes to look at."""

_WHEEL = "example-robot-data"
_NEEDED = ("collada", "fast_simplification")
_ROBOTS = "cmeel.prefix/share/example-robot-data/robots"
_URDF = {"anymal_b": "anymal_b_simple_description/robots/anymal.urdf"}
"""Descriptions of the robots that the wheel knows."""


def has_meshes(robot: Robot) -> bool:
    """Whether the robot's own surfaces can be had."""
    return _description(robot) is not None


def put_on(spec: mujoco.MjSpec, robot: Robot) -> None:
    """Replaces the shapes to look at in a robot's model by its own surfaces, if they can be had."""
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
    """All surfaces of a robot, from the cache if they are there; none without the extra."""
    urdf = _description(robot)
    if urdf is None:
        return []
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    cache = base / "gaitshift" / f"{robot.name}-{metadata.version(_WHEEL)}.npz"
    if cache.is_file():
        try:
            return _read(cache)
        except (OSError, ValueError, KeyError):
            pass  # damaged: made anew
    parts = convert(urdf)
    try:
        cache.parent.mkdir(parents=True, exist_ok=True)
        _write(cache, parts)
    except OSError:
        pass  # a home that cannot be written to: converted anew each time
    return parts


def _description(robot: Robot) -> Path | None:
    """The robot's URDF in the wheel, if all of the extra is installed."""
    if robot.name not in _URDF or not all(find_spec(name) for name in _NEEDED):
        return None
    try:
        path = metadata.distribution(_WHEEL).locate_file(f"{_ROBOTS}/{_URDF[robot.name]}")
    except metadata.PackageNotFoundError:
        return None
    return Path(str(path)) if Path(str(path)).is_file() else None


def _write(path: Path, parts: list[Part]) -> None:
    arrays: dict[str, Any] = {"body": np.array([part.body for part in parts])}
    for number, part in enumerate(parts):
        arrays[f"vertices_{number}"] = part.vertices.astype(np.float32)
        arrays[f"faces_{number}"] = part.faces.astype(np.int32)
        arrays[f"colour_{number}"] = part.colour
    unfinished = path.with_suffix(f".{os.getpid()}.npz")
    np.savez_compressed(unfinished, **arrays)
    unfinished.replace(path)


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
