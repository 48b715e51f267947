"""The scene that MuJoCo simulates."""

import mujoco
import numpy as np
import pytest

from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.simulator import FRICTION
from gaitshift.sim.terrain import step
from gaitshift.sim.world import World
from gaitshift.sim.world.model import build_model
from worlds import GRAVITY, LEVEL, MASS, STANCE, stand, wild_targets


def test_a_robot_that_lies_on_an_edge_has_memory_for_all_of_its_contacts():
    edge = step(0.1, length=4.0, width=4.0).moved(-2.0, 0.0)
    model = build_model(ANYMAL_B, ANYMAL_B.gains_of("default"), edge)
    data, rng, most = mujoco.MjData(model), np.random.default_rng(0), 0
    full = [mujoco.mjtWarning.mjWARN_CONTACTFULL, mujoco.mjtWarning.mjWARN_CNSTRFULL]
    for _ in range(100):
        mujoco.mj_resetData(model, data)
        data.qpos[:3] = rng.uniform((-0.3, 0.0, -0.05), (0.3, 0.0, 0.15))
        data.qpos[3:] = rng.normal(0.0, 0.7, model.nq - 3)
        mujoco.mj_forward(model, data)
        most = max(most, data.ncon)
        assert all(data.warning[int(kind)].number == 0 for kind in full)
    assert most > 450, "431 were seen when memory ran out"


def whole_model():
    """The model with all its shapes, on level ground."""
    spec = ANYMAL_B.spec(ANYMAL_B.gains_of("default"))
    ground = spec.worldbody.add_geom(
        type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0), contype=1, conaffinity=0
    )
    ground.friction[0] = FRICTION
    return spec.compile()


def test_shapes_that_are_only_drawn_are_left_out_and_the_motion_is_the_same_to_the_bit():
    whole, lean = whole_model(), build_model(ANYMAL_B, ANYMAL_B.gains_of("default"), LEVEL)
    assert lean.ngeom < whole.ngeom / 4
    targets, places = wild_targets(1, 100), []
    for model in (whole, lean):
        data = mujoco.MjData(model)
        data.qpos[:] = (0.0, 0.0, ANYMAL_B.stance_height, 1.0, 0.0, 0.0, 0.0, *STANCE)
        for target in targets[:, 0]:
            data.ctrl[:] = target
            mujoco.mj_step(model, data, nstep=4)
        places.append(data.qpos.copy())
    np.testing.assert_array_equal(*places)


def test_coarse_physics_stands_as_exact_physics_does():
    """Three steps in place of four; the robot's weight on its feet, the stance a little lower."""
    worlds = [World(ANYMAL_B, LEVEL, 1, fidelity=of) for of in ("exact", "coarse")]
    exact, coarse = (stand(world, 200)[1] for world in worlds)
    assert [world.model.opt.timestep for world in worlds] == [0.0025, pytest.approx(0.01 / 3)]
    assert coarse.foot_force.sum() == pytest.approx(MASS * GRAVITY, rel=0.02)
    np.testing.assert_allclose(coarse.base_position_w, exact.base_position_w, atol=0.01)
