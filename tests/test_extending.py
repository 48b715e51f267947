"""Extending is as cheap as the guides say: each thing is added as they say, and then used.

What goes into the package is added to a copy of it, which runs in a process of its own.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import onnx
import pytest
from onnx import helper

import gaitshift
from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.log import Log
from gaitshift.robot.robot_file import read_robot

PONY = Path(__file__).parents[1] / "examples" / "robots" / "pony.toml"

RAMPS = """
import numpy as np

from gaitshift.sim.terrain.kind import FINE_CELL, Grid, Kind, Quantity, spell

HEIGHT = Quantity(name="height", unit="m", low=0.0, high=0.5)


def ramps(height, *, length, width, cell):
    grid = Grid(length=length, width=width, cell=cell)
    return grid.terrain(height * (grid.x % 1.0), name=spell("ramps", height), origin=None)


KINDS = (
    Kind(
        name="ramps",
        number=HEIGHT,
        cell=FINE_CELL,
        meaning="ramps of 1 m, each ending in a drop of this height",
        make=lambda number, seed, length, width, cell: ramps(
            number, length=length, width=width, cell=cell
        ),
        rough_from=0.1,
    ),
)
"""

GREET = '''
from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class GreetGait:
    """Greet a gait."""

    gait: str = "trot"
    """Its name."""

    def run(self) -> None:
        print(f"hello, {self.gait}")
'''


LEAN = '''
from dataclasses import dataclass

import numpy as np

from gaitshift.shift.statistic import SearchRange


@dataclass(frozen=True, kw_only=True)
class Lean:
    """Largest share of gravity along the body's axes."""

    unit = ""
    width = 1
    needs = ()
    search = SearchRange(low=0.01, high=1.0, note="how far the body leans")

    def start(self, n):
        return None

    def step(self, state, sensed):
        return None, np.abs(sensed.gravity_b[:, :2]).max(axis=1, keepdims=True)
'''

LEANING = """
start = "trot"

[statistic.body]
kind = "lean"

[[edge]]
from = "trot"
to = "bound"
statistic = "body"
alpha = 0.3
beta = 2

[[edge]]
from = "bound"
to = "trot"
statistic = "body"
when = "below"
alpha = 0.3
beta = 2
"""

STATUE = '''
import numpy as np

from gaitshift.control.controller import Repertoire
from gaitshift.gait.gaits import load
from gaitshift.robot.description import ANYMAL_B


class Statue:
    """Robots that stand."""

    gains = "default"

    def __init__(self, gaits, n, *, robot=None):
        machines = tuple(load(gait) for gait in gaits)
        self.n, self.robot, self.gait = n, robot or ANYMAL_B, np.zeros(n, dtype=int)
        self.machine_state = np.zeros(n, dtype=int)
        speeds, strides = np.full(len(machines), 0.5), np.full(len(machines), 2.0)
        self.repertoire = Repertoire(
            gaits=tuple(gaits), machines=machines, forward_speed=speeds, stride_frequency=strides
        )

    def act(self, sensed, command):
        return np.tile(self.robot.stance_angles, (self.n, 1))

    def see(self, sensed, command):
        pass

    def switch(self, ids, gait, sensed):
        self.gait[ids] = self.repertoire.index(gait)

    def value(self):
        return None
