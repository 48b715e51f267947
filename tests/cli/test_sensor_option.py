"""`--sensors`: every command that runs robots gives them the sensors of the preset and its seed."""

from importlib import import_module

import pytest

from gaitshift.cli import main
from gaitshift.lab.studies.crossing import COLUMNS
from gaitshift.sim.sensor_config import CHEAP
from gaitshift.table import write


class Built(Exception):  # noqa: N818, it is what the test waits for
    """A world was about to be built."""


@pytest.mark.parametrize(
    ("command", "module"),
    [
        ("demo --out out", "sim.world"),
        ("view", "show.viewer.live"),
        ("evaluate trot", "sim.world"),
        ("evaluate trot --trials quick", "sim.world"),
        ("evaluate trot --commands", "sim.world"),
        ("evaluate trot --controller cpg", "sim.world"),
        ("record trot --out out", "sim.world"),
        ("transitions --out out", "lab.studies.transitions"),
        ("study --out out", "lab.studies.crossing"),
    ],
)
def test_the_preset_and_the_seed_reach_the_world(command, module, tmp_path, monkeypatch):
    """Studies run in batches, each with a seed of its own, 1000 times the seed at first."""
    built = []

    def build(*arguments, sensors, seed, **others):
        built.append((sensors, seed))
        raise Built

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(import_module(f"gaitshift.{module}"), "World", build)
    with pytest.raises(Built):
        main([*command.split(), "--sensors", "cheap", "--seed", "3"])
    assert built == [(CHEAP, 3000 if "studies" in module else 3)]


def test_rows_by_other_sensors_are_not_added_to_a_table(tmp_path, capsys):
    row = dict.fromkeys(COLUMNS, 1.0) | {"way": "x", "sensors": "perfect", "seed": 0, "runs": 512}
    row |= {name: 1 for name, kind in COLUMNS.items() if kind is int} | {"seed": 0, "runs": 512}
    write(tmp_path / "crossings.csv", [row], COLUMNS)
    with pytest.raises(SystemExit) as end:
        main(["study", "--out", str(tmp_path), "--sensors", "anymal"])
    assert end.value.code == 2
    assert "sensors must be perfect" in capsys.readouterr().err.splitlines()[-1]
