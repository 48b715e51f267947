"""Steps of a task whose results are kept as arrays and JSON, so that a killed task resumes."""

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, cast

import numpy as np

from gaitshift.whole_file import replacing

FORMAT = 1
"""Increased when a file of another layout could be misread."""

PACKAGE = Path(__file__).parents[2]
"""Folder of the code on which kept results depend."""

Found = TypeVar("Found")
Stamp = tuple[str, int, int]


@dataclass(frozen=True)
class Form(Generic[Found]):
    """How results of a kind are written as plain data, and read from it."""

    plain: Callable[[Found], Any]
    """Gives numbers, texts, lists, arrays, and dicts by text."""
    result: Callable[[Any], Found]
    """The inverse; any error where the data is of another kind."""


class StepCache:
    """Steps of a task, each done once, even if the process ends in between.

    A step is repeated if its inputs or the code of this package have changed, or its file is
    damaged. A file holds one npz archive: `text`, a JSON text with `format`, `key` and `result`,
    and the arrays of the result, which stand in the text as {"array": number}. Nothing in a file
    is run.
    """

    def __init__(self, folder: Path, report: Callable[[str], None]) -> None:
        """Keeps results in `folder`; `report` is called with the name of each step."""
        self._folder = folder
        self._code = _code()
        self._report = report

    def get(
        self,
        name: str,
        depends_on: Sequence[Any],
        form: Form[Found],
        work: Callable[[], Found],
    ) -> Found:
        """The result of a step, from its file if there is one.

        Args:
            name: passed to `report`.
            depends_on: names, numbers and stamps of files: all inputs of the step.
            form: how the result is kept.
            work: computes the result.
        """
        key = repr((self._code, name, *depends_on))
        path = self._folder / f"{hashlib.sha256(key.encode()).hexdigest()[:32]}.npz"
        if path.is_file():
            try:
                found = form.result(_read(path, key))
            except Exception:  # whatever is wrong with the file: its step is done again
                pass
            else:
                self._report(f"{name} (cached)")
                return found
        self._report(name)
        found = work()
        self._folder.mkdir(parents=True, exist_ok=True)
        _write(path, key, form.plain(found))
        return found


def stamp(path: Path) -> Stamp:
    """A stamp that differs between files, and between versions of a file."""
    status = path.stat()
    return str(path.resolve()), status.st_size, status.st_mtime_ns


def _write(path: Path, key: str, plain: Any) -> None:
    arrays: dict[str, Any] = {}

    def put_aside(value: Any) -> Any:
        if isinstance(value, np.generic):
            return cast(Any, value).item()
        arrays[f"array_{len(arrays)}"] = value
        return {"array": len(arrays) - 1}

    text = json.dumps({"format": FORMAT, "key": key, "result": plain}, default=put_aside)
    with replacing(path) as part, part.open("wb") as file:
        np.savez_compressed(file, text=np.frombuffer(text.encode(), np.uint8), **arrays)


def _read(path: Path, key: str) -> Any:
    with path.open("rb") as file:
        archive: Any = np.load(file, allow_pickle=False)

        def put_back(entry: dict[str, Any]) -> Any:
            is_array = list(entry) == ["array"] and type(entry["array"]) is int
            found: Any = archive[f"array_{entry['array']}"] if is_array else entry
            return found

        kept: dict[str, Any] = json.loads(archive["text"].tobytes(), object_hook=put_back)
    if (kept["format"], kept["key"]) != (FORMAT, key):
        raise ValueError("the file is of another format or step")
    return kept["result"]


def _code() -> str:
    """Fingerprint of this package's code: results of other code are not reused."""
    fingerprint = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        fingerprint.update(path.read_bytes())
    return fingerprint.hexdigest()
