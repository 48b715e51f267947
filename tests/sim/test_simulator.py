"""Simulators by name, and what a user reads who lacks one."""

from dataclasses import replace

import pytest

from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.bullet import BulletWorld
from gaitshift.sim.simulator import Simulator, simulator_maker
from test_floors import run_without
from worlds import LEVEL


def test_mujoco_is_a_simulator():
    assert isinstance(simulator_maker("mujoco")(ANYMAL_B, LEVEL, 1), Simulator)


def test_an_unknown_simulator_is_refused_with_those_that_there_are():
    with pytest.raises(GaitshiftError, match="mujoco, pybullet"):
        simulator_maker("raisim")


def test_a_robot_without_a_public_urdf_is_refused():
    with pytest.raises(GaitshiftError, match="anymal_b") as error:
        BulletWorld(replace(ANYMAL_B, name="spot"), LEVEL, 1)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("wheel", ["example-robot-data", "no-such-wheel"])
def test_without_the_extra_one_line_names_it(wheel):
    """Without PyBullet, and without the wheel of the URDF as well."""
    program = f"""
from gaitshift.cli import main
from gaitshift.robot import urdf
urdf.WHEEL = {wheel!r}
main(["evaluate", "trot", "--simulator", "pybullet", "--episodes", "1", "--seconds", "0.1"])
"""
    done = run_without(("pybullet",), program)
    assert done.returncode == 2, done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
    assert "gaitshift[sim2sim]" in done.stderr
    assert not done.stdout
