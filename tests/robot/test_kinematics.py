"""Where the feet are at given joint angles: against MuJoCo, for any robot."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.kinematics import LegKinematics
from gaitshift.robot.legs import LEGS
from gaitshift.robot.robot_file import read_robot

PONY = Path(__file__).parents[2] / "examples" / "robots" / "pony.toml"


@pytest.mark.parametrize("robot", [ANYMAL_B, read_robot(PONY)], ids=lambda robot: robot.name)
def test_feet_are_where_the_model_has_them(robot):
    """In the body's frame, wherever the body is, at angles unlike for every joint."""
    rng = np.random.default_rng(4)
    angles = rng.uniform(-2.5, 2.5, (3, 7, 12))
    feet = LegKinematics.of(robot).foot_centre_b(angles)
    model = robot.spec(robot.gains_of("default")).compile()
    data = mujoco.MjData(model)
    for index in np.ndindex(3, 7):
        quaternion = rng.normal(size=4)
        quaternion /= np.linalg.norm(quaternion)
        data.qpos[:] = [*rng.normal(size=3), *quaternion, *angles[index]]
        mujoco.mj_kinematics(model, data)
        body = data.body(int(model.jnt_bodyid[0]))
        for leg, name in enumerate(LEGS):
            expected = body.xmat.reshape(3, 3).T @ (data.site(f"{name}_foot").xpos - body.xpos)
            np.testing.assert_allclose(feet[(*index, leg)], expected, rtol=0, atol=1e-12)


def test_feet_in_the_stance_are_below_the_base_by_its_height():
    """The published height of the stance is that of the base over the lowest points of the feet."""
    feet = LegKinematics.of(ANYMAL_B).foot_centre_b(ANYMAL_B.stance_angles)
    below = ANYMAL_B.foot_radius - feet[:, 2]
    np.testing.assert_allclose(below, ANYMAL_B.stance_height, rtol=0, atol=1e-4)


def test_a_leg_that_slides_is_refused(tmp_path):
    text = ANYMAL_B.model_file.read_text()
    slides = text.replace('<joint name="BL_KFE"', '<joint type="slide" name="BL_KFE"')
    assert slides != text
    (tmp_path / "slides.xml").write_text(slides)
    with pytest.raises(GaitshiftError) as error:
        LegKinematics.of(replace(ANYMAL_B, model_file=tmp_path / "slides.xml"))
    assert "chain of three hinges" in str(error.value)
