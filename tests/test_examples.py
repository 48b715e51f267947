"""The examples run, and the loop of a robot is fast enough."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from waiting import PATIENCE

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path, tmp_path):
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_a_step_of_the_runtime_takes_a_small_part_of_its_ten_milliseconds(tmp_path):
    """0.3 ms on a quiet core; of five runs beside other work, one has a core to itself."""
    (path,) = (path for path in EXAMPLES if path.stem == "runtime")
    command = [sys.executable, str(path), "500"]

    def median():
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path)
        return float(re.search(r"([\d.]+) ms a step", done.stdout)[1])

    assert any(median() < 1.0 for _ in range(5))
