"""A robot on a ground, as one MuJoCo model."""

import mujoco

from gaitshift.robot.description import Gains, Robot
from gaitshift.sim.terrain import Terrain, to_unit_interval

GROUND = "ground"
"""Name of the ground's geom."""

FRICTION = 0.8
"""Sliding friction of the ground, as in the robot's URDF; the robot's own shapes have priority."""


def build_model(robot: Robot, gains: Gains, terrain: Terrain) -> mujoco.MjModel:
    """The model of one robot on one terrain.

    Level ground is a plane, which is faster and has no border; everything else a height field.
    """
    spec = robot.spec(gains)
    ground = spec.worldbody.add_geom(name=GROUND, contype=1, conaffinity=0)
    ground.friction[0] = FRICTION
    if terrain.is_flat:
        ground.type = mujoco.mjtGeom.mjGEOM_PLANE
        ground.pos[2] = float(terrain.height[0, 0])
        ground.size[:] = (0.0, 0.0, 1.0)
    else:
        field = to_unit_interval(terrain)
        rows, cols = field.data.shape
        spec.add_hfield(
            name=GROUND, nrow=rows, ncol=cols, size=field.size, userdata=field.data.ravel().tolist()
        )
        ground.type = mujoco.mjtGeom.mjGEOM_HFIELD
        ground.hfieldname = GROUND
        ground.pos[:] = field.position
    return spec.compile()
