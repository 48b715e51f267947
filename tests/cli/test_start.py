"""The command line starts fast: a command imports what it needs, and nothing else."""

import inspect
import subprocess
import sys
from importlib import import_module

import pytest

from gaitshift.cli import main
from gaitshift.cli.app import COMMANDS
from gaitshift.control import policy
from gaitshift.gait import gaits

SLOW = (
    "gymnasium",
    "matplotlib",
    "mujoco",
    "numpy",
    "onnxruntime",
    "pyarrow",
    "rich",
    "scipy",
    "sklearn",
    "torch",
    "viser",
)
"""Packages that take from 0.1 to 2 s to import."""

IMPORTED = """
import sys
from gaitshift.cli import main
try:
    main(sys.argv[1:])
except SystemExit:
    pass
print(*(name for name in sys.modules if "." not in name), file=sys.stderr)
"""


@pytest.mark.parametrize("arguments", [["gaits"], ["gaits", "--help"], ["--help"], ["canter"]])
def test_a_command_that_needs_no_slow_package_imports_none(arguments):
    done = subprocess.run(
        [sys.executable, "-c", IMPORTED, *arguments], capture_output=True, text=True, check=True
    )
    imported = set(done.stderr.splitlines()[-1].split())
    assert "gaitshift" in imported
    assert imported.isdisjoint(SLOW)


@pytest.mark.parametrize("name", COMMANDS)
def test_the_help_of_all_commands_has_the_first_paragraph_of_each_ones_own(name):
    module = import_module(f"gaitshift.cli.{name.replace('-', '_')}")
    told = inspect.getdoc(getattr(module, name.title().replace("-", "")))
    assert told
    assert COMMANDS[name] == " ".join(told.partition("\n\n")[0].split())


def test_the_help_lists_all_commands_in_their_order(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    with pytest.raises(SystemExit) as exit_:
        main(["--help"])
    assert exit_.value.code == 0
    said = capsys.readouterr().out
    listed = [line.strip("│ •") for line in said.splitlines() if "•" in line]
    assert [line.split()[0] for line in listed] == list(COMMANDS)


def test_the_list_of_gaits_has_what_their_machines_and_policies_have(capsys):
    main(["gaits"])
    listed = capsys.readouterr().out.splitlines()
    assert len(listed) == len(gaits.names())
    for line, machine in zip(listed, map(gaits.load, gaits.names()), strict=True):
        assert line.split()[0] == machine.name
        assert " → ".join(state.name for state in machine.states) in line
        assert ("no policy shipped" in line) == (machine.name not in policy.shipped())
        assert line.endswith(machine.description)
