"""What runs without a simulator and without torch: the floors, seen by a fresh interpreter."""

import subprocess
import sys
from importlib import metadata

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from waiting import PATIENCE

ON_A_ROBOT = (
    "errors",
    "data",
    "robot",
    "gait",
    "gait.gaits",
    "shift",
    "control",
    "control.policy",
    "control.cpg",
    "sim.reward",
    "sim.terrain",
    "lab.log",
)
"""Modules that go onto a robot, where NumPy, onnxruntime and jaxtyping are all there is."""

HEAVY = (
    "mujoco",
    "torch",
    "gymnasium",
    "matplotlib",
    "scipy",
    "tyro",
    "rich",
    "imageio_ffmpeg",
    "PIL",
)
TORCH = ("torch", "tensordict", "rsl_rl", "onnx", "tensorboard", "stable_baselines3")


def run_without(blocked: tuple[str, ...], program: str) -> subprocess.CompletedProcess[str]:
    """Run a program in a fresh interpreter to which the blocked packages are not installed."""
    block = f"""
import sys
from importlib.machinery import PathFinder
class Lacking(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        lacks = name.partition(".")[0] in {blocked!r}
        return None if lacks else super().find_spec(name, path, target)
sys.meta_path[sys.meta_path.index(PathFinder)] = Lacking
"""
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", block + program],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )


@pytest.mark.parametrize("module", ON_A_ROBOT)
def test_module_runs_without_mujoco_torch_and_gymnasium(module):
    done = run_without(HEAVY, f"import gaitshift.{module}")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "module", ["sim.world", "sim.env", "lab.evaluation", "lab.benchmark.time_to_gait", "cli"]
)
def test_module_runs_without_torch(module):
    done = run_without(TORCH, f"import gaitshift.{module}")
    assert done.returncode == 0, done.stderr


def test_rollouts_in_a_second_simulator_need_no_mujoco():
    program = "import gaitshift.lab.evaluation, gaitshift.sim.bullet"
    done = run_without(("mujoco", "gymnasium"), program)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("module", "needed"), [("sim.world", "mujoco"), ("learn.run", "torch")])
def test_a_blocked_package_is_missed_where_it_is_needed(module, needed):
    done = run_without((needed,), f"import gaitshift.{module}")
    assert done.returncode == 1
    assert f"No module named '{needed}'" in done.stderr


def test_condition_and_machine_work_where_they_are_all_there_is():
    program = """
import numpy as np
from gaitshift.gait import gaits
from gaitshift.shift import Proprioception, load_graph, tuned
graph = tuned(load_graph("height_difference"), alpha=0.05, beta=11.0)
state = graph.begin(1)
feet = np.zeros((1, 4, 3))
feet[0, :, 2] = (-0.5, -0.5, -0.4, -0.4)  # four pairs of six differ by 0.1 m
fired = []
for _ in range(4):
    sensed = Proprioception(
        contact=np.ones((1, 4), dtype=bool),
        foot_position_b=feet,
        orientation=np.array([[1.0, 0.0, 0.0, 0.0]]),
    )
    state, decision = graph.step(state, sensed)
    fired.append(bool(decision.fired[0]))
print(fired, gaits.load("trot").enter(np.array([[False, True, True, False]])))
"""
    done = run_without(HEAVY, program)
    assert done.stdout.strip() == "[False, False, True, False] [1]", done.stderr


def test_reading_a_policy_asks_for_no_simulator():
    program = """
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
try:
    policy.load("moonwalk")
except GaitshiftError as error:
    print(error)
"""
    done = run_without(HEAVY, program)
    assert done.stdout.startswith("policy must be one of "), done.stderr


def beyond_a_light_install():
    """Importable packages here that `pip install gaitshift` alone would not bring."""
    brought, waiting = set(), [Requirement("gaitshift")]
    while waiting:
        wanted = waiting.pop()
        key = (canonicalize_name(wanted.name), frozenset(wanted.extras))
        if key in brought:
            continue
        brought.add(key)
        for line in metadata.requires(wanted.name) or ():
            needed = Requirement(line)
            extras = ("", *wanted.extras)
            if needed.marker is None or any(needed.marker.evaluate({"extra": e}) for e in extras):
                waiting.append(needed)
    names = {name for name, _ in brought}
    return tuple(
        module
        for module, owners in metadata.packages_distributions().items()
        if names.isdisjoint(map(canonicalize_name, owners))
    )


def test_a_light_install_lacks_what_the_extras_bring():
    lacking = beyond_a_light_install()
    assert {"torch", "scipy", "sklearn", "pyarrow", "cattrs", "viser", "pytest"} <= set(lacking)
    assert {"numpy", "mujoco", "gymnasium", "matplotlib", "trimesh"}.isdisjoint(lacking)


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ["demo", "--track", "flat@2", "--no-video", "--out", "demo"],
        ["evaluate", "trot", "--episodes", "2", "--seconds", "1", "--plot", "trot.png"],
        ["record", "trot", "--courses", "flat", "--robots", "2", "--seconds", "1", "--out", "logs"],
        ["report", "walk.npz"],
        ["gaits", "trot", "--out", "pictures"],
    ],
    ids=lambda arguments: arguments[0],
)
def test_commands_of_a_light_install_need_nothing_else(arguments, tmp_path):
    program = f"""
import os
from gaitshift.cli import main
os.chdir({str(tmp_path)!r})
if "walk.npz" in {arguments!r}:
    main(["evaluate", "trot", "--episodes", "1", "--seconds", "1", "--log", "walk.npz"])
main({arguments!r})
"""
    done = run_without(beyond_a_light_install(), program)
    assert done.returncode == 0, done.stderr