'''


class Copy:
    """A copy of the package to add things to."""

    def __init__(self, folder):
        self.folder = folder
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(Path(gaitshift.__file__).parent, folder / "gaitshift", ignore=ignored)

    def add_file(self, name, text):
        path = self.folder / "gaitshift" / name
        assert not path.exists()
        path.write_text(text)

    def add_line(self, name, after, line):
        path = self.folder / "gaitshift" / name
        before = path.read_text()
        assert before.count(after) == 1
        path.write_text(before.replace(after, after + line + "\n"))
        assert len(path.read_text().splitlines()) == len(before.splitlines()) + 1

    def python(self, *arguments):
        done = subprocess.run(
            [sys.executable, *arguments],
            env=os.environ | {"PYTHONPATH": str(self.folder)},
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    return Copy(tmp_path_factory.mktemp("copy"))


def test_a_gait_is_one_file(copy):
    text = (Path(gaits.__file__).parent / "trot.toml").read_text()
    copy.add_file("gait/gaits/amble.toml", text.replace('"trot"', '"amble"', 1))
    said = copy.python("-m", "gaitshift", "gaits", "amble", "--json")
    assert list(json.loads(said)) == ["amble"]
    assert "amble" in copy.python("-c", "from gaitshift.gait import gaits; print(gaits.names())")


def test_a_terrain_is_one_file_and_one_line(copy):
    """The command line, tracks, errors, help, and the labels of rough ground know it."""
    copy.add_file("sim/terrain/ramps.py", RAMPS)
    copy.add_line("sim/terrain/spec.py", '    "pebbles",\n', '    "ramps",')
    said = copy.python(
        "-c",
        """
import json
from pathlib import Path
from gaitshift.cli import main
from gaitshift.lab.identification import rough_ground
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import from_spec, spec_help

track = "flat@4.5,ramps:0.2@20"
main(["evaluate", "trot", "--terrain", track, "--episodes", "2", "--seconds", "3", "--json",
      "--log", "walk.npz"])
log = Log.load(Path("walk.npz"))
ground = from_spec("ramps:0.2", seed=0, length=3.0, width=2.0)
print(json.dumps({
    "terrain": log.terrain,
    "rough": rough_ground(log)[[0, -1]].any(axis=1).tolist(),
    "height": float(ground.height.max()),
    "help": "ramps:HEIGHT [0 to 0.5 m]" in spec_help(),
}))
""",
    )
    figures, facts = map(json.loads, said.splitlines())
    assert figures["terrain"] == "flat@4.5,ramps:0.2@20" == facts["terrain"]
    assert facts["rough"] == [False, True]
    assert facts["height"] == pytest.approx(0.2 * 0.975)  # a sample before the drop
    assert facts["help"]


def test_a_condition_is_one_file_and_one_line(copy):
    """Graphs, robots and the search for its numbers know it."""
    copy.add_file("shift/statistics/lean.py", LEAN)
    registry = '    "oracle": "gaitshift.shift.statistics.oracle:Oracle",\n'
    line = '    "lean": "gaitshift.shift.statistics.lean:Lean",'
    copy.add_line("shift/statistics/__init__.py", registry, line)
    (copy.folder / "leaning.toml").write_text(LEANING)
    said = copy.python(
        "-c",
        """
import numpy as np
from gaitshift.lab.identification.candidates import candidates
from gaitshift.robot.state import Proprioception, orientation_of
from gaitshift.shift import load_graph

graph = load_graph("leaning.toml")
state = graph.begin(2)
gravity = np.array([[0.6, 0.0, -0.8], [0.0, 0.1, -np.sqrt(0.99)]])  # one leans, one does not
sensed = Proprioception(
    contact=np.ones((2, 4), dtype=bool),
    foot_position_b=np.zeros((2, 4, 3)),
    orientation=orientation_of(gravity),
)
for _ in range(3):
    state, decision = graph.step(state, sensed)
print([graph.gaits[gait] for gait in state.gait], candidates(["lean"])[0].note)
""",
    )
    assert said.strip() == "['bound', 'trot'] how far the body leans"


def test_a_controller_is_one_file_and_one_line(copy):
    """`--controller` takes it, here to be evaluated and to be recorded."""
    copy.add_file("control/statue.py", STATUE)
    registry = '    "cpg": "gaitshift.control.cpg:CpgController",\n'
    copy.add_line(
        "control/controller.py", registry, '    "statue": "gaitshift.control.statue:Statue",'
    )
    few = ["--controller", "statue", "--seconds", "1", "--json"]
    said = copy.python("-m", "gaitshift", "evaluate", "pronk", *few, "--episodes", "2")
    assert json.loads(said)["survival"] == 1.0
    where = ["--courses", "flat", "--robots", "2", "--out", "logs"]
    said = copy.python("-m", "gaitshift", "record", "pronk", *few, *where)
    (log,) = json.loads(said)["logs"]
    assert log["robots"] == 2
    assert log["fallen"] == 0


def test_a_command_is_one_file_and_one_line(copy):
    copy.add_file("cli/greet_gait.py", GREET)
    copy.add_line(
        "cli/app.py", '    "bench": "Measure speed.",\n', '    "greet-gait": "Greet a gait.",'
    )
    assert "Greet a gait." in copy.python("-m", "gaitshift", "greet-gait", "--help")
    assert copy.python("-m", "gaitshift", "greet-gait", "--gait", "pace") == "hello, pace\n"


# A robot is one file beside its model -------------------------------------------------------------


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The networks of trot and bound as if the pony had trained them: enough to fall over with."""
    robot, folder = read_robot(PONY), tmp_path_factory.mktemp("pony")
    gains = robot.gains_of("default")
    changes = {
        "robot": robot.name,
        "stance": list(robot.stance),
        "gains": "default",
        "kp": gains.kp,
        "kd": gains.kd,
    }
    paths = []
    for gait in ("trot", "bound"):
        model = onnx.load(policy.load(gait).path)
        entries = {entry.key: entry.value for entry in model.metadata_props}
        entries |= {f"gaitshift.{name}": json.dumps(value) for name, value in changes.items()}
        helper.set_model_props(model, entries)
        paths.append(str(folder / f"{gait}.onnx"))
        onnx.save(model, paths[-1])
    return paths


def test_a_robot_of_a_file_is_run_and_shown_by_the_commands(files, tmp_path, capsys):
    pony = ["--robot-file", str(PONY)]
    short = ["--seconds", "0.5", "--json"]
    main(["evaluate", files[0], *pony, *short, "--episodes", "2", "--log", str(tmp_path / "e.npz")])
    recorded = ["--courses", "flat", "--robots", "2", "--out", str(tmp_path / "record")]
    main(["record", files[0], *pony, *short, *recorded])
    shown = ["--gaits", "trot,bound", "--at", "0.2", "--every", "0.2", "--no-video", "--json"]
    out = tmp_path / "demo"
    main(["demo", *pony, *shown, "--policy-files", *files, "--out", str(out)])
    for log in (tmp_path / "e.npz", tmp_path / "record" / "trot-flat-0.npz", out / "log.npz"):
        assert Log.load(log).robot == "pony"
    main(["report", str(out / "log.npz"), *pony])
    assert "<td>pony</td>" in (out / "log.html").read_text()


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["evaluate", "trot"], "'pony' has no policy for the gait 'trot'"),
        (["evaluate", "trot", "--controller", "cpg"], "know ANYmal B alone"),
        (["record", "trot", "--out", "{out}"], "'pony' has no policy for the gait 'trot'"),
        (["demo", "--out", "{out}"], "'pony' has no policy for the gait 'trot'"),
        (["demo", "--controller", "cpg", "--out", "{out}"], "know ANYmal B alone"),
        (["view"], "'pony' has no policy for the gait 'trot'"),
        (["study", "--out", "{out}"], "'pony' has no policy for the gait 'trot'"),
        (["map", "trot", "--out", "{out}"], "'pony' has no policy for the gait 'trot'"),
        (["transitions", "--out", "{out}"], "'pony' has no policy for the gait 'trot'"),
    ],
)
def test_a_robot_file_acts_or_is_refused_before_any_work(arguments, says, tmp_path, capsys):
    out = tmp_path / "out"
    with pytest.raises(SystemExit) as end:
        main([*(a.format(out=out) for a in arguments), "--robot-file", str(PONY)])
    assert end.value.code == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line
    assert not out.exists()


def test_a_robot_of_a_file_leaves_nothing_behind(files):
    """Another call of the same process knows ANYmal B alone."""
    loaded = policy.load(files[0], read_robot(PONY))
    assert (loaded.robot.name, policy.load("trot").robot.name) == ("pony", "anymal_b")
    with pytest.raises(GaitshiftError, match="of the robot 'pony'"):
        policy.load(files[0])
