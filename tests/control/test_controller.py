"""Controllers by name: those there are, and one that is registered in a line."""

import json

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.control import CONTROLLERS, Controller, Driver
from gaitshift.control.controller import controller_maker
from gaitshift.control.cpg import CpgController
from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log


class Statue(CpgController):
    """Stands in the stance, whatever it is asked to do."""

    def act(self, sensed, command):
        return np.tile(self.robot.stance_angles, (self.n, 1))


@pytest.mark.parametrize(("name", "kind"), [("policy", Driver), ("cpg", CpgController)])
def test_each_name_makes_controllers_that_begin_in_the_first_gait(name, kind):
    made = controller_maker(name)(["bound", "trot", "bound"], 3)
    assert isinstance(made, kind)
    assert isinstance(made, Controller)
    assert made.n == 3
    assert made.repertoire.gaits == ("bound", "trot")
    assert made.gait.tolist() == [0, 0, 0]


def test_an_unknown_controller_is_refused_with_those_there_are():
    with pytest.raises(GaitshiftError, match="unknown controller 'pgc'") as caught:
        controller_maker("pgc")
    assert all(name in str(caught.value) for name in CONTROLLERS)


def test_a_controller_that_is_registered_is_known_by_its_name(monkeypatch, capsys, tmp_path):
    """One line in CONTROLLERS, and commands walk robots by it."""
    monkeypatch.setitem(CONTROLLERS, "statue", f"{__name__}:Statue")
    made = controller_maker("statue")(["trot"], 2)
    assert isinstance(made, Statue)
    asked = ["trot", "--controller", "statue", "--episodes", "2", "--seconds", "1", "--json"]
    main(["evaluate", *asked, "--log", str(tmp_path / "log.npz")])
    figures = json.loads(capsys.readouterr().out)
    assert (figures["controller"], figures["gait"]) == ("statue", "trot")
    assert figures["survival"] == 1.0
    way = np.ptp(Log.load(tmp_path / "log.npz").truth.base_position_w, axis=0)
    assert way.max() < 0.2, "it stands"
