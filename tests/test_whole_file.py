"""What a full disk and a kill leave of a file: the file before, whole."""

import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from matplotlib.figure import Figure

from full_disk import LIMIT, full_disk
from gaitshift import table
from gaitshift.gait import draw, gaits
from gaitshift.show.plots.style import save
from gaitshift.show.report.page import write_page
from gaitshift.whole_file import replacing, write_text
from waiting import PATIENCE


def draw_figure(path):
    figure = Figure()
    figure.add_subplot().plot([0, 1], [0, 1])
    save(figure, path)


def write_arrays(path):
    with replacing(path) as part, part.open("wb") as file:
        np.savez(file, a=np.arange(100))


WRITERS = {
    "page.md": lambda path: write_text(path, "word " * LIMIT),
    "table.csv": lambda path: table.write(path, [{"a": i} for i in range(LIMIT)]),
    "figure.png": draw_figure,
    "figure.svg": draw_figure,
    "figure.pdf": draw_figure,
    "machine.png": lambda path: draw(gaits.load("trot"), path),
    "page.html": lambda path: write_page(path, title="a", summary="b", sections=[]),
    "arrays.npz": write_arrays,
}


@pytest.mark.parametrize("name", WRITERS)
def test_a_full_disk_leaves_the_file_before_and_nothing_else(name, tmp_path):
    path = tmp_path / name
    path.write_bytes(b"before")
    with full_disk(), pytest.raises(OSError, match="File too large"):
        WRITERS[name](path)
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]
    WRITERS[name](path)
    assert path.stat().st_size > LIMIT
    assert list(tmp_path.iterdir()) == [path]


def test_a_kill_while_a_file_is_written_leaves_the_file_before(tmp_path):
    path = tmp_path / "page.md"
    path.write_text("before")
    program = (
        "import os, pathlib, signal\n"
        "from gaitshift.whole_file import replacing\n"
        f"with replacing(pathlib.Path({str(path)!r})) as part:\n"
        "    part.write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    ended = subprocess.run([sys.executable, "-c", program], timeout=PATIENCE, check=False)
    assert ended.returncode == -signal.SIGKILL
    assert path.read_text() == "before"
    write_text(path, "after")
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path], "the part file of the killed process is used again"


def test_a_file_has_the_permissions_of_any_new_file(tmp_path):
    (tmp_path / "plain").touch()
    write_text(tmp_path / "page.md", "words")
    modes = {os.stat(path).st_mode for path in tmp_path.iterdir()}
    assert len(modes) == 1


def test_a_text_is_in_utf_8(tmp_path):
    write_text(tmp_path / "page.md", "α → β\n")
    assert (tmp_path / "page.md").read_bytes() == b"\xce\xb1 \xe2\x86\x92 \xce\xb2\n"
