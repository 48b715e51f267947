"""Compares two checkouts of the project value by value, as before and after a refactoring.

Usage: python tools/compare_checkouts.py OLD NEW [--out DIR] [--only PART,PART,…]

The code of both runs the same commands (`PARTS`) with the same interpreter; then their logs,
tables, reports and networks are compared: same types, shapes and values. It takes 80 s of processor
time a checkout. Results of a commit without local changes are kept below `--out`, so that it runs
once. Prints a Markdown table; exit code 1 if anything differs or a command fails.
What has another name in the new checkout stands in the tables of renames.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np
from array_differences import Arrays, Renames, Row, compare_files


def _stacked(*names: str) -> Callable[[Arrays], np.ndarray]:
    """An old array that is several new ones side by side along its last axis."""

    def joined(new: Arrays) -> np.ndarray:
        parts = [new[name] for name in names]
        return np.concatenate([p if p.ndim > 2 else p[..., None] for p in parts], axis=-1)

    return joined


LOG_RENAMES: Renames = {
    "time": "sensed.time",
    "qpos": _stacked("truth.base_position_w", "truth.base_quaternion_w", "sensed.joint_position"),
    "torque": "sensed.joint_torque",
    "contact": "sensed.contact",
    "foot_position_w": "truth.foot_position_w",
    "clearance": "truth.clearance",
    "gait": lambda new: new["gait"].astype(np.int16),
    "machine_state": lambda new: new["machine_state"].astype(np.int16),
    "value": "sensed.value",
}
"""Arrays of logs: the old name, and the new one or the old array out of the new log."""
FIELD_RENAMES: Renames = {}
"""The same for columns of tables, fields of JSON (`verdict.clean`) and networks' initialisers."""
WORD_RENAMES: Mapping[str, str] = {}
"""Words of commands and names of files in `PARTS`, and what they are in the new checkout."""
RECORDED = ("flat", "up-10", "into-0.10")
LOGS = [f"logs/trot-{course}-0.npz" for course in RECORDED]

PARTS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "demo": (("demo --no-video --json --out demo",), ("demo/log.npz", "demo.json")),
    "evaluate": (("evaluate trot --episodes 32 --seconds 8 --json",), ("evaluate.json",)),
    "train": (
        ("train trot --iterations 20 --threads 1 --json --out train",),
        ("train/progress.csv", "train/policy.onnx"),
    ),
    "identify": (
        (
            f"record trot --courses {' '.join(RECORDED)} --robots 4 --seconds 12 --out logs",
            f"identify {' '.join(LOGS)} --condition touchdown_surprise --out report",
        ),
        (*LOGS, *(f"report/{name}" for name in ("conditions.csv", "courses.csv", "README.md"))),
    ),
}
"""Commands that run in a folder of their own, and the files that are compared afterwards; what a
command prints is written to NAME.json."""


class CommandFailedError(Exception):
    """A command of a checkout failed; the message has the last line of its stderr."""


class Checkout:
    """A checkout, and the folder of its results below `out`."""

    def __init__(self, path: Path, out: Path, renames: Mapping[str, str]) -> None:
        self.path, self.renames = path.resolve(), renames
        commit = self._git("rev-parse", "HEAD")
        self.clean = bool(commit) and not self._git("status", "--porcelain")
        changed = "changed" + str(self.path).replace(os.sep, "-")
        self.folder = out.resolve() / (commit if self.clean else changed)

    def _git(self, *words: str) -> str:
        done = subprocess.run(
            ["git", "-C", self.path, *words], capture_output=True, text=True, encoding="utf-8"
        )
        return done.stdout.strip()

    def python(self, *words: str, cwd: Path) -> str:
        """Stdout of the interpreter with the checkout's package."""
        paths = {"PYTHONPATH": str(self.path / "src"), "MUJOCO_GL": "egl"}
        done = subprocess.run(
            [sys.executable, *words],
            cwd=cwd,
            env=os.environ | paths,
            capture_output=True,
            text=True,
            encoding="utf-8",
        )
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
            raise CommandFailedError(f"{self.path}: {last[0]}")
        return done.stdout

    def run(self, name: str) -> Path:
        """Runs a part, if its results are not kept; gives their folder."""
        folder, (lines, _) = self.folder / name, PARTS[name]
        commands = [[self.renames.get(word, word) for word in line.split()] for line in lines]
        packages = ("numpy", "mujoco-core", "onnxruntime", "torch", "rsl-rl-lib")
        versions = {package: version(package) for package in packages}
        stamp = json.dumps({"commands": commands, "python": sys.executable, **versions})
        done = folder / "done.json"
        if self.clean and done.is_file() and done.read_text(encoding="utf-8") == stamp:
            return folder
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        source = self.python("-c", "import gaitshift; print(gaitshift.__file__)", cwd=folder)
        if not Path(source.strip()).is_relative_to(self.path):
            raise CommandFailedError(f"{self.path}: the package comes from {source.strip()}")
        for words in commands:
            print(f"{self.path}: gaitshift {' '.join(words)}", file=sys.stderr, flush=True)
            printed = self.python("-m", "gaitshift", *words, cwd=folder)
            (folder / f"{words[0]}.json").write_text(printed, encoding="utf-8")
        done.write_text(stamp, encoding="utf-8")
        return folder


def compare_part(name: str, old: Checkout, new: Checkout) -> list[Row]:
    """Runs a part in both checkouts and compares its files; its commands stand in the first row."""
    commands, files = PARTS[name]
    made = " and ".join(f"`gaitshift {command}`" for command in commands)
    try:
        before, after = old.run(name), new.run(name)
    except CommandFailedError as error:
        return [Row(name, "nothing", False, None, f"{error}; {made}")]
    rows: list[Row] = []
    for file in files:
        paths = before / file, after / new.renames.get(file, file)
        renames = LOG_RENAMES if file.endswith(".npz") else FIELD_RENAMES
        rows += compare_files(file, *paths, renames)
    return [rows[0]._replace(note="; ".join(filter(None, (rows[0].note, made)))), *rows[1:]]


def markdown(rows: list[Row]) -> str:
    """The rows as a table."""
    head = ("what", "compared", "equal", "largest difference", "note")
    lines = [head, ("---",) * len(head)]
    for row in rows:
        largest = "" if row.largest is None else f"{row.largest:.3g}"
        equal = "yes" if row.equal else "**no**"
        lines.append((row.what, row.compared, equal, largest, row.note.replace("|", "\\|")))
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def main() -> None:
    """Compares what is named, or all."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("old", type=Path)
    parser.add_argument("new", type=Path)
    parser.add_argument("--out", type=Path, default=Path("runs/compare"), help="kept results")
    parser.add_argument("--only", default=",".join(PARTS), help=f"of {', '.join(PARTS)}")
    given = parser.parse_args()
    names = given.only.split(",")
    unknown = [name for name in names if name not in PARTS]
    if unknown:
        parser.error(f"no part '{unknown[0]}'; parts are {', '.join(PARTS)}")
    for path in (given.old, given.new):
        if not (path / "src" / "gaitshift").is_dir():
            parser.error(f"{path} is no checkout: it lacks src/gaitshift")
    old = Checkout(given.old, given.out, {})
    new = Checkout(given.new, given.out, WORD_RENAMES)
    if old.folder == new.folder:
        parser.error(f"{old.path} and {new.path} are the same: {old.folder.name}")
    rows = [row for name in names for row in compare_part(name, old, new)]
    print(markdown(rows))
    sys.exit(0 if all(row.equal for row in rows) else 1)


if __name__ == "__main__":
    main()
