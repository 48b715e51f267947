"""Reads logs, tables, reports and networks as named arrays, and finds the values that differ."""

import csv
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

Arrays = dict[str, np.ndarray]
Renames = Mapping[str, str | Callable[[Arrays], np.ndarray]]
"""Of an old name: the new one, or the old array out of the new ones."""
IGNORED = ("wall_s", "policy")
"""Fields that always differ: the clock's, and the path of the policy's file."""

# Reading ------------------------------------------------------------------------------------------


def read_log(path: Path) -> Arrays:
    """Arrays of an npz file."""
    with np.load(path) as file:
        return {name: file[name] for name in file.files}


def read_table(path: Path) -> Arrays:
    """Columns of a CSV file, as text."""
    with path.open(newline="", encoding="utf-8") as file:
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

    walk(json.loads(path.read_text(encoding="utf-8")), "")
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
    ".md": (
        "text",
        lambda path: {"lines": np.array(path.read_text(encoding="utf-8").splitlines(), str)},
    ),
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
    place = f"first at {list(first)}: " if first else ""
    notes.append(f"{place}{old[first]}, now {new[first]}")
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


def shifts(log: Arrays) -> list[str]:
    """Step, robot and next gait of every shift in a log."""
    gait, names = log["gait"], log["gaits"]
    found = np.argwhere(np.diff(gait, axis=0))
    return [f"step {t + 1} robot {i} to {names[gait[t + 1, i]]}" for t, i in found]


def compare_logs(what: str, old: Arrays, new: Arrays) -> list[Row]:
    """As `compare`, with the first step that differs; then the shifts, where both have them."""
    whole, *differing = compare(what, "arrays", old, new)
    timeless = tuple(f"{what}: {name}" for name in ("terrain", "gaits"))
    over_time = [row for row in differing if not row.what.startswith(timeless)]
    steps = [row.first[0] for row in over_time if row.first]
    if steps:
        note = f"{whole.note}; first at step {min(steps)}"
        whole = whole._replace(note=note, first=(min(steps),))
    if not {"gait", "gaits"} <= old.keys() & new.keys():
        return [whole, *differing]
    before, after = shifts(old), shifts(new)
    note = ", ".join(before) or "none"
    if before != after:
        note = f"{note}; now {', '.join(after) or 'none'}"
    told = Row(f"{what}: shifts", f"{len(before)} shifts", before == after, None, note)
    return [whole, *differing, told]


def compare_files(what: str, old: Path, new: Path, renames: Renames) -> list[Row]:
    """Rows on a file, which is an npz, CSV, JSON, ONNX or Markdown file by its name."""
    missing = [str(path) for path in (old, new) if not path.is_file()]
    if missing:
        return [Row(what, "nothing", False, None, f"no file {' and '.join(missing)}")]
    kind, read = READERS[old.suffix]
    before, after = read(old), renamed(read(new), renames)
    if kind == "arrays":
        return compare_logs(what, before, after)
    return compare(what, kind, before, after)
