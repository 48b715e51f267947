"""What a Markdown page holds: its links, tables, lists and code, by a parser."""

from collections.abc import Iterator
from pathlib import Path

from markdown_it import MarkdownIt
from markdown_it.token import Token

PARSER = MarkdownIt("commonmark").enable("table")


def tokens(page: Path) -> Iterator[Token]:
    """All tokens of a page, those within a line among them."""
    for token in PARSER.parse(page.read_text(encoding="utf-8")):
        yield token
        yield from token.children or ()


def links(page: Path) -> set[str]:
    """The files that a page links to or shows, without addresses elsewhere and places on it."""
    found = (token.attrGet("href") or token.attrGet("src") for token in tokens(page))
    here = (str(link).split("#")[0] for link in found if link and "://" not in str(link))
    return {link for link in here if link}


def codes(page: Path) -> list[str]:
    """The texts in backticks, in their order."""
    return [token.content for token in tokens(page) if token.type == "code_inline"]


def fences(page: Path) -> list[tuple[str, str]]:
    """The blocks of code, in their order: what follows the fence, and the text."""
    return [(token.info, token.content) for token in tokens(page) if token.type == "fence"]


def rows(page: Path) -> list[list[list[Token]]]:
    """The rows below the heads of all tables: each a list of cells, a cell a list of tokens."""
    found: list[list[list[Token]]] = []
    inside = ""
    for token in PARSER.parse(page.read_text(encoding="utf-8")):
        inside = {"tbody_open": "body", "tbody_close": ""}.get(token.type, inside)
        if inside and token.type == "tr_open":
            found.append([])
        elif inside and token.type == "inline":
            found[-1].append(token.children or [])
    return found


def items(page: Path) -> list[list[Token]]:
    """The entries of all lists, each a list of tokens."""
    found: list[list[Token]] = []
    depth = 0
    for token in PARSER.parse(page.read_text(encoding="utf-8")):
        depth += {"list_item_open": 1, "list_item_close": -1}.get(token.type, 0)
        if depth and token.type == "inline":
            found.append(token.children or [])
    return found
