"""The examples run, and the loop of a robot is fast enough."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_runs(path, tmp_path):
    iterations = ["2"] if path.stem.startswith("train_") else []
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path), *iterations],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


def test_a_step_of_the_runtime_takes_a_small_part_of_its_ten_milliseconds(tmp_path):
    """0.3 ms on a quiet core; a busy one may take three times as long."""
    (path,) = (path for path in EXAMPLES if path.stem == "runtime")
    done = subprocess.run(
        [sys.executable, str(path), "500"], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    median = re.search(r"([\d.]+) ms a step", done.stdout)
    assert median is not None
    assert float(median[1]) < 1.0
