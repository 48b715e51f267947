"""What is to be seen: the robot's bodies, the ground, the plane through the touches."""

import numpy as np
import pytest

from gaitshift.robot.description import ANYMAL_B
from gaitshift.show.geometry import Shape, ground_mesh, linear, plane_corners
from gaitshift.sim.terrain import from_spec


def test_bodies_stand_where_the_model_has_them():
    """In its stance the robot's lowest points are its feet, a stance height below the base."""
    shape = Shape(ANYMAL_B)
    qpos = np.zeros((2, 19))
    qpos[:, 2], qpos[:, 3], qpos[:, 7:] = ANYMAL_B.stance_height, 1.0, ANYMAL_B.stance_angles
    qpos[1, :2] = 5.0, -3.0
    position, rotation = shape.poses(qpos)
    assert position.shape == (len(shape.bodies), 2, 3)
    np.testing.assert_allclose(position[:, 1] - position[:, 0], np.tile([5.0, -3.0, 0.0], (13, 1)))
    np.testing.assert_allclose(np.linalg.norm(rotation, axis=2), 1.0)
    lowest = {}
    for index, body in enumerate(shape.bodies):
        w, x, y, z = rotation[index, 0]
        up = np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
        lowest[body.name] = float((body.mesh.vertices @ up).min() + position[index, 0, 2])
    feet = [height for name, height in lowest.items() if "shank" in name]
    assert feet == pytest.approx([0.0] * 4, abs=0.002)
    assert min(height for name, height in lowest.items() if "shank" not in name) > 0.1


def test_the_plane_goes_through_touches_that_lie_in_one():
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-0.4, 0.4, (4, 2)), np.zeros(4)])
    points[:, 2] = 0.3 * points[:, 0] - 0.2 * points[:, 1] + 0.1
    corners = plane_corners(points)
    expected = 0.3 * corners[:, 0] - 0.2 * corners[:, 1] + 0.1
    np.testing.assert_allclose(corners[:, 2], expected, atol=1e-9)


def test_touches_on_one_line_give_a_plane_that_is_not_tilted_across_it():
    points = np.array([[0.0, 0.0, 0.0], [0.2, 0.0, 0.1], [0.4, 0.0, 0.2], [0.6, 0.0, 0.3]])
    corners = plane_corners(points)
    np.testing.assert_allclose(corners[:, 2], corners[:, 0] / 2, atol=1e-9)


def test_the_drawn_ground_is_the_ground():
    ground = from_spec("flat@2,perlin:0.15@4", seed=1, length=1.0, width=3.0)
    mesh = ground_mesh(ground)
    np.testing.assert_allclose(mesh.vertices[:, 2], ground.height_at(mesh.vertices[:, :2]))
    assert mesh.extents[:2] == pytest.approx([6.0, 3.0])
    assert (mesh.face_normals[:, 2] > 0).all(), "it is seen from above"
    assert len(mesh.vertices) < 6.0 * 3.0 / 0.07**2


def test_colours_are_kept_as_linear_light():
    """Half of the light is 188 of 255 in sRGB (IEC 61966-2-1)."""
    kept = linear(np.array([[0, 188, 255]]))
    np.testing.assert_allclose(kept, [[0, 128, 255]], atol=3)
