"""The MuJoCo model of one robot on one terrain, and how finely its contacts are simulated."""

from typing import Literal

import mujoco

from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import Gains, Robot
from gaitshift.sim.simulator import FRICTION
from gaitshift.sim.terrain import Terrain, to_unit_interval

GROUND = "ground"
"""Name of the ground's geom."""

Fidelity = Literal["exact", "coarse"]
"""How finely contacts are simulated: by step, friction cones and tolerance of the robot's model, or
coarsely, in little more than half the time. A foot then sinks twice as deep and may touch twice, so
nothing is judged by it."""

FIDELITIES: tuple[Fidelity, ...] = ("exact", "coarse")

COARSE_STEP = CONTROL_PERIOD / 3
"""Time step of coarse physics [s]; ours: with steps of 5 ms feet touch twice, so that a bound that
is learned there is not clean."""

COARSE_TOLERANCE = 1e-4
"""Relative tolerance of the solver in coarse physics; ours."""


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
        spec.option.tolerance = COARSE_TOLERANCE
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
