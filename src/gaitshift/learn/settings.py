"""Settings of a recipe from a file and from the command line, and their difference to a default."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any, cast

from gaitshift.data import known_names, located, tables_in
from gaitshift.errors import GaitshiftError
from gaitshift.learn.recipe import Recipe, Stage


def with_file(recipe: Recipe, path: Path) -> Recipe:
    """The recipe with the settings of a TOML file, such as `[ppo]` and `epochs = 3`.

    Raises:
        GaitshiftError: the file cannot be read, or a setting is unknown or has a wrong value.
    """
    with located(str(path)):
        return _with_tables(recipe, tables_in(path), ())


def with_settings(recipe: Recipe, settings: Sequence[str]) -> Recipe:
    """The recipe with settings such as `ppo.epochs=3` or `stages.flat.iterations=200`.

    A value is written as in TOML; a text may be without quotes. `reward` means `env.reward`.

    Raises:
        GaitshiftError: a setting is unknown or has a wrong value.
    """
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise GaitshiftError(f"a setting must be NAME=VALUE, got '{setting}'")
        recipe = _with(recipe, tuple(name.strip().split(".")), _value(text.strip()), name.strip())
    return recipe


def differences(recipe: Recipe, default: Recipe) -> dict[str, tuple[Any, Any]]:
    """The settings that differ, each with its value and that of the default (None: no such stage).

    Their names are those of `with_settings`.
    """
    ours, theirs = _flat(recipe, ""), _flat(default, "")
    return {
        name: (ours.get(name), theirs.get(name))
        for name in dict.fromkeys((*theirs, *ours))
        if ours.get(name) != theirs.get(name)
    }


def _with_tables(recipe: Recipe, tables: Mapping[str, Any], names: tuple[str, ...]) -> Recipe:
    for name, value in tables.items():
        path = (*names, name)
        if isinstance(value, dict):
            recipe = _with_tables(recipe, cast("dict[str, Any]", value), path)
        else:
            recipe = _with(recipe, path, value, ".".join(path))
    return recipe


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _with(recipe: Recipe, names: tuple[str, ...], value: Any, where: str) -> Recipe:
    if names[0] == "reward":
        names = ("env", *names)
    return _changed(recipe, names, value, where)


def _changed(part: Any, names: tuple[str, ...], value: Any, where: str) -> Any:
    """A part of a recipe with the setting at `names` changed; `where` names it in errors."""
    if not names:
        return _checked(part, value, where)
    first, rest = names[0], names[1:]
    if _is_stages(part):
        known = tuple(stage.name for stage in part)
        if first not in known:
            raise GaitshiftError(known_names("stage", first, known))
        return tuple(_changed(s, rest, value, where) if s.name == first else s for s in part)
    known = tuple(field.name for field in fields(part)) if is_dataclass(part) else ()
    if first not in known:
        if not known:
            raise GaitshiftError(f"'{where}' is no setting: '{first}' is below a single value")
        raise GaitshiftError(f"{where}: {known_names('setting', first, known)}")
    changed = _changed(getattr(part, first), rest, value, where)
    try:
        return replace(cast(Any, part), **{first: changed})
    except GaitshiftError as error:
        raise GaitshiftError(f"{where}: {error}") from None


def _checked(old: Any, value: Any, where: str) -> Any:
    """The value, if it is of the kind of the old one."""
    if is_dataclass(old) or _is_stages(old):
        raise GaitshiftError(f"'{where}' has settings of its own, got the single value {value!r}")
    if isinstance(old, tuple):
        items: list[Any] = cast("list[Any]", value) if isinstance(value, list) else [value]
        first = cast("tuple[Any, ...]", old)[0]
        return tuple(_checked(first, item, where) for item in items)
    if isinstance(old, bool) or isinstance(value, bool):
        fits, wanted = isinstance(old, bool) and isinstance(value, bool), "true or false"
        wanted = wanted if isinstance(old, bool) else "a number"
    elif isinstance(old, int):
        fits, wanted = isinstance(value, int), "a whole number"
    elif isinstance(old, str):
        fits, wanted = isinstance(value, str), "a text"
    else:
        fits, wanted = isinstance(value, int | float) and isfinite(value), "a finite number"
        value = float(value) if fits else value
    if not fits:
        raise GaitshiftError(f"{where} must be {wanted}, got {value!r}")
    return value


def _is_stages(part: Any) -> bool:
    items: tuple[Any, ...] = cast("tuple[Any, ...]", part) if isinstance(part, tuple) else ()
    return bool(items) and isinstance(items[0], Stage)


def _flat(part: Any, name: str) -> dict[str, Any]:
    """All settings by name."""
    if _is_stages(part):
        inner: dict[str, Any] = {stage.name: stage for stage in part}
    elif is_dataclass(part):
        inner = {field.name: getattr(part, field.name) for field in fields(part)}
    else:
        return {name.removeprefix("env.") if name.startswith("env.reward.") else name: part}
    found: dict[str, Any] = {}
    for key, value in inner.items():
        found |= _flat(value, f"{name}.{key}" if name else key)
    return found
