"""Reads TOML and JSON files within limits of size and depth, and tables in them key by key.

Errors name the place and what is allowed.
"""

import json
import math
import tomllib
import unicodedata
from collections.abc import Callable, Generator
from contextlib import contextmanager
from difflib import get_close_matches
from pathlib import Path
from reprlib import repr as shortened
from typing import cast

from gaitshift.errors import GaitshiftError

MOST_BYTES = 1 << 20
"""Size of the largest TOML or JSON file that is read [bytes]; ours: a hundred times that of any
file of the package."""

MOST_DEPTH = 20
"""Greatest depth of lists and tables inside each other; ours: files of the package have 6."""

MOST_LETTERS = 2000
"""Length of the longest text of a key [characters]; ours: a description is a few sentences."""

MOST_WHOLE = 1 << 53
"""Greatest whole number; up to it a float is exact."""


def bytes_in(path: Path, most: int) -> bytes:
    """The bytes of a file of at most this size; `GaitshiftError`, without its path, otherwise."""
    try:
        with path.open("rb") as file:
            data = file.read(most + 1)
    except FileNotFoundError:
        raise GaitshiftError("no such file") from None
    except OSError as error:
        raise GaitshiftError(f"the file cannot be read: {error.strerror}") from None
    if len(data) > most:
        raise GaitshiftError(f"the file must have {most} bytes or fewer")
    return data


def tables_in(path: Path) -> dict[str, object]:
    """The tables of a TOML file; `GaitshiftError`, without its path, where it cannot be read."""
    tables = _parsed(_text_in(path, "TOML"), tomllib.loads, "the file is not valid TOML")
    if not tables:
        raise GaitshiftError("the file is empty")
    return cast(dict[str, object], tables)


def json_in(path: Path) -> object:
    """The value in a JSON file; `GaitshiftError`, without its path, where it cannot be read."""
    return _parsed(_text_in(path, "JSON"), json.loads, "the file is not valid JSON")


def json_of(text: str) -> object:
    """The value of a JSON text; `GaitshiftError` where it is none, or too large or too deep."""
    if len(text) > MOST_BYTES:
        raise GaitshiftError(f"JSON must have {MOST_BYTES} characters or fewer, got {len(text)}")
    return _parsed(text, json.loads, "not valid JSON")


