"""The MuJoCo model of one robot on one terrain, and how finely its contacts are simulated."""

from typing import Literal, cast

import mujoco

from gaitshift.robot.description import Gains, Robot
from gaitshift.sim.terrain import Terrain, to_unit_interval

GROUND = "ground"
"""Name of the ground's geom."""

FRICTION = 0.8
"""Sliding friction of the ground, as in the robot's URDF; the robot's own shapes have priority."""

Fidelity = Literal["exact", "coarse"]
"""How finely contacts are simulated: by the step, the friction cones and the slip correction of the
robot's model, or coarsely, in less than half the time. Standing feet then creep by millimetres a
second, so nothing is judged by it."""

FIDELITIES: tuple[Fidelity, ...] = ("exact", "coarse")

COARSE_STEP = 0.005
"""Time step of coarse physics [s]; ours: two make a control step."""

COARSE_IMPEDANCE = (0.98, 0.99, 0.001)
"""First values of solimp in coarse physics; ours: with MuJoCo's own, 0.9 to 0.95, feet creep
three times as fast."""


def build_model(
    robot: Robot, gains: Gains, terrain: Terrain, fidelity: Fidelity = "exact"
) -> mujoco.MjModel:
    """The model of one robot on one terrain, without the shapes that are only drawn.

    Level ground is a plane, which is faster and has no border; everything else a height field.
    """
    spec = robot.spec(gains)
    spec.compiler.discardvisual = True
    if fidelity == "coarse":
        spec.option.timestep = COARSE_STEP
        spec.option.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL
        spec.option.noslip_iterations = 0
        for geom in cast("list[mujoco.MjsGeom]", spec.geoms):
            geom.solimp[:3] = COARSE_IMPEDANCE
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
