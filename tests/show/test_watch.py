"""`gaitshift train --watch` and `gaitshift view FOLDER`: a training on the live page."""

import json
import shutil
import signal
import socket
import subprocess
import sys

import numpy as np
import pytest

import browsing
from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.show.viewer import Training
from waiting import PATIENCE, wait_until

CURVE = "iteration,stage,speed,survival,reward\n1,flat,0.1,0.5,2.0\n2,flat,0.3,0.75,4.0\n3,fl"
"""A progress.csv whose last row is cut, as in the moment of writing."""


def shipped(gait):
    return policy.load(gait).path


@pytest.fixture
def folder(tmp_path):
    """The folder of a training of a trot, as far as the page reads it."""
    (tmp_path / "config.json").write_text(json.dumps({"command": "gaitshift train trot"}))
    (tmp_path / "progress.csv").write_text(CURVE)
    shutil.copy(shipped("trot"), tmp_path / "policy.onnx")
    return tmp_path


def replace_policy(folder, gait):
    shutil.copy(shipped(gait), folder / "part")
    (folder / "part").replace(folder / "policy.onnx")


def test_the_curve_of_a_training_has_its_whole_rows(folder):
    curve = Training(folder).curve()
    np.testing.assert_array_equal(curve["iteration"], [1, 2])
    np.testing.assert_array_equal(curve["speed"], [0.1, 0.3])
    (folder / "progress.csv").unlink()
    assert all(len(values) == 0 for values in Training(folder).curve().values())


@pytest.mark.parametrize(
    "text", ["iteration,speed\n1,0.1\n", CURVE.replace("0.5", "often"), "a\n1\n"]
)
def test_another_table_in_the_place_of_the_curve_is_named(folder, text):
    (folder / "progress.csv").write_text(text)
    with pytest.raises(GaitshiftError, match=r"progress.csv.* is damaged"):
        Training(folder).curve()


def test_a_newer_policy_is_seen_once(folder, monkeypatch):
    monkeypatch.setattr("gaitshift.show.viewer.training.LOOK_EVERY", 0.0)
    training = Training(folder)
    assert training.look() is None
    replace_policy(folder, "bound")
    newer = training.look()
    assert newer is not None
    assert newer.gait == "bound"
    assert training.look() is None


def test_a_folder_that_goes_away_leaves_the_robot_walking(folder, monkeypatch):
    monkeypatch.setattr("gaitshift.show.viewer.training.LOOK_EVERY", 0.0)
    training = Training(folder)
    (folder / "policy.onnx").write_bytes(b"cut")
    assert training.look() is None
    shutil.rmtree(folder)
    assert training.look() is None
    assert training.policy.gait == "trot"


def test_robots_go_on_where_they_are_with_another_policy(folder):
    """The same weights in a new file change nothing."""
    one, other = Training(folder).live(), Training(folder).live()
    other.learn(policy.load(shipped("trot")))
    for _ in range(20):
        before, after = one.step(), other.step()
    np.testing.assert_array_equal(before.step.qpos, after.step.qpos)


@pytest.mark.parametrize(
    ("prepare", "message"),
    [
        (lambda folder: (folder / "config.json").unlink(), "is not a training run"),
        (lambda folder: (folder / "policy.onnx").unlink(), "has no policy.onnx yet"),
        (lambda folder: (folder / "config.json").write_text("{"), "config.json is damaged"),
        (lambda folder: (folder / "config.json").write_text("[]"), "config.json is damaged"),
        (lambda folder: (folder / "config.json").write_text('{"robot": 3}'), "is damaged"),
        (lambda folder: (folder / "policy.onnx").write_bytes(b"no"), "policy.onnx"),
    ],
)
def test_a_folder_without_a_training_is_one_line_and_code_2(folder, capsys, prepare, message):
    prepare(folder)
    with pytest.raises(SystemExit) as end:
        main(["view", str(folder)])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


def test_policy_files_are_refused_beside_a_training(folder, capsys):
    with pytest.raises(SystemExit):
        main(["view", str(folder), "--policy-files", str(shipped("trot"))])
    assert "no --policy-files" in capsys.readouterr().err


def test_a_damaged_policy_is_an_error_of_ours(folder):
    (folder / "policy.onnx").write_bytes(b"no")
    with pytest.raises(GaitshiftError):
        Training(folder)


# With a training ----------------------------------------------------------------------------------


def train(folder, port, *arguments):
    """A small training with a page, once the page can be opened."""
    command = [sys.executable, "-m", "gaitshift", "train", "trot", "--robots", "8", "--watch"]
    process = subprocess.Popen(
        [*command, "--threads", "1", "--out", str(folder), "--port", str(port), *arguments],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
    )
    assert any(f"127.0.0.1:{port}" in line for line in iter(process.stderr.readline, ""))
    return process


def is_served(port):
    with socket.socket() as trial:
        return trial.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture
def port():
    with socket.socket() as some:
        some.bind(("127.0.0.1", 0))
        return some.getsockname()[1]


@pytest.mark.slow
@browsing.needed
def test_the_page_shows_a_training_from_its_beginning_until_ctrl_c(tmp_path, browser, port):
    process = train(tmp_path / "run", port)
    try:
        page, wrong = browsing.opened(browser, f"http://127.0.0.1:{port}")
        seen = page.get_by_text("iteration")

        def learned():
            words = seen.first.inner_text().split()
            return int(words[-1])

        seen.first.wait_for()
        wait_until(lambda: learned() >= 2)
        browsing.wait_for_robot(page, "training", columns=2 / 3)
        assert not wrong
        process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 130
        wait_until(lambda: not is_served(port))
    finally:
        process.kill()
        process.communicate()
    assert (tmp_path / "run" / "policy.onnx").is_file()


@pytest.mark.slow
def test_the_page_ends_with_a_training_that_is_killed(tmp_path, port):
    process = train(tmp_path / "run", port)
    assert is_served(port)
    process.kill()
    process.communicate()
    wait_until(lambda: not is_served(port))


def test_a_taken_port_is_one_line_before_anything_is_written(tmp_path, capsys):
    pytest.importorskip("torch")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = str(taken.getsockname()[1])
        with pytest.raises(SystemExit) as end:
            main(["train", "trot", "--out", str(tmp_path / "run"), "--watch", "--port", port])
    assert end.value.code == 2
    assert f"cannot listen on 127.0.0.1:{port}" in capsys.readouterr().err.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []
