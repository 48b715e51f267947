"""A robot on a ground, as one MuJoCo model."""

import mujoco

from gaitshift.robot import Gains, Robot
from gaitshift.terrain import Terrain, to_unit_interval

GROUND = "ground"
"""Name of the ground's geom."""


def build_model(robot: Robot, gains: Gains, terrain: Terrain) -> mujoco.MjModel:
    """The model of one robot on one terrain.

    Level ground is a plane, which is faster and has no border; everything else a height field.
    """
    spec = robot.spec(gains)
    ground = {"name": GROUND, "contype": 1, "conaffinity": 0, "friction": [0.8, 0.005, 0.0001]}
    if terrain.is_flat:
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            pos=[0.0, 0.0, float(terrain.height[0, 0])],
            size=[0.0, 0.0, 1.0],
            **ground,
        )
    else:
        field = to_unit_interval(terrain)
        rows, cols = field.data.shape
        spec.add_hfield(
            name=GROUND, nrow=rows, ncol=cols, size=field.size, userdata=field.data.ravel()
        )
        spec.worldbody.add_geom(
            type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname=GROUND, pos=field.position, **ground
        )
    return spec.compile()
