"""docs/paper.md: every file, symbol, command, option and test that it names in backticks exists."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from pages import codes

ROOT = Path(__file__).parent.parent
PAGE = ROOT / "docs" / "paper.md"
SOURCE = ROOT / "src"
HAVING_FILES = ("src", "tests", "docs", "examples", "tools")

NAMES = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")


def named_in(tree: ast.AST) -> Iterator[tuple[str, ...]]:
    """What is defined in a module, class or function: names, and names below names."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield (node.name,)
            yield from ((node.name, *rest) for rest in named_in(node))
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from ((target.id,) for target in targets if isinstance(target, ast.Name))
        elif isinstance(node, ast.ImportFrom):
            yield from ((alias.asname or alias.name,) for alias in node.names)
        elif isinstance(node, ast.arguments):
            every = (*node.posonlyargs, *node.args, *node.kwonlyargs)
            yield from ((argument.arg,) for argument in every)


@cache
def symbols() -> frozenset[str]:
    """Dotted names of all that the package defines, inherited members too, and their ends."""
    found: set[str] = set()
    bases: list[tuple[str, str]] = []
    for path in SOURCE.rglob("*.py"):
        module = path.relative_to(SOURCE).with_suffix("").parts
        module = module[:-1] if module[-1] == "__init__" else module
        tree = ast.parse(path.read_text(encoding="utf-8"))
        for name in ((), *named_in(tree)):
            whole = (*module, *name)
            found |= {".".join(whole[start:]) for start in range(len(whole))}
        classes = (node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))
        bases += [(c.name, b.id) for c in classes for b in c.bases if isinstance(b, ast.Name)]
    for heir, base in bases:
        own = (name.removeprefix(base) for name in found if name.startswith(f"{base}."))
        found |= {heir + member for member in tuple(own)}
    return frozenset(found)


@cache
def strings() -> frozenset[str]:
    """Every string that stands in the package's source by itself: modes, presets, file names."""
    trees = (ast.parse(path.read_text(encoding="utf-8")) for path in SOURCE.rglob("*.py"))
    constants = (n.value for t in trees for n in ast.walk(t) if isinstance(n, ast.Constant))
    return frozenset(value for value in constants if isinstance(value, str))


@cache
def names_of_tests() -> frozenset[str]:
    """The names of all tests."""
    trees = (ast.parse(p.read_text(encoding="utf-8")) for p in (ROOT / "tests").rglob("*.py"))
    defined = (n.name for t in trees for n in ast.walk(t) if isinstance(n, ast.FunctionDef))
    return frozenset(name for name in defined if name.startswith("test_"))


def is_file(text: str) -> bool:
    """Whether a file or folder of the repository has this path, or one that ends with it."""
    name = text.rstrip("/")
    below = (path for part in HAVING_FILES for path in (ROOT / part).rglob(Path(name).name))
    return (ROOT / name).exists() or any(f"/{p.as_posix()}".endswith(f"/{name}") for p in below)


def exists(text: str) -> bool:
    """Whether the package has what a text in backticks names."""
    if text.startswith("test_") and not text.endswith(".py"):
        return text in names_of_tests()
    if text.startswith("gaitshift "):
        command, *rest = text.split()[1:]
        options = [word for word in rest if word.startswith("--")]
        return f"cli.{command}" in symbols() and all(map(exists, options))
    if text.startswith("--"):
        return text.split()[0].removeprefix("--").replace("-", "_") in symbols()
    if "/" in text or text.endswith((".py", ".toml", ".xml", ".md")):
        return is_file(text)
    name = NAMES.match(text)
    rest = text[name.end() :] if name else text
    is_name = name is not None and (rest in ("", "()") or rest[0] in "=:")
    return text in strings() or (is_name and name[0] in symbols())


@pytest.mark.parametrize("text", sorted(set(codes(PAGE))))
def test_what_the_page_on_the_paper_names_is_there(text):
    assert exists(text)


@pytest.mark.parametrize(
    "text",
    [
        "test_that_nobody_wrote",
        "gaitshift fly",
        "gaitshift train --no-such-option",
        "reward/nowhere.py",
        "RewardMachine.no_such_method",
        "nowhere.RewardMachine",
        "no_such_symbol()",
    ],
)
def test_what_is_not_there_is_found_missing(text):
    assert not exists(text)
