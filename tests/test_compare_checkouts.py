"""Two checkouts compared: the value that differs is found, and nothing where none does."""

import importlib.util
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

TOOLS = Path(__file__).parent.parent / "tools"
STEPS, ROBOTS = 20, 2
PLACE = "truth.base_position_w"


@pytest.fixture(scope="module")
def differences():
    spec = importlib.util.spec_from_file_location("differences", TOOLS / "array_differences.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def log(**changed):
    """Arrays of a log in which robot 1 shifts at step 12; each value of a position is its index."""
    gait = np.zeros((STEPS, ROBOTS), dtype=int)
    gait[12:, 1] = 1
    return {
        "sensed.time": 0.01 * np.arange(1, STEPS + 1),
        PLACE: np.arange(STEPS * ROBOTS * 3, dtype=np.float32).reshape(STEPS, ROBOTS, 3),
        "k": np.full((STEPS, ROBOTS), np.nan),
        "gait": gait,
        "gaits": np.array(["trot", "bound"]),
    } | changed


@pytest.fixture
def compared(differences, tmp_path):
    """Rows on two logs, written to two folders."""

    def write(old, new):
        paths = [tmp_path / name / "log.npz" for name in ("old", "new")]
        for path, arrays in zip(paths, (old, new), strict=True):
            path.parent.mkdir(exist_ok=True)
            np.savez_compressed(path, **arrays)
        return differences.compare_files("log.npz", *paths, {})

    return write


def test_logs_with_the_same_values_are_equal_and_nan_equals_nan(compared):
    whole, shifts = compared(log(), log())
    assert whole.equal
    assert (whole.compared, whole.largest) == ("5 arrays", 0.0)
    assert shifts.equal
    assert shifts.note == "step 12 robot 1 to bound"


def test_one_entry_that_differs_is_found_with_its_step_and_size(compared):
    other = log()
    other[PLACE][7, 1, 2] += 0.25
    whole, place, shifts = compared(log(), other)
    assert not whole.equal
    assert (whole.largest, whole.first) == (0.25, (7,))
    assert place.what == f"log.npz: {PLACE}"
    assert (place.equal, place.largest, place.first) == (False, 0.25, (7, 1, 2))
    assert shifts.equal


def test_a_number_in_place_of_nan_differs(compared):
    other = log()
    other["k"][3, 0] = 0.0
    _, k, _ = compared(log(), other)
    assert (k.equal, k.first) == (False, (3, 0))


def test_a_later_shift_differs_in_the_steps_between(compared):
    other = log()
    other["gait"][12:15, 1] = 0
    _, gait, shifts = compared(log(), other)
    assert (gait.equal, gait.first) == (False, (12, 1))
    assert not shifts.equal


@pytest.mark.parametrize(
    "other",
    [
        log()[PLACE].astype(float),
        log()[PLACE][:, :, :2],
        log()[PLACE][:-1],
    ],
    ids=["type", "width", "length"],
)
def test_another_type_or_shape_differs_without_a_value_that_does(compared, other):
    _, place, _ = compared(log(), log() | {PLACE: other})
    assert (place.equal, place.largest, place.first) == (False, None, None)


def test_renamed_arrays_are_compared_and_arrays_of_one_log_alone_do_not_count(differences):
    place = log()[PLACE]
    new = log(base=place[..., :2], rest=place[..., 2:], counter=log()["k"], beta=1)
    del new[PLACE], new["k"]
    renames = {
        PLACE: lambda log: np.concatenate([log["base"], log["rest"]], axis=2),
        "k": "counter",
        "torque": "effort",
    }
    old = log(torque=np.zeros(STEPS))
    (whole,) = differences.compare("log", "arrays", old, differences.renamed(new, renames))
    assert (whole.equal, whole.compared) == (True, "5 arrays")
    assert "only in old: torque" in whole.note
    assert "only in new: base, rest, beta" in whole.note


def test_nothing_in_common_is_not_equal(differences):
    (whole,) = differences.compare("log", "arrays", {"a": np.zeros(2)}, {"b": np.zeros(2)})
    assert not whole.equal


def test_a_table_differs_in_a_cell_but_for_the_clocks_column(differences, tmp_path):
    old, new = tmp_path / "old.csv", tmp_path / "new.csv"
    old.write_text("iteration,wall_s,reward\n1,0.5,2.0\n2,0.9,\n")
    new.write_text("iteration,wall_s,reward\n1,0.6,2.5\n2,1.0,\n")
    whole, reward = differences.compare_files("progress.csv", old, new, {})
    assert whole.compared == "2 columns"
    assert (reward.what, reward.largest, reward.first) == ("progress.csv: reward", 0.5, (0,))


def checkout(folder, speed):
    """A clean checkout whose `gaitshift` prints a speed and counts how often it ran."""
    package = folder / "src" / "gaitshift"
    package.mkdir(parents=True)
    (package / "__init__.py").touch()
    (folder / ".gitignore").write_text("runs.txt\n__pycache__\n")
    figures = {"policy": str(folder), "verdict": {"speed": speed, "misses": [None]}}
    (package / "__main__.py").write_text(
        f"with open({str(folder / 'runs.txt')!r}, 'a') as file:\n    file.write('ran\\n')\n"
        f"print({json.dumps(figures)!r})\n"
    )
    git = ["git", "-C", str(folder), "-c", "user.name=a", "-c", "user.email=a@example.org"]
    for words in (["init", "-q"], ["add", "-A"], ["commit", "-q", "-m", f"speed {speed}"]):
        subprocess.run([*git, *words], check=True)
    return folder


@pytest.mark.parametrize(("speed", "code"), [(1.0, 0), (1.5, 1)])
def test_the_code_of_each_checkout_runs_and_a_commit_runs_once(tmp_path, speed, code):
    old, new = checkout(tmp_path / "old", 1.0), checkout(tmp_path / "new", speed)
    (new / "note.txt").touch()  # a local change
    command = [sys.executable, str(TOOLS / "compare_checkouts.py"), str(old), str(new)]
    command += ["--only", "evaluate", "--out", str(tmp_path / "out")]
    for _ in range(2):
        done = subprocess.run(command, capture_output=True, text=True)
        assert done.returncode == code, done.stderr
    _, _, whole, *differing = done.stdout.splitlines()
    assert whole.split(" | ")[1] == "2 fields"
    assert [line.split(" | ")[3] for line in differing] == ["0.5"] * code
    assert (old / "runs.txt").read_text() == "ran\n"
    assert (new / "runs.txt").read_text() == "ran\n" * 2
