"""Nothing calls home: no file in the user's home, and no thread that could look up a host."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from waiting import PATIENCE

RUNTIME = str(Path(__file__).parent.parent / "examples" / "runtime.py")
LIBRARY = """
import numpy as np
from gaitshift.control import policy
trot = policy.load("trot")
trot(np.zeros((1, trot.observation.size), dtype=np.float32))
"""
COUNT_THREADS = """
import os
print(len(os.listdir("/proc/self/task")))
"""


def run_at(home: Path, *arguments: str) -> str:
    """Runs Python with this home and without the variables by which a package sees a CI machine."""
    kept = ("PATH", "PYTHONPATH", "LD_LIBRARY_PATH", "SYSTEMROOT")
    environment = {name: os.environ[name] for name in kept if name in os.environ}
    environment |= {"HOME": str(home), "OPENBLAS_NUM_THREADS": "1", "MPLCONFIGDIR": str(home)}
    done = subprocess.run(
        [sys.executable, *arguments],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
        env=environment,
        cwd=home.parent,
    )
    return done.stdout


@pytest.mark.parametrize(
    "arguments",
    [
        ["-m", "gaitshift", "evaluate", "trot", "--episodes", "1", "--seconds", "0.1", "--json"],
        [RUNTIME, "3"],
        ["-c", LIBRARY],
        ["-c", "import gaitshift, onnxruntime"],
    ],
    ids=["command", "example", "library", "its own import"],
)
def test_nothing_is_written_to_the_users_home(arguments, tmp_path):
    home = tmp_path / "home"
    home.mkdir()
    run_at(home, *arguments)
    assert [path.name for path in tmp_path.rglob("*")] == ["home"]


@pytest.mark.skipif(sys.platform != "linux", reason="Linux lists the threads of a process")
def test_a_policy_runs_in_the_one_thread_of_its_process(tmp_path):
    """Usage data would be sent, after a look-up of their host, by a thread of their own."""
    assert run_at(tmp_path, "-c", LIBRARY + COUNT_THREADS) == "1\n"
