"""A terrain as a body of PyBullet: a plane, or a height field cut along the same diagonals."""

from typing import Any

from gaitshift.sim.terrain import Terrain


def add_ground(bullet: Any, client: int, terrain: Terrain) -> None:
    """Adds the terrain to a client, with a friction of 1.

    PyBullet multiplies the frictions of two bodies, so that 1 leaves the robot's.
    """
    make = _plane if terrain.is_flat else _field
    shape, position, turn = make(bullet, client, terrain)
    body = bullet.createMultiBody(
        0.0, shape, basePosition=position, baseOrientation=turn, physicsClientId=client
    )
    bullet.changeDynamics(body, -1, lateralFriction=1.0, physicsClientId=client)


Placed = tuple[int, tuple[float, float, float], tuple[float, float, float, float]]
"""A shape, its position [m] and its attitude (x, y, z, w)."""


def _plane(bullet: Any, client: int, terrain: Terrain) -> Placed:
    shape = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
    return shape, (0.0, 0.0, float(terrain.height[0, 0])), (0.0, 0.0, 0.0, 1.0)


def _field(bullet: Any, client: int, terrain: Terrain) -> Placed:
    """PyBullet cuts cells along the other diagonal, so the field is given turned by 90°.

    Its first axis then lies along world y, its second against world x. It places the middle of its
    box, in height too, at the position.
    """
    dx, dy = terrain.cell
    rows, cols = terrain.height.shape
    (x0, x1, y0, y1), height = terrain.extent, terrain.height
    shape = bullet.createCollisionShape(
        bullet.GEOM_HEIGHTFIELD,
        meshScale=[dy, dx, 1.0],
        heightfieldData=height[:, ::-1].T.ravel().tolist(),
        numHeightfieldRows=rows,
        numHeightfieldColumns=cols,
        physicsClientId=client,
    )
    middle = float(height.min() + height.max()) / 2
    quarter = 0.5**0.5
    return shape, ((x0 + x1) / 2, (y0 + y1) / 2, middle), (0.0, 0.0, quarter, quarter)