def _text_in(path: Path, kind: str) -> str:
    try:
        return bytes_in(path, MOST_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise GaitshiftError(
            f"the file must be {kind} in UTF-8, got bytes that are not UTF-8"
        ) from None


def _parsed(text: str, parse: Callable[[str], object], fault: str) -> object:
    try:
        value = parse(text)
    except ValueError as error:  # the parser's own, or a number of thousands of digits
        raise GaitshiftError(f"{fault}: {error}") from None
    except RecursionError:
        raise _too_deep() from None
    level = [value]
    for _ in range(MOST_DEPTH):
        level = [inner for outer in level for inner in _inside(outer)]
    if level:
        raise _too_deep()
    return value


def _inside(value: object) -> list[object]:
    """What a list or a table holds."""
    if isinstance(value, dict):
        return list(cast(dict[str, object], value).values())
    return cast(list[object], value) if isinstance(value, list) else []


def _too_deep() -> GaitshiftError:
    return GaitshiftError(f"lists and tables must be at most {MOST_DEPTH} inside each other")


def check_text(name: str, value: str) -> None:
    """`GaitshiftError` for a text that is too long, or that no terminal or page can show."""
    if len(value) > MOST_LETTERS:
        raise GaitshiftError(
            f"{name!r} must have {MOST_LETTERS} characters or fewer, got {len(value)}"
        )
    for letter in value:
        if unicodedata.category(letter) in ("Cc", "Cs") and letter not in "\n\t":
            raise GaitshiftError(f"{name!r} must be printable, got {shortened(ascii(value))}")


@contextmanager
def located(where: str) -> Generator[None]:
    """Put the place, such as "transition 2 (FL_BR -> FR_BL)", before any error raised inside."""
    try:
        yield
    except GaitshiftError as error:
        raise GaitshiftError(f"{where}: {error}") from None


def check_ranges(config: object, **ranges: tuple[float, float]) -> None:
    """`GaitshiftError` unless each field named is within its least and greatest value."""
    for name, (low, high) in ranges.items():
        value = getattr(config, name)
        if not low <= value <= high:
            raise GaitshiftError(f"{name} must be {low:.10g} to {high:.10g}, got {value}")


def known_names(kind: str, name: str, known: tuple[str, ...]) -> str:
    """One line that names the unknown name, a similar known name, and all known names."""
    close = get_close_matches(name, known, n=1)
    meant = f" did you mean {close[0]!r}?" if close else ""
    return f"unknown {kind} {name!r};{meant} known {kind}s: {', '.join(known)}"


class Table:
    """One table of a TOML file with known keys, whose values are read by type.

    Every method raises a `GaitshiftError` that names the key if the value is missing or of
    another type. A default makes the key optional.
    """

    def __init__(self, data: object, *, keys: tuple[str, ...]):
        if not isinstance(data, dict):
            raise GaitshiftError(f"must be a table of keys and values, got {shortened(data)}")
        self._values = cast(dict[str, object], data)
        for key in self._values:
            if key not in keys:
                raise GaitshiftError(known_names("key", str(key), keys))

    def has(self, key: str) -> bool:
        """Whether the key is given."""
        return key in self._values

    def get(self, key: str) -> object:
        """Return the value, of any type."""
        if key not in self._values:
            raise GaitshiftError(f"key {key!r} is missing")
        return self._values[key]

    def text(self, key: str) -> str:
        """Return a string that is not empty."""
        value = self.get(key)
        if not isinstance(value, str) or not value.strip():
            raise _wrong(key, "a text", value)
        check_text(key, value)
        return value

    def flag(self, key: str, *, default: bool) -> bool:
        """Return true or false."""
        value = self._values.get(key, default)
        if not isinstance(value, bool):
            raise _wrong(key, "true or false", value)
        return value

    def whole(self, key: str, *, default: int | None = None) -> int:
        """Return a whole number."""
        value = self.get(key) if default is None else self._values.get(key, default)
        if not isinstance(value, int) or isinstance(value, bool):
            raise _wrong(key, "a whole number", value)
        if not abs(value) <= MOST_WHOLE:
            raise _wrong(key, f"a whole number of at most {MOST_WHOLE}", value)
        return value

    def number(self, key: str, *, default: float | None = None) -> float:
        """Return a finite number, whole or not."""
        value = self.get(key) if default is None else self._values.get(key, default)
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise _wrong(key, "a number", value)
        try:
            number = float(value)
        except OverflowError:
            raise _wrong(key, "a number of at most 1e308", value) from None
        if not math.isfinite(number):
            raise _wrong(key, "a finite number", value)
        return number

    def pair(self, key: str, *, default: tuple[float, float]) -> tuple[float, float]:
        """Return two numbers, the lower and the upper end of a range."""
        wanted = "two numbers, such as [0.4, 1.6]"
        ends: list[object] = self._list(key, wanted) if self.has(key) else [*default]
        if len(ends) != 2:
            raise _wrong(key, wanted, ends)
        low, high = self._numbers(key, ends, wanted)
        return low, high

    def numbers(self, key: str, count: int, wanted: str) -> tuple[float, ...]:
        """Return a list of `count` numbers; `wanted` describes them in errors."""
        values = self._list(key, wanted)
        if len(values) != count:
            raise _wrong(key, wanted, values)
        return tuple(self._numbers(key, values, wanted))

    def feet(self, key: str) -> frozenset[str]:
        """Return a list of feet, each named once."""
        names = self._list(key, 'a list of feet, such as ["FL", "BR"]')
        for name in names:
            if not isinstance(name, str):
                raise _wrong(key, 'a list of feet, such as ["FL", "BR"]', names)
            if names.count(name) > 1:
                raise GaitshiftError(f"{key!r} must name each foot once, got {name} twice")
        return frozenset(cast(list[str], names))

    def table(self, key: str) -> dict[str, object]:
        """Return a table of unread tables, [key.NAME] in TOML."""
        value = self.get(key)
        if isinstance(value, dict) and value:
            return cast(dict[str, object], value)
        raise _wrong(key, f"tables with names, [{key}.NAME]", cast(object, value))

    def points(self, key: str) -> tuple[tuple[float, float], ...]:
        """Return a list of pairs of numbers."""
        wanted = "pairs of numbers, such as [[0.4, 0.8], [1.2, 1.0]]"
        pairs = self._list(key, wanted)
        for pair in pairs:
            if not isinstance(pair, list) or len(cast(list[object], pair)) != 2:
                raise _wrong(key, wanted, pairs)
        read = (self._numbers(key, cast(list[object], pair), wanted) for pair in pairs)
        return tuple((first, second) for first, second in read)

    def tables(self, key: str) -> list[object]:
        """Return a list of unread tables, [[key]] in TOML."""
        return self._list(key, f"a list of tables, [[{key}]]")

    @staticmethod
    def _numbers(key: str, values: list[object], wanted: str) -> list[float]:
        if not all(type(value) in (int, float) for value in values):
            raise _wrong(key, wanted, values)
        try:
            numbers = [float(value) for value in cast(list[float], values)]
        except OverflowError:
            raise _wrong(key, "numbers of at most 1e308", values) from None
        if not all(map(math.isfinite, numbers)):
            raise _wrong(key, "finite numbers", values)
        return numbers

    def _list(self, key: str, wanted: str) -> list[object]:
        value = self.get(key)
        if not isinstance(value, list):
            raise _wrong(key, wanted, value)
        return cast(list[object], value)


def _wrong(key: str, wanted: str, value: object) -> GaitshiftError:
    return GaitshiftError(f"{key!r} must be {wanted}, got {shortened(value)}")
