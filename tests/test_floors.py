"""What runs without a simulator and without torch: the floors, seen by a fresh interpreter."""

import subprocess
import sys

import pytest

ON_A_ROBOT = (
    "legs",
    "errors",
    "motion",
    "command",
    "log",
    "reward_machine",
    "terrain",
    "robot",
    "gaits",
    "reward",
    "observation",
    "policy",
    "switching",
    "switching.height_difference",
    "switching.graph",
    "cpg",
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
    block = f"import sys\nfor name in {blocked!r}: sys.modules[name] = None\n"
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", block + program],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


@pytest.mark.parametrize("module", ON_A_ROBOT)
def test_module_runs_without_mujoco_torch_and_gymnasium(module):
    done = run_without(HEAVY, f"import gaitshift.{module}")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("module", ["world", "env", "evaluation", "benchmark.time_to_gait", "cli"])
def test_module_runs_without_torch(module):
    done = run_without(TORCH, f"import gaitshift.{module}")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("module", "needed"), [("world", "mujoco"), ("training.run", "torch")])
def test_a_blocked_package_is_missed_where_it_is_needed(module, needed):
    done = run_without((needed,), f"import gaitshift.{module}")
    assert done.returncode == 1
    assert f"import of {needed} halted" in done.stderr


def test_condition_and_machine_work_where_they_are_all_there_is():
    program = """
import numpy as np
from gaitshift import gaits
from gaitshift.switching import Condition, Signals
condition = Condition(alpha=0.05, beta=11.0)
state = condition.start(1)
feet = np.zeros((1, 4, 3))
feet[0, :, 2] = (-0.5, -0.5, -0.4, -0.4)  # four pairs of six differ by 0.1 m
fired = []
for _ in range(4):
    signals = Signals(
        contact=np.ones((1, 4), dtype=bool),
        foot_position_b=feet,
        gravity_b=np.array([[0.0, 0.0, -1.0]]),
    )
    state, fire = condition.step(state, signals, np.zeros(1, dtype=bool))
    fired.append(bool(fire[0]))
print(fired, gaits.load("trot").enter(np.array([[False, True, True, False]])))
"""
    done = run_without(HEAVY, program)
    assert done.stdout.strip() == "[False, False, True, False] [1]", done.stderr


def test_reading_a_policy_asks_for_no_simulator():
    program = """
from gaitshift import policy
from gaitshift.errors import GaitshiftError
try:
    policy.load("moonwalk")
except GaitshiftError as error:
    print(error)
"""
    done = run_without(HEAVY, program)
    assert done.stdout.startswith("no policy 'moonwalk'"), done.stderr
