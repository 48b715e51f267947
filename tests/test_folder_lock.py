"""Two processes and one folder: the second is refused, until the first has ended."""

import csv
import os
import signal
import subprocess
import sys
from contextlib import contextmanager

import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.folder_lock import LOCK, only_writer
from waiting import PATIENCE, wait_until

HOLD = """
import sys
from pathlib import Path
from gaitshift.folder_lock import only_writer
with only_writer(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


@contextmanager
def written_by_another(folder):
    """Another process that writes into the folder, until its input ends."""
    with subprocess.Popen(
        [sys.executable, "-c", HOLD, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.communicate(timeout=PATIENCE)


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != LOCK}


def test_a_second_writer_is_refused_and_told_of_the_first(tmp_path):
    with written_by_another(tmp_path) as first:
        with pytest.raises(GaitshiftError) as caught, only_writer(tmp_path):
            pass
        line = str(caught.value)
        assert str(tmp_path) in line
        assert f"process {first.pid} since 20" in line
        assert "\n" not in line
    with only_writer(tmp_path):
        pass
    assert not list(tmp_path.iterdir()), "of writers that ended nothing is left"


def test_the_folder_of_a_killed_writer_is_taken_over(tmp_path):
    with written_by_another(tmp_path) as first:
        first.kill()
    assert first.returncode == -signal.SIGKILL
    assert str(first.pid) in (tmp_path / LOCK).read_text()
    with only_writer(tmp_path):
        assert f"process {os.getpid()} " in (tmp_path / LOCK).read_text()
    assert not list(tmp_path.iterdir())


def test_other_folders_are_free(tmp_path):
    with written_by_another(tmp_path / "a"), only_writer(tmp_path / "b"):
        assert (tmp_path / "a" / LOCK).is_file()


@pytest.mark.parametrize("stale", [b"", b"process 1 since 2026-01-01 00:00:00", b"\xff\x00junk"])
def test_what_stands_in_a_lock_file_that_nobody_holds_does_not_matter(tmp_path, stale):
    (tmp_path / LOCK).write_bytes(stale)
    with only_writer(tmp_path):
        pass


def test_folders_that_nothing_was_written_to_go_with_the_lock(tmp_path):
    with only_writer(tmp_path / "a" / "b"):
        pass
    assert not list(tmp_path.iterdir())
    with only_writer(tmp_path / "a" / "b"):
        (tmp_path / "a" / "b" / "page.md").touch()
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["page.md"]


def test_a_file_in_the_place_of_the_folder_is_refused(tmp_path):
    (tmp_path / "file").touch()
    with (
        pytest.raises(GaitshiftError, match="must be a folder, got a file"),
        only_writer(tmp_path / "file"),
    ):
        pass


def test_without_flock_the_second_is_refused_and_a_killed_one_replaced(tmp_path):
    """Some network file systems have no flock; there the file itself is the lock."""
    without = "import fcntl, errno\ndef missing(*_): raise OSError(errno.ENOSYS, 'no flock')\n"
    without += "fcntl.flock = missing\n"
    command = [sys.executable, "-c", without + HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as first:
        assert first.stdout is not None
        assert first.stdout.readline() == b"held\n"
        second = subprocess.run(
            command, input="", capture_output=True, text=True, timeout=PATIENCE, check=False
        )
        assert "is being written by another process" in second.stderr.splitlines()[-1]
        first.kill()
    third = subprocess.run(
        command, input="", capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert third.stdout == "held\n", third.stderr
    assert not list(tmp_path.iterdir())


# The commands -------------------------------------------------------------------------------------

TRAIN = ["--robots", "4", "--iterations", "3"]


@pytest.mark.parametrize(
    "command",
    [
        ["train", "trot", *TRAIN, "--out", "{}"],
        ["train", "trot", *TRAIN, "--out", "{}", "--overwrite"],
        ["train", "--resume", "{}"],
        ["report", "{}", "--overwrite"],
        ["demo", "--out", "{}", "--overwrite"],
        ["record", "trot", "--out", "{}"],
        ["transitions", "trot", "bound", "--out", "{}", "--overwrite"],
        ["study", "--out", "{}", "--overwrite"],
        ["map", "trot", "--out", "{}", "--overwrite"],
        ["reproduce", "--quick", "--out", "{}", "--runs", "{}/runs"],
        ["reproduce", "--quick", "--runs", "{}", "--out", "{}/out"],
        ["bench", "time-to-gait", "--out", "{}", "--overwrite"],
    ],
    ids=" ".join,
)
def test_a_command_leaves_a_folder_alone_that_another_one_writes(tmp_path, capsys, command):
    folder = tmp_path / "results"
    with written_by_another(folder):
        (folder / "config.json").write_text("{}")
        (folder / "page.md").write_text("half")
        before = contents(folder)
        with pytest.raises(SystemExit) as end:
            main([argument.format(folder) for argument in command])
        assert end.value.code == 2
        (line,) = capsys.readouterr().err.splitlines()
        assert f"{folder} is being written by process " in line
        assert contents(folder) == before


def test_resuming_a_run_that_is_still_trained_is_refused_and_no_row_is_doubled(tmp_path, capsys):
    """Both would append to the same table: of 91 rows 36 were doubled."""
    folder = tmp_path / "run"
    command = ["train", "trot", "--robots", "4", "--out", str(folder)]
    with subprocess.Popen(
        [sys.executable, "-m", "gaitshift", *command], stderr=subprocess.PIPE, text=True
    ) as first:
        wait_until(lambda: (folder / "progress.csv").is_file(), pause=0.02)
        with pytest.raises(SystemExit) as end:
            main(["train", "--resume", str(folder)])
        assert end.value.code == 2
        assert f"process {first.pid} " in capsys.readouterr().err
        first.send_signal(signal.SIGINT)
        said = first.communicate(timeout=PATIENCE)[1]
    assert first.returncode == 130
    assert f"--resume {folder}" in said
    with (folder / "progress.csv").open(newline="") as file:
        iterations = [int(row["iteration"]) for row in csv.DictReader(file)]
    assert iterations == list(range(1, len(iterations) + 1))
    assert not (folder / LOCK).exists()
