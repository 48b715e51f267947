"""Any terminal and any machine: what is printed and written, and how a command is stopped."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from gaitshift.gait import gaits, mermaid
from waiting import PATIENCE

ROOT = Path(__file__).parents[2]
C_LOCALE = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


def shell(line: str, **environment: str) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command line in which `gaitshift` is this package's."""
    done = subprocess.run(
        line.replace("gaitshift", f"'{sys.executable}' -m gaitshift", 1),
        shell=True,
        capture_output=True,
        encoding="utf-8",
        timeout=PATIENCE,
        check=False,
        env=os.environ | environment,
    )
    return done.returncode, done.stdout, done.stderr


def python(program: str, *arguments: str, **environment: str) -> tuple[int, str]:
    """Exit code and stderr of a program."""
    done = subprocess.run(
        [sys.executable, "-c", program, *arguments],
        capture_output=True,
        encoding="utf-8",
        timeout=PATIENCE,
        check=False,
        env=os.environ | environment,
    )
    return done.returncode, done.stderr


# Encodings ----------------------------------------------------------------------------------------


def test_a_terminal_without_unicode_gets_the_numbers_of_the_characters_that_it_lacks():
    whole = shell("gaitshift gaits", PYTHONIOENCODING="utf-8")
    assert whole[1].count("→") > 8
    for environment in ({"PYTHONIOENCODING": "ascii"}, C_LOCALE):
        code, out, err = shell("gaitshift gaits", **environment)
        assert (code, err) == (0, "")
        assert out.encode("ascii").decode("unicode_escape") == whole[1]


def test_an_error_is_the_same_line_on_a_terminal_without_unicode():
    bad = "gaitshift gaits --canter"
    assert shell(bad, PYTHONIOENCODING="ascii") == shell(bad, PYTHONIOENCODING="utf-8")
    code, _, err = shell(bad, PYTHONIOENCODING="ascii")
    assert (code, len(err.splitlines()), "--canter" in err) == (2, 1, True)


@pytest.mark.slow
def test_a_study_writes_its_page_under_any_locale(tmp_path):
    line = f"gaitshift transitions trot bound --grounds flat --switches 1 --out '{tmp_path}'"
    code, _, err = shell(line, **C_LOCALE)
    assert code == 0, err
    assert "°" in (tmp_path / "README.md").read_text(encoding="utf-8")


def calls_of(path: Path):
    """Each call in a file, with the name of what is called."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call):
            called = node.func
            yield node, getattr(called, "attr", getattr(called, "id", ""))


def opens_text(call: ast.Call, name: str) -> bool:
    """Whether a call opens a text file, or reads what a process writes, as text."""
    if name == "open":
        owner = ast.unparse(getattr(call.func, "value", ast.Constant("")))
        modes = [ast.unparse(part) for part in call.args]
        # Of something else, or of bytes.
        opener = owner in ("os", "Image", "tarfile", "ResumableTable", "archive")
        return not opener and not any(mode in ("'rb'", "'wb'") for mode in modes)
    named = {keyword.arg for keyword in call.keywords}
    if isinstance(call.func, ast.Name) and name == "write_text":  # ours, of whole files in UTF-8
        return False
    return name in ("read_text", "write_text", "fdopen") or (name == "run" and "text" in named)


def test_every_text_file_is_opened_with_an_encoding():
    """The linter sees this where it knows the type of a path; here every call is looked at."""
    files = [p for folder in ("src", "tools", "examples") for p in (ROOT / folder).rglob("*.py")]
    found = [
        (path, call) for path in files for call, name in calls_of(path) if opens_text(call, name)
    ]
    assert len(found) > 20
    lacking = [
        f"{path.relative_to(ROOT)}:{call.lineno}"
        for path, call in found
        if "encoding" not in {keyword.arg for keyword in call.keywords}
    ]
    assert lacking == []


# Streams ------------------------------------------------------------------------------------------


def test_closed_streams_are_silence_and_no_file_takes_their_place(tmp_path):
    assert shell("gaitshift gaits >&-") == (0, "", "")
    assert shell("gaitshift gaits <&- >&- 2>&-") == (0, "", "")
    assert shell("gaitshift canter 2>&-") == (2, "", "")
    assert shell(f"gaitshift gaits trot --out '{tmp_path}' >&-")[0] == 0
    drawn = (tmp_path / "trot.mmd").read_text(encoding="utf-8")
    assert drawn == mermaid(gaits.load("trot")) + "\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
@pytest.mark.parametrize("command", ["gaits", "--help"])
def test_a_full_device_is_one_line(command):
    code, _, err = shell(f"gaitshift {command} > /dev/full")
    assert (code, err) == (2, "gaitshift: No space left on device\n")


# Machines -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("value", ["nonsense", "osmesa", "egl", "glfw", "disable", ""])
def test_what_draws_no_film_works_with_any_backend_of_opengl(value):
    code, _, err = shell("gaitshift evaluate trot --episodes 1 --seconds 0.1", MUJOCO_GL=value)
    assert (code, err) == (0, "")


HOMELESS = """
import os, pwd, sys
def unknown(uid):
    raise KeyError(f"getpwuid(): uid not found: {uid}")
pwd.getpwuid = unknown
for name in ("HOME", "XDG_CACHE_HOME"):
    os.environ.pop(name, None)
from gaitshift.cli import main
main(["evaluate", "trot", "--episodes", "1", "--seconds", "0.5", "--log", sys.argv[1]])
main(["report", sys.argv[1]])
"""


@pytest.mark.slow
def test_a_user_without_a_home_and_a_name_gets_a_page(tmp_path):
    log = tmp_path / "log.npz"
    code, err = python(HOMELESS, str(log), MPLCONFIGDIR=str(tmp_path))
    assert code == 0, err
    assert log.with_suffix(".html").is_file()


# Stops --------------------------------------------------------------------------------------------

STOPPED_IN_AN_IMPORT = """
import os, signal, sys
from importlib.abc import MetaPathFinder
class Stop(MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name == sys.argv[1]:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Stop())
from gaitshift.cli import main
main(["gaits"])
"""


@pytest.mark.parametrize("module", ["gaitshift.cli.app", "tyro", "gaitshift.cli.gaits"])
def test_ctrl_c_during_imports_is_one_line(module):
    assert python(STOPPED_IN_AN_IMPORT, module) == (130, "gaitshift: interrupted\n")


STOPPED_IN_A_COMPILED_MODULE = """
import os, signal, sys
from gaitshift.cli import main
from gaitshift.cli.gaits import Gaits
def run(self):
    try:
        os.kill(os.getpid(), getattr(signal, sys.argv[1]))
    except KeyboardInterrupt as stop:
        raise ImportError("initialization failed") from stop
Gaits.run = run
main(["gaits"])
"""


@pytest.mark.parametrize(
    ("name", "ends"),
    [
        ("SIGINT", (130, "gaitshift: interrupted\n")),
        ("SIGTERM", (143, "gaitshift: terminated\n")),
    ],
)
def test_a_signal_ends_the_command_also_where_a_compiled_module_wraps_it(name, ends):
    assert python(STOPPED_IN_A_COMPILED_MODULE, name) == ends
