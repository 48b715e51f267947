"""The command line as its users meet it: results on stdout, one clear line for a fault, codes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.gait import gaits
from gaitshift.lab.log import Log

TINY = ["--robots", "4", "--iterations", "2"]


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """The one line with which a command refuses."""
    with pytest.raises(SystemExit) as exit_:
        main(list(arguments))
    said = capsys.readouterr()
    assert exit_.value.code == 2
    assert said.out == ""
    lines = said.err.strip().splitlines()
    assert len(lines) == 1, said.err
    return lines[0]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["train", "trt"], "did you mean 'trot'"),
        (["train", "none.toml"], "none.toml"),
        (["train"], "gait must be one of"),
        (["train", "trot", "--robots", "-3"], "robots must be 1 to 65536, got -3"),
        (["train", "trot", "--iterations", "0"], "iterations must be 1 or more, got 0"),
        (["train", "trot", "--seed", "-1"], "seed must be 0 or larger, got -1"),
        (["train", "--resume", "nowhere"], "not a training run"),
        (["train", "trot", "--resume", "nowhere"], "must not be given with --resume"),
        (
            ["train", "--resume", "nowhere", "--iterations", "4"],
            "--iterations must not be given with --resume",
        ),
        (["train", "--resume", "nowhere", "--seed", "0"], "--seed must not be given with --resume"),
        (
            ["train", "trot", "--set", "ppo.epochs=3", "--set", "robots=4"],
            "--set must be given once, with all of its values after it, got 2 times",
        ),
        (["demo", "--seed=1", "--seed", "2"], "--seed must be given once"),
        (["evaluate", "canter"], "policy must be one of "),
        (["evaluate", "none.onnx"], "no policy file none.onnx"),
        (["evaluate", "trot", "--terrain", "lava"], "unknown terrain 'lava'"),
        (["evaluate", "trot", "--terrain", "perlin:-1"], "perlin:-1"),
        (["evaluate", "trot", "--episodes", "0"], "episodes must be 1 to 100000, got 0"),
        (
            ["evaluate", "trot", "--seconds", "nan"],
            "seconds must be above 0 and at most 3600, got nan",
        ),
        (["evaluate", "trot", "--push", "-5"], "push must be 0 to 1000 N, got -5.0"),
        (["evaluate", "trot", "--speed", "3.5"], "speed must be 0 to 3 m/s, got 3.5"),
        (["evaluate", "trot", "--stride-frequency", "0"], "stride_frequency must be above 0"),
        (["gaits", "canter"], "known gaits: bound, gallop, half_bound, pace, pronk"),
        (["demo", "--flat-gait", "canter"], "got 'canter'"),
        (["demo", "--track", "flat@2,perlin@2"], "perlin@2"),
        (
            ["demo", "--speeds", "0.3,1@4"],
            "speeds must be SPEED@SECONDS separated by commas, such as 0.3@8,1.5@4, got '0.3,1@4'",
        ),
        (
            ["demo", "--gaits", "trot,bound", "--at", "1,x"],
            "at must be numbers separated by commas, such as 2,5,8, got '1,x'",
        ),
        (
            ["demo", "--gaits", "trot,bound", "--at", "nan"],
            "at must give rising times above 0 and up to 3600 s, got [nan]",
        ),
        (["demo", "--gaits", "trot,bound", "--at", "1e400"], "up to 3600 s, got [inf]"),
        (["demo", "--alpha", "-1"], "alpha"),
        (["demo", "--rough-gait", "trot"], "must differ, got 'trot'"),
        (["bench", "--robots", "0"], "robots must be 1 to 65536"),
        (["train", "trot", "--robots", "many"], "--robots"),
        (["demo", "--episodes", "1.5"], "invalid literal for int() with base 10: '1.5'"),
        (["demo", "--speed", "3"], "--speed"),
        (
            ["evaluate", "trot", "--sensors", "good"],
            "unknown sensor preset 'good'; known sensor presets: perfect, anymal, cheap",
        ),
        (["evaluate", "trot", "--controller", "wheels"], "known controllers: policy, cpg"),
        (["evaluate", "gallop", "--controller", "cpg"], "gallop"),
        (
            ["evaluate", "trot", "--controller", "cpg", "--trials", "quick"],
            "--trials is for policies, got --controller cpg",
        ),
        (
            ["evaluate", "trot", "--controller", "cpg", "--robot-file", "dog.toml"],
            "dog.toml: no such file",
        ),
        (["demo", "--graph", "lava"], "unknown graph 'lava'"),
        (["demo", "--controller", "wheels"], "known controllers: policy, cpg"),
        (["evaluate"], "Missing"),
        (["evaluat"], "evaluat"),
    ],
)
def test_a_fault_of_the_user_is_one_line_that_says_what_would_be_right(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert says in refusal(capsys, *arguments)
    assert list(tmp_path.iterdir()) == []  # and nothing was left behind


def test_each_fault_of_a_machine_file_is_named_with_the_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text = (Path(gaits.__file__).parent / "trot.toml").read_text()
    for old, new, says in (
        ('down = ["FR", "BL"]', 'down = ["RF", "BL"]', "RF"),
        ('to = "FR_BL"', 'to = "elsewhere"', "elsewhere"),
        ("dwell = 20 ", "dwell = -20 ", "-20"),
        ("dwell = 20 ", "dwell = ] ", "line"),
    ):
        assert old in text
        path = tmp_path / "mine.toml"
        path.write_text(text.replace(old, new, 1))
        line = refusal(capsys, "train", str(path), "--out", str(tmp_path / "run"))
        assert "mine.toml" in line
        assert says in line
        assert not (tmp_path / "run").exists()


def test_a_truncated_policy_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = tmp_path / "trot.onnx"
    path.write_bytes(policy.load("trot").path.read_bytes()[:20_000])
    assert "trot.onnx is a truncated or damaged ONNX file" in refusal(capsys, "evaluate", str(path))


def test_an_output_folder_with_other_content_is_left_alone(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    mine = tmp_path / "thesis.tex"
    mine.write_text("years of work")
    out = str(tmp_path)
    for command in (["demo"], ["train", "trot", *TINY], ["gaits", "trot"]):
        assert "--overwrite" in refusal(capsys, *command, "--out", out)
    assert "not overwritten" in refusal(capsys, "train", "trot", *TINY, "--out", out, "--overwrite")
    assert "exists" in refusal(capsys, "evaluate", "trot", "--log", str(mine))
    assert mine.read_text() == "years of work"
    assert list(tmp_path.iterdir()) == [mine]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["train", "--resume", "file"], "file is not a training run"),
        (["train", "trot", *TINY, "--out", "file/x"], "file/x: Not a directory"),
        (["gaits", "--out", "file/x"], "file/x: Not a directory"),
        (["evaluate", "trot", "--log", "file/x.npz"], "file: File exists"),
        (
            ["evaluate", "trot", "--log", ".", "--overwrite"],
            "--log must be a file, got the folder .",
        ),
        (["reproduce", "--runs", "file/x"], "must be a folder, got the file file"),
    ],
)
def test_a_file_where_a_folder_should_be_is_one_line_before_any_work(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch
) -> None:
    def work(*_: object, **__: object) -> None:
        raise AssertionError("there was work")

    monkeypatch.setattr("gaitshift.cli.evaluate.evaluate", work)
    monkeypatch.setattr("gaitshift.learn.run.Run.__init__", work)
    monkeypatch.chdir(tmp_path)
    Path("file").write_text("years of work")
    assert says in refusal(capsys, *arguments)
    assert Path("file").read_text() == "years of work"
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_a_full_disk_is_one_line_with_the_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch
) -> None:
    def full(self: Log, path: Path) -> None:
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Log, "save", full)
    path = tmp_path / "walk.npz"
    with pytest.raises(SystemExit) as exit_:
        main(["evaluate", "trot", "--episodes", "1", "--seconds", "0.1", "--log", str(path)])
    assert exit_.value.code == 2
    assert capsys.readouterr().err.strip() == f"gaitshift: {path}: No space left on device"


@pytest.mark.parametrize("unbuffered", ["", "1"])
@pytest.mark.parametrize("arguments", [["gaits", "--json"], ["--help"]])
def test_a_reader_that_has_seen_enough_is_no_fault(arguments: list[str], unbuffered: str) -> None:
    """Its end of the pipe is closed before anything is written."""
    command = [sys.executable, "-m", "gaitshift", *arguments]
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment, text=True
    ) as process:
        assert process.stdout
        assert process.stderr
        process.stdout.close()
        said = process.stderr.read()
    assert (process.returncode, said) == (0, "")


def test_a_pipe_that_breaks_elsewhere_is_told(tmp_path: Path) -> None:
    program = """
