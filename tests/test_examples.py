"""The examples run, and the loop of a robot is fast enough."""

import subprocess
import sys
from pathlib import Path

import pytest

from waiting import PATIENCE

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*.py"))


def _marked(path):
    """Trainings are slow: they import torch."""
    return pytest.param(path, marks=[pytest.mark.slow] * path.stem.startswith("train_"))


@pytest.mark.parametrize("path", [_marked(path) for path in EXAMPLES], ids=lambda path: path.stem)
def test_an_example_runs(path, tmp_path):
    iterations = ["2"] if path.stem.startswith("train_") else []
    done = subprocess.run(
        [sys.executable, "-W", "error", str(path), *iterations],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


COUNTED = """
import runpy, sys, time
calls = 0
def count(frame, event, argument):
    global calls
    calls += event in ("call", "c_call")
time.perf_counter = lambda: calls / 1000
main = runpy.run_path(sys.argv[1])["main"]
sys.setprofile(count)
print(main(300))
"""
"""Runs the loop by a clock that counts calls of functions, a thousand in its second."""


def test_a_step_of_the_runtime_takes_a_small_part_of_its_ten_milliseconds(tmp_path):
    """A call takes about 1 µs on a quiet core, so that 1000 are a tenth of the period."""
    (path,) = (path for path in EXAMPLES if path.stem == "runtime")
    done = subprocess.run(
        [sys.executable, "-c", COUNTED, str(path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
    )
    assert 0 < float(done.stdout.split()[-1]) < 1000
