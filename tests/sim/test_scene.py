"""The scene that MuJoCo simulates."""

import mujoco
import numpy as np

from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.terrain import step
from gaitshift.sim.world.world import build_model


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
