"""Compares two checkouts of the project value by value, as before and after a refactoring.

Usage: python tools/compare_checkouts.py OLD NEW [--out DIR] [--only PART,PART,…]

The code of both runs the same commands (`PARTS`) with the same interpreter; then their logs,
tables, reports and networks are compared: same types, shapes and values. It takes about two
minutes a checkout. Results of a commit without local changes are kept below `--out`, so that it
runs once. Prints a Markdown table; exit code 1 if anything differs or a command fails.
What has another name in the new checkout stands in the tables of renames.
"""

import argparse
import csv
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

Arrays = dict[str, np.ndarray]
Renames = Mapping[str, str | Callable[[Arrays], np.ndarray]]

LOG_RENAMES: Renames = {}
"""Arrays of logs: the old name, and the new one or the old array out of the new log."""
FIELD_RENAMES: Renames = {}
"""The same for columns of tables, fields of JSON (`verdict.clean`) and networks' initialisers."""
WORD_RENAMES: Mapping[str, str] = {}
"""Words of `PARTS`, and what the new checkout's commands call them."""
IGNORED = ("wall_s", "policy")
"""Fields that always differ: the clock's, and the path of the policy's file."""

RECORDED = ("flat", "up-10", "into-0.10")
LOGS = [f"logs/trot-{course}-0.npz" for course in RECORDED]


class Part(NamedTuple):
    """Commands that run in a folder of their own, and the files that are compared then.

    What a command prints is in NAME.json.
    """

    commands: tuple[str, ...]
    files: tuple[str, ...]


PARTS = {
    "demo": Part(("demo --no-video --json --out demo",), ("demo/log.npz", "demo.json")),
    "evaluate": Part(("evaluate trot --episodes 32 --seconds 8 --json",), ("evaluate.json",)),
    "train": Part(
        ("train trot --iterations 20 --threads 1 --json --out train",),
        ("train/progress.csv", "train/policy.onnx"),
    ),
    "identify": Part(
        (
            f"record trot --courses {' '.join(RECORDED)} --robots 4 --seconds 12 --out logs",
            f"identify {' '.join(LOGS)} --condition touchdown_surprise --out report",
        ),
        (*LOGS, *(f"report/{name}" for name in ("conditions.csv", "courses.csv", "README.md"))),
    ),
}


# Running ------------------------------------------------------------------------------------------


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
        done = subprocess.run(["git", "-C", self.path, *words], capture_output=True, text=True)
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
        )
        if done.returncode:
            last = done.stderr.strip().splitlines()[-1:] or [f"exit code {done.returncode}"]
            raise CommandFailedError(f"{self.path}: {last[0]}")
        return done.stdout

    def run(self, name: str) -> Path:
        """Runs a part, if its results are not kept; gives their folder."""
        folder, part = self.folder / name, PARTS[name]
        commands = [
            [self.renames.get(word, word) for word in command.split()] for command in part.commands
        ]
        packages = ("numpy", "mujoco-core", "onnxruntime", "torch", "rsl-rl-lib")
        versions = {package: version(package) for package in packages}
        stamp = json.dumps({"commands": commands, "python": sys.executable, **versions})
        done = folder / "done.json"
        if self.clean and done.is_file() and done.read_text() == stamp:
            return folder
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        source = self.python("-c", "import gaitshift; print(gaitshift.__file__)", cwd=folder)
        if not Path(source.strip()).is_relative_to(self.path):
            raise CommandFailedError(f"{self.path}: the package comes from {source.strip()}")
        for words in commands:
            print(f"{self.path}: gaitshift {' '.join(words)}", file=sys.stderr, flush=True)
            printed = self.python("-m", "gaitshift", *words, cwd=folder)
            (folder / f"{words[0]}.json").write_text(printed)
        done.write_text(stamp)
        return folder


# Reading ------------------------------------------------------------------------------------------


def read_log(path: Path) -> Arrays:
    """Arrays of an npz file."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def read_table(path: Path) -> Arrays:
    """Columns of a CSV file, as text."""
    with path.open(newline="") as file:
        lines = csv.DictReader(file)
        rows = list(lines)
    return {name: np.array([row[name] for row in rows], str) for name in lines.fieldnames or ()}


def read_json(path: Path) -> Arrays:
    """Values of a JSON object by the names that lead to them, such as `verdict.clean`, as text."""
    found: Arrays = {}

    def walk(value: Any, name: str) -> None:
        if isinstance(value, dict | list):
            within = value.items() if isinstance(value, dict) else enumerate(value)
            for key, one in within:
                walk(one, f"{name}.{key}" if name else str(key))
        else:
            found[name] = np.array(json.dumps(value))

    walk(json.loads(path.read_text()), "")
    return found


def read_network(path: Path) -> Arrays:
    """Initialisers of an ONNX file."""
    import onnx

    graph = onnx.load(path).graph
    return {one.name: onnx.numpy_helper.to_array(one) for one in graph.initializer}


READERS: dict[str, tuple[str, Callable[[Path], Arrays]]] = {
    ".npz": ("arrays", read_log),
    ".csv": ("columns", read_table),
    ".json": ("fields", read_json),
    ".onnx": ("initialisers", read_network),
    ".md": ("text", lambda path: {"lines": np.array(path.read_text().splitlines(), str)}),
}


# Comparing ----------------------------------------------------------------------------------------


class Row(NamedTuple):
    """A line of the table."""

    what: str
    compared: str
    equal: bool
    largest: float | None
    """Absolute difference; None where nothing numeric differs."""
    note: str = ""
    first: tuple[int, ...] | None = None
    """Index of the first value that differs; a log's begins with the step."""


