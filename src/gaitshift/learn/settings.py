"""Settings of a recipe from a file and from the command line, and their difference to a default."""

import tomllib
from collections.abc import Sequence
from dataclasses import fields, is_dataclass, replace
from math import isfinite
from pathlib import Path
from typing import Any, cast, get_args, get_type_hints

from gaitshift.data import known_names, located, tables_in
from gaitshift.errors import GaitshiftError
from gaitshift.learn.recipe import Recipe, Stage
from gaitshift.sim.sensor_config import SensorConfig, sensor_preset


def with_settings(recipe: Recipe, settings: Sequence[str] = (), file: Path | None = None) -> Recipe:
    """The recipe with other settings: first those of a TOML file, then those of a command line.

    A file has tables such as `[ppo]` with `epochs = 3`; a command line has `ppo.epochs=3` or
    `stages.flat.iterations=200`, with values as in TOML, where a text may be without quotes.
    `reward` means `env.reward`. All apply at once, so their order does not matter.

    Raises:
        GaitshiftError: the file cannot be read, or a setting is unknown or has a wrong value.
    """
    if file is not None:
        with located(str(file)):
            recipe = _changed(recipe, _without_short_names(tables_in(file)), "")
    tree: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise GaitshiftError(f"a setting must be NAME=VALUE, got '{setting}'")
        _plant(tree, [part.strip() for part in name.split(".")], _value(text.strip()))
    return _changed(recipe, _without_short_names(tree), "")


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


def _plant(tree: dict[str, Any], names: Sequence[str], value: Any) -> None:
    """Puts a value into nested tables; `GaitshiftError` where it is given twice."""
    for depth, name in enumerate(names[:-1], start=1):
        below: Any = tree.setdefault(name, {})
        if not isinstance(below, dict):
            raise GaitshiftError(f"{'.'.join(names[:depth])} and {'.'.join(names)} contradict")
        tree = cast("dict[str, Any]", below)
    if names[-1] in tree:
        raise GaitshiftError(f"{'.'.join(names)} must be given once")
    tree[names[-1]] = value


def _without_short_names(tree: dict[str, Any]) -> dict[str, Any]:
    """Nested tables with `env.reward` in place of `reward`."""
    tree = dict(tree)
    reward, env = tree.pop("reward", None), tree.get("env", {})
    if reward is None or not isinstance(env, dict):
        return tree
    if "reward" in env:
        raise GaitshiftError("reward must be given once, got reward and env.reward")
    return tree | {"env": {**cast("dict[str, Any]", env), "reward": reward}}


def _value(text: str) -> Any:
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _changed(part: Any, value: Any, where: str) -> Any:
    """A part of a recipe with the values of nested tables; `where` names it in errors."""
    if not isinstance(value, dict):
        return _checked(part, value, where)
    tables = cast("dict[str, Any]", value)
    if _is_stages(part):
        inner: dict[str, Any] = {stage.name: stage for stage in part}
    elif is_dataclass(part):
        inner = {field.name: getattr(part, field.name) for field in fields(part)}
    else:
        raise GaitshiftError(f"{where} must be a single value, got settings of its own")
    kind, dot = "stage" if _is_stages(part) else "setting", f"{where}." if where else ""
    new: dict[str, Any] = {}
    for name, below in tables.items():
        if name not in inner:
            place = f"{where}: " if where else ""
            raise GaitshiftError(f"{place}{known_names(kind, name, tuple(inner))}")
        new[name] = _changed(inner[name], below, f"{dot}{name}")
        choices = () if _is_stages(part) else get_args(get_type_hints(cast(Any, type(part)))[name])
        if isinstance(inner[name], str) and choices and new[name] not in choices:
            raise GaitshiftError(
                f"{dot}{name} must be one of {', '.join(choices)}, got {new[name]!r}"
            )
    if _is_stages(part):
        return tuple((inner | new).values())
    try:
        return replace(cast(Any, part), **new)
    except GaitshiftError as error:
        raise GaitshiftError(f"{dot}{error}") from None  # which begins with the setting's name


def _checked(old: Any, value: Any, where: str) -> Any:
    """The value, if it is of the kind of the old one; sensors may be given by their preset."""
    if isinstance(old, SensorConfig) and isinstance(value, str):
        with located(where):
            return sensor_preset(value)
    if is_dataclass(old) or _is_stages(old):
        raise GaitshiftError(f"{where} has settings of its own, got the single value {value!r}")
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