from gaitshift.cli import main
from gaitshift.cli.gaits import Gaits
def broken(self):
    raise BrokenPipeError(32, "Broken pipe")
Gaits.run = broken
main(["gaits"])
"""
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr.strip()) == (2, "gaitshift: Broken pipe")


def test_json_is_one_object_and_nothing_else_on_stdout(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    main(["gaits", "--json"])
    assert set(json.loads(capsys.readouterr().out)) == set(gaits.names())
    log = tmp_path / "run.npz"
    arguments = ["--episodes", "4", "--seconds", "0.5", "--json", "--log", str(log)]
    main(["evaluate", "trot", *arguments])
    figures = json.loads(capsys.readouterr().out)
    assert figures["gait"] == "trot"
    assert figures["survival"] == 1.0
    assert Log.load(log).sensed.joint_position.shape == (50, 4, 12)


def test_oscillators_are_evaluated_as_policies_are(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """They trot on flat ground at their own stride frequency, 2.2 Hz, and have no critic."""
    log = tmp_path / "run.npz"
    arguments = ["--controller", "cpg", "--episodes", "2", "--seconds", "4", "--log", str(log)]
    main(["evaluate", "trot", *arguments, "--json"])
    figures = json.loads(capsys.readouterr().out)
    assert (figures["controller"], figures["gait"]) == ("cpg", "trot")
    assert figures["survival"] == 1.0
    assert figures["cycles_per_s"] == pytest.approx(2.2, abs=0.2)
    walked = Log.load(log)
    assert walked.gaits == ("trot",)
    assert walked.sensed.value is None
    np.testing.assert_allclose(walked.sensed.stride_frequency_command, 2.2)


def test_gaits_are_listed_drawn_and_printed_as_mermaid(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    main(["gaits"])
    listed = capsys.readouterr().out
    assert all(name in listed for name in gaits.names())
    main(["gaits", "trot", "--out", str(tmp_path)])
    assert capsys.readouterr().out.startswith("stateDiagram-v2")
    assert (tmp_path / "trot.png").stat().st_size > 5_000


def test_the_demo_writes_what_it_says(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "demo"
    main(["demo", "--track", "flat@2,flat@2", "--no-video", "--out", str(out)])
    printed = capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {
        "index.html",
        "demo.png",
        "log.npz",
        "summary.json",
    }
    assert str(out) in printed
    summary = json.loads((out / "summary.json").read_text())
    assert summary["survived"] is True
    assert summary["switches"] == []
    assert 2.0 < summary["distance_m"] < 3.0
    log = Log.load(out / "log.npz")
    assert log.gaits == ("trot", "bound")
    assert np.all(np.diff(log.time) > 0)


def test_a_trained_run_can_be_evaluated(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    out = tmp_path / "run"
    main(["train", "trot", *TINY, "--out", str(out), "--json"])
    row = json.loads(capsys.readouterr().out)
    assert row["iteration"] == 2
    names = {path.name for path in out.iterdir()}
    assert {"config.json", "progress.csv", "checkpoints", "policy.onnx", "tensorboard"} <= names
    assert row["verdict"]["gait"] == "stand"
    assert row["verdict"]["clean"] is False
    assert (out / "verdicts.csv").read_text().splitlines()[-1].startswith("2,stand,False,")
    main(["train", "--resume", str(out), "--json"])
    assert json.loads(capsys.readouterr().out) == row, "a run that is over tells the same again"
    main(["evaluate", row["policy"], "--episodes", "2", "--seconds", "0.2", "--json"])
    assert json.loads(capsys.readouterr().out)["episodes"] == 2


INTERRUPTED = """
import os, signal, sys
from gaitshift.cli import main
from gaitshift.learn.run import Run
iterate = Run.iterate
def interrupted(self):
    row = iterate(self)
    if row["iteration"] == 3:
        os.kill(os.getpid(), getattr(signal, sys.argv[1]))
    return row
Run.iterate = interrupted
main(sys.argv[2:])
"""
"""A training that gets a signal after iteration 3, on however slow a machine."""


@pytest.mark.slow
@pytest.mark.parametrize(("name", "code"), [("SIGINT", 130), ("SIGTERM", 143)])
def test_a_signal_leaves_a_run_that_goes_on(name: str, code: int, tmp_path: Path) -> None:
    """Stopped in a training: the signal's exit code, no traceback, and --resume ends it."""
    out = tmp_path / "run"
    size = ["--robots", "8", "--iterations", "5", "--threads", "1"]
    arguments = ["train", "trot", *size, "--out", str(out)]
    done = subprocess.run(
        [sys.executable, "-c", INTERRUPTED, name, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == code
    assert "Traceback" not in done.stderr
    assert f"--resume {out}" in done.stderr
    assert policy.load(out / "policy.onnx").gait == "trot"
    main(["train", "--resume", str(out)])
    rows = (out / "progress.csv").read_text().splitlines()
    assert [int(row.split(",")[0]) for row in rows[1:]] == list(range(1, 6))
