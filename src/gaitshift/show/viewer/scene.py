"""The three-dimensional part of a page: ground, robots, lit feet, and the plane through touches."""

from typing import Any, cast

import numpy as np
import trimesh
import viser
from jaxtyping import Float
from PIL import ImageColor

from gaitshift.robot.description import Robot
from gaitshift.show.geometry import Frame, Shape, ground_mesh, linear, plane_corners
from gaitshift.show.plots.style import gait_colours
from gaitshift.sim.terrain import Terrain

_DARK = (70, 75, 82)
"""Colour of a foot without contact."""

_FOLLOW = 0.08
"""Share of the distance to the robot that the camera covers in each frame."""


class Scene:
    """The drawn shapes of one ground and N robots.

    The ground is in the frame `/world`, which moves. Robots are drawn relative to the picture, so
    that they stay in it even if a slow browser updates one of the two late.
    """

    def __init__(self, server: viser.ViserServer, robot: Robot, gaits: tuple[str, ...]) -> None:
        self._scene = cast(Any, server.scene)
        self._shape = Shape(robot)
        self._radius = robot.foot_radius
        self._palette = np.array(
            [ImageColor.getrgb(colour)[:3] for colour in gait_colours(gaits).values()]
        )
        self._scene.set_up_direction("+z")
        self._scene.configure_default_lights(enabled=True, cast_shadow=True)
        self._scene.configure_environment_map("park", environment_intensity=0.9)
        self._root = self._scene.add_frame("/world", show_axes=False)
        self._bodies: list[Any] = []
        self._feet: Any = None
        self._touches: Any = None
        self._plane: Any = None
        self.follows = True
        """Whether the world moves so that the first robot stays at its place in the picture."""
        self._centre = np.zeros(3)

    def set_ground(self, ground: Terrain) -> None:
        """Draws another ground."""
        self._scene.add_mesh_trimesh("/world/ground", ground_mesh(ground), cast_shadow=False)

    def set_robots(self, n: int) -> None:
        """Changes the number of drawn robots."""
        pose = {
            "batched_wxyzs": np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)),
            "batched_positions": np.zeros((n, 3)),
        }
        self._bodies = [
            self._scene.add_batched_meshes_trimesh(
                f"/robot/{body.name}", body.mesh, lod="off", **pose
            )
            for body in self._shape.bodies
        ]
        ball = cast(Any, trimesh.creation).icosphere(subdivisions=2, radius=1.25 * self._radius)
        self._feet = self._balls("feet", ball, 4 * n)
        dot = cast(Any, trimesh.creation).icosphere(subdivisions=1, radius=0.018)
        self._touches = self._balls("touches", dot, 4)
        self._plane = self._scene.add_mesh_simple(
            "/plane",
            vertices=np.zeros((4, 3)),
            faces=np.array([[0, 1, 2], [0, 2, 3]]),
            color=(0, 114, 178),
            opacity=0.25,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def draw(self, frame: Frame) -> None:
        """Draws a frame."""
        if self.follows:
            base = frame.step.truth.base_position_w[0] * np.array([1.0, 1.0, 0.0])
            far = np.linalg.norm(base - self._centre) > 3.0
            self._centre = base if far else self._centre + _FOLLOW * (base - self._centre)
            self._root.position = -self._centre
        position, rotation = self._shape.poses(frame.step.qpos)
        for handle, where, turned in zip(self._bodies, position, rotation, strict=True):
            handle.batched_positions = (where - self._centre).astype(np.float32)
            handle.batched_wxyzs = turned.astype(np.float32)
        feet = frame.step.truth.foot_position_w + np.array([0.0, 0.0, self._radius]) - self._centre
        self._feet.batched_positions = feet.reshape(-1, 3).astype(np.float32)
        lit = self._palette[frame.step.gait][:, None, :]
        colours = np.where(frame.step.sensed.contact[..., None], lit, _DARK).reshape(-1, 3)
        self._feet.batched_colors = linear(colours)
        self._draw_plane(frame.touch_w[0] - self._centre)

    def _draw_plane(self, touch: Float[np.ndarray, "4 3"]) -> None:
        """The last touches of the first robot, and the plane through them."""
        known = bool(np.isfinite(touch).all())
        self._touches.visible = self._plane.visible = known
        if not known:
            return
        self._touches.batched_positions = touch.astype(np.float32)
        self._plane.vertices = plane_corners(touch).astype(np.float32)

    def _balls(self, name: str, mesh: trimesh.Trimesh, count: int) -> Any:
        return self._scene.add_batched_meshes_simple(
            f"/{name}",
            vertices=mesh.vertices,
            faces=mesh.faces,
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (count, 1)),
            batched_positions=np.zeros((count, 3)),
            batched_colors=np.tile(np.array([230, 159, 0], dtype=np.uint8), (count, 1)),
            lod="off",
            cast_shadow=False,
        )
