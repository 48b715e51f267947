"""`gaitshift record` keeps a log that is what was asked for, and refuses one that is not."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaitshift.control.policies
from gaitshift.cli import main
from gaitshift.control.cpg import GAITS
from gaitshift.lab.log import Log

TROT = Path(gaitshift.control.policies.__path__[0]) / "trot.onnx"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """A folder with a log of two robots for 0.3 s."""
    folder = tmp_path_factory.mktemp("record") / "logs"
    main(ask(folder, 2, 0.3))
    return folder


def ask(folder, robots, seconds, *more, courses=("flat",)):
    numbers = ["--robots", str(robots), "--seconds", str(seconds)]
    return ["record", "trot", *more, "--out", str(folder), "--courses", *courses, *numbers]


def refused(capsys, command):
    with pytest.raises(SystemExit) as end:
        main(command)
    assert end.value.code == 2
    return capsys.readouterr().err.splitlines()[-1]


@pytest.mark.parametrize(("robots", "seconds"), [(3, 0.3), (2, 0.4), (2, 0.2)])
def test_a_kept_log_of_other_size_is_refused_before_anything_is_recorded(
    recorded, tmp_path, capsys, robots, seconds
):
    logs = shutil.copytree(recorded, tmp_path / "logs")
    line = refused(capsys, ask(logs, robots, seconds, courses=("up-10", "flat")))
    assert f"{logs / 'trot-flat-0.npz'} has 2 robots × 0.3 s" in line
    assert f"got {robots} × {seconds:g} s" in line
    assert "--overwrite" in line
    assert [path.name for path in logs.iterdir()] == ["trot-flat-0.npz"]
    main([*ask(logs, robots, seconds), "--overwrite"])
    assert Log.load(logs / "trot-flat-0.npz").fallen.shape == (round(100 * seconds), robots)


def test_a_log_by_other_sensors_has_a_name_of_its_own(recorded, tmp_path, capsys):
    logs = shutil.copytree(recorded, tmp_path / "logs")
    (logs / "trot-flat-0.npz").rename(logs / "trot-flat-0-cheap.npz")
    main([*ask(logs, 2, 0.3), "--sensors", "cheap"])
    assert "trot-flat-0-cheap.npz exists, not repeated" in capsys.readouterr().err
    main(ask(logs, 2, 0.3))
    assert (logs / "trot-flat-0.npz").exists()


def test_a_log_that_ended_as_all_robots_had_fallen_is_kept(recorded, tmp_path, capsys):
    path = shutil.copytree(recorded, tmp_path / "logs") / "trot-flat-0.npz"
    log = Log.load(path)
    fallen = np.zeros_like(log.fallen)
    fallen[-1] = True
    replace(log, fallen=fallen).save(path)
    before = path.read_bytes()
    main(ask(path.parent, 2, 8))
    assert "exists, not repeated" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_oscillators_are_recorded_at_the_speed_and_stride_of_their_own_gait(tmp_path):
    gait = GAITS["walk"]
    numbers = ["--robots", "2", "--seconds", "0.3", "--courses", "flat"]
    main(["record", "walk", "--controller", "cpg", "--out", str(tmp_path / "logs"), *numbers])
    log = Log.load(tmp_path / "logs" / "walk-flat-0.npz")
    assert (log.gaits, log.k.shape) == (("walk",), (30, 2))
    np.testing.assert_allclose(log.sensed.forward_speed_command, gait.speed)
    np.testing.assert_allclose(log.sensed.stride_frequency_command, gait.frequency)
    assert log.sensed.value is None, "oscillators have no critic"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["trot", "--controller", "wheels"], "unknown controller 'wheels'"),
        (["gallop", "--controller", "cpg"], "gallop"),
    ],
)
def test_a_controller_that_cannot_be_had_is_refused(tmp_path, capsys, arguments, message):
    line = refused(capsys, ["record", *arguments, "--out", str(tmp_path / "logs")])
    assert message in line
    assert not (tmp_path / "logs").exists()


def test_two_policies_of_one_gait_are_refused(tmp_path, capsys):
    mine = shutil.copy(TROT, tmp_path / "mine.onnx")
    line = refused(capsys, ask(tmp_path / "logs", 2, 0.3, str(mine)))
    assert "got two of 'trot'" in line
    assert "--out" in line
    assert not (tmp_path / "logs").exists()


def test_a_length_that_is_none_is_refused_before_anything_is_recorded(tmp_path, capsys):
    assert "above 0 and at most 3600" in refused(capsys, ask(tmp_path / "logs", 2, "nan"))
    assert not (tmp_path / "logs").exists()
