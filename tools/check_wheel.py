"""Builds wheel and sdist, and tries the wheel where the source tree is out of reach.

For each Python of `PYTHONS`, and once more for the oldest direct dependencies that pyproject.toml
allows: a clean environment with the wheel, a demonstration without video, and the given tests of
the unpacked sdist. A missing interpreter is skipped. Needs `uv` and `hatchling` beside it.

Usage: python tools/check_wheel.py TESTS...
"""

import os
import shutil
import subprocess
import sys
import tarfile
import time
import zipfile
from pathlib import Path

ROOT = Path(__file__).parent.parent
WORK = ROOT / "build" / "wheel"

PYTHONS = ("3.11", "3.12", "3.13")
OLDEST = "3.11"
"""The Python for which the oldest dependencies have wheels."""

LARGEST = 10_000_000
"""Size that neither file may exceed [bytes]; ours: pictures and policies are most of 7 MB."""

IN_WHEEL = ("gaitshift/py.typed", "gaitshift/gait/gaits/trot.toml")
IN_SDIST = ("pyproject.toml", "LICENSE", "CHANGELOG.md", "src/gaitshift/py.typed", "tests")
IN_NEITHER = ("node_modules", "__pycache__", ".venv", "runs", "out")
"""Names of files and folders, anywhere in a path."""


def main(tests: list[str]) -> None:
    """Checks all, one line each; ends with exit code 1 and the output at the first failure."""
    shutil.rmtree(WORK, ignore_errors=True)
    run([*UV, "build", "--quiet", "--no-build-isolation", "--python", sys.executable, "-o", WORK])
    (wheel,), (sdist,) = WORK.glob("*.whl"), WORK.glob("*.tar.gz")
    with zipfile.ZipFile(wheel) as archive:
        check_contents(wheel, archive.namelist(), IN_WHEEL)
    with tarfile.open(sdist) as archive:
        check_contents(sdist, [name.partition("/")[2] for name in archive.getnames()], IN_SDIST)
        archive.extractall(WORK, filter="data")
    source = WORK / sdist.name.removesuffix(".tar.gz")
    shutil.rmtree(source / "src")
    locked = ["--constraint", ROOT / "requirements.lock"]
    for version in PYTHONS:
        try_wheel(wheel, source, tests, version, f"Python {version}", locked)
    oldest = ["--resolution", "lowest-direct"]
    try_wheel(wheel, source, tests, OLDEST, f"Python {OLDEST}, oldest dependencies", oldest)


def check_contents(path: Path, names: list[str], needed: tuple[str, ...]) -> None:
    """The file is small, has what it needs and nothing that was made beside the source."""
    parts = {part for name in names for part in Path(name).parts}
    faults = [f"lacks {name}" for name in needed if not {name, f"{name}/conftest.py"} & set(names)]
    faults += [f"contains {part}" for part in IN_NEITHER if part in parts]
    size = path.stat().st_size
    if size > LARGEST:
        faults.append(f"has {size} bytes, at most {LARGEST} are allowed")
    if faults:
        sys.exit("\n".join(f"{path.name} {fault}" for fault in faults))
    print(f"{path.name}: {len(names)} files, {size / 1e6:.1f} MB")


def try_wheel(
    wheel: Path, source: Path, tests: list[str], version: str, title: str, how: list[str | Path]
) -> None:
    """Installs the wheel in an environment of its own, runs the demonstration and the tests."""
    interpreter = find_python(version)
    if interpreter is None:
        print(f"{title}: skipped, there is no python{version} on PATH or in ~/.pyenv/versions")
        return
    start = time.monotonic()
    home = WORK / title.replace(" ", "-").replace(",", "")
    python = home / "bin" / "python"
    run([*UV, "venv", "--quiet", "--python", interpreter, home])
    run([*UV, "pip", "install", "--quiet", "--python", python, *how, f"{wheel}[test]"])
    demo = ["demo", "--no-video", "--out", home / "demo", "--overwrite"]
    run([python, "-m", "gaitshift", *demo], cwd=home)
    run([python, "-m", "pytest", "-n", "2", *tests], cwd=source)
    print(f"{title}: the demonstration and the tests pass ({time.monotonic() - start:.0f} s)")


def find_python(version: str) -> str | None:
    """The interpreter of a version such as "3.12", from PATH or from pyenv."""
    pyenv = Path.home() / ".pyenv" / "versions"
    named = [shutil.which(f"python{version}"), *pyenv.glob(f"{version}.*/bin/python")]
    for path in filter(None, named):
        # pyenv's shims are on PATH also where their version is not chosen, and then fail.
        if not subprocess.run([path, "-c", ""], capture_output=True, check=False).returncode:
            return str(path)
    return None


def run(command: list[str | Path], cwd: Path = ROOT) -> None:
    """Runs a command; where it fails, shows what it wrote and ends with exit code 1."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        command,
        cwd=cwd,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
        encoding="utf-8",
    )
    if done.returncode:
        sys.exit(f"{done.stdout}failed: {' '.join(str(part) for part in command)}")


UV = (sys.executable, "-m", "uv")

if __name__ == "__main__":
    main(sys.argv[1:])