def renamed(new: Arrays, renames: Renames) -> Arrays:
    """The new arrays by their old names; what the renames do not know keeps its name."""
    taken = {source for source in renames.values() if isinstance(source, str)}
    found = {name: array for name, array in new.items() if name not in taken}
    for name, source in renames.items():
        with suppress(KeyError):  # a new log that has other arrays: listed as in the old one alone
            found[name] = new[source] if isinstance(source, str) else source(new)
    return found


def compare_array(what: str, old: np.ndarray, new: np.ndarray) -> Row:
    """Types, shapes and values; NaN equals NaN. Of other lengths, as far as both go."""
    compared, notes = f"{old.size} values", []
    if old.dtype != new.dtype and not old.dtype.kind == new.dtype.kind == "U":
        notes.append(f"type {old.dtype}, now {new.dtype}")
    if old.shape != new.shape:
        notes.append(f"shape {old.shape}, now {new.shape}")
        if old.ndim == 0 or new.ndim == 0 or old.shape[1:] != new.shape[1:]:
            return Row(what, compared, False, None, "; ".join(notes))
        both = min(len(old), len(new))
        old, new = old[:both], new[:both]
    unequal = np.asarray(old != new)
    if old.dtype.kind == new.dtype.kind == "f":
        unequal &= ~(np.isnan(old) & np.isnan(new))
    if not unequal.any():
        return Row(what, compared, not notes, None if notes else 0.0, "; ".join(notes))
    first = tuple(int(i) for i in np.argwhere(unequal)[0])
    notes.append(f"first at {list(first)}: {old[first]}, now {new[first]}")
    largest = None
    with suppress(ValueError):  # text that is no number
        largest = float(np.abs(old[unequal].astype(float) - new[unequal].astype(float)).max())
    return Row(what, compared, False, largest, "; ".join(notes), first)


def compare(what: str, kind: str, old: Arrays, new: Arrays) -> list[Row]:
    """A row on all that both have, then one on each array that differs."""
    shared = [name for name in old if name in new and name not in IGNORED]
    each = [compare_array(f"{what}: {name}", old[name], new[name]) for name in shared]
    differing = [row for row in each if not row.equal]
    notes = [f"{len(differing)} differ"] if differing else []
    for side, mine, other in (("old", old, new), ("new", new, old)):
        alone = [name for name in mine if name not in other and name not in IGNORED]
        notes += [f"only in {side}: {', '.join(alone)}"] if alone else []
    numbers = [row.largest for row in each if row.largest is not None]
    largest = float(np.max(numbers)) if numbers else None
    equal = bool(shared) and not differing
    return [Row(what, f"{len(shared)} {kind}", equal, largest, "; ".join(notes)), *differing]


def shifts(log: Arrays) -> list[tuple[int, int, str]]:
    """Step, robot and next gait of every shift in a log."""
    gait, names = log["gait"], log["gaits"]
    return [(t + 1, i, str(names[gait[t + 1, i]])) for t, i in np.argwhere(np.diff(gait, axis=0))]


def compare_logs(what: str, old: Arrays, new: Arrays) -> list[Row]:
    """As `compare`, with the first step that differs; then the shifts, where both tell of them."""
    whole, *differing = compare(what, "arrays", old, new)
    over_time = [row for row in differing if not row.what.startswith(f"{what}: terrain")]
    steps = [row.first[0] for row in over_time if row.first]
    if steps:
        whole = whole._replace(note=f"{whole.note}; first at step {min(steps)}")
    rows = [whole, *differing]
    if {"gait", "gaits"} <= old.keys() & new.keys():
        before, after = (
            [f"step {t} robot {i} to {gait}" for t, i, gait in shifts(log)] for log in (old, new)
        )
        told = ", ".join(before) or "none"
        if before != after:
            told = f"{told}; now {', '.join(after) or 'none'}"
        rows.append(Row(f"{what}: shifts", f"{len(before)} shifts", before == after, None, told))
    return rows


def compare_files(file: str, old: Path, new: Path) -> list[Row]:
    """Rows on a file that both folders have."""
    missing = [str(folder / file) for folder in (old, new) if not (folder / file).is_file()]
    if missing:
        return [Row(file, "nothing", False, None, f"no file {' and '.join(missing)}")]
    kind, read = READERS[Path(file).suffix]
    before, after = read(old / file), read(new / file)
    if kind == "arrays":
        return compare_logs(file, before, renamed(after, LOG_RENAMES))
    return compare(file, kind, before, renamed(after, FIELD_RENAMES))


def compare_part(name: str, old: Checkout, new: Checkout) -> list[Row]:
    """Runs a part in both checkouts and compares its files; its commands stand in the first row."""
    made = " and ".join(f"`gaitshift {command}`" for command in PARTS[name].commands)
    try:
        folders = old.run(name), new.run(name)
    except CommandFailedError as error:
        return [Row(name, "nothing", False, None, f"{error}; {made}")]
    rows = [row for file in PARTS[name].files for row in compare_files(file, *folders)]
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
