"""The page of a report: one self-contained HTML file that opens from disk."""

import html
import json
import re
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

from gaitshift.whole_file import write_text

Row = tuple[Sequence[str], float | None]
"""Cells of a row, and the time to which a click on it seeks [s]."""


def write_page(
    path: Path,
    *,
    title: str,
    summary: str,
    sections: Sequence[tuple[str, str]],
    walks: Sequence[tuple[str, Mapping[str, Any]]] = (),
    course: Mapping[str, Any] | None = None,
    figures: Mapping[str, Mapping[str, Any]] | None = None,
) -> None:
    """Writes a page, whole or not at all.

    Args:
        path: the HTML file.
        title: its heading.
        summary: a line below it.
        sections: headings and HTML, from the top down; empty ones are left out.
        walks: names and data (`run_data`) of what the player shows, which stands first; several are
            chosen from. Without any there is no player.
        course: charts that are not over time, before the sections.
        figures: data (`report.figures`) of the figures in the sections, where `figure` put them;
            for pages without a player.
    """
    shown = [(head, content) for head, content in sections if content]
    body = "".join(f"<h2>{html.escape(head)}</h2>{content}" for head, content in shown)
    data = "".join(_json(name, value) for name, value in (figures or {}).items())
    if walks:
        data += "".join(_json(f"run{i}", walk, " data-walk") for i, (_, walk) in enumerate(walks))
    if course is not None:
        note = "<p>Dotted lines: ends of stages. Wheel: zoom. Double click: reset.</p>"
        body = f"<h2>Course of the training</h2><div id='course'></div>{note}{body}"
        data += _json("progress", course)
    parts = {
        "TITLE": html.escape(f"{title} · gaitshift"),
        "HEAD": html.escape(title),
        "SUMMARY": html.escape(summary),
        "SECTIONS": (_stage([name for name, _ in walks]) if walks else "") + body,
        "CREDIT": " Its player contains three.js (MIT)." if walks else "",
        "DATA": data,
        "SCRIPT": _read("player.js" if walks else "figures.js").replace("</script", "<\\/script"),
    }
    # In one pass, so that a place in the text that is put in is not taken for one of the page.
    write_text(path, re.sub(r"@([A-Z]+)@", lambda place: parts[place[1]], _read("page.html")))


def figure(name: str) -> str:
    """The place of a figure in a section."""
    return f"<div data-figure='{name}'></div>"


def _stage(names: Sequence[str]) -> str:
    """The player, with a choice of walks above it."""
    options = "".join(
        f"<option value='{i}'>{html.escape(name)}</option>" for i, name in enumerate(names)
    )
    choice = f"<p><label>policy <select id='walk'>{options}</select></label></p>"
    return _read("stage.html").replace("@CHOICE@", choice if len(names) > 1 else "")


def _json(name: str, value: Mapping[str, Any], mark: str = "") -> str:
    # Without "<", no text in it ends the script or begins a comment.
    text = json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    return f'<script type="application/json" id="{name}"{mark}>{text}</script>\n'


def table(head: Sequence[str], rows: Sequence[Row]) -> str:
    """Rows of text below a head, as HTML; nothing where there are no rows."""
    if not rows:
        return ""
    top = "".join(f"<th>{html.escape(cell)}</th>" for cell in head)
    body = ""
    for cells, time in rows:
        seek = "" if time is None else f' data-seek="{time:.2f}" tabindex="0"'
        body += f"<tr{seek}>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>"
    start = f"<thead><tr>{top}</tr></thead>" if head else ""
    return f"<div class='wide'><table>{start}<tbody>{body}</tbody></table></div>"


def facts_table(*some: Mapping[str, str] | None) -> str:
    """Settings of the run, and the versions that wrote the page."""
    made = {f"{name} version": version(name) for name in ("gaitshift", "mujoco-core", "numpy")}
    given = [each for each in (*some, made) if each]
    return table((), [((n, str(value)), None) for each in given for n, value in each.items()])


def _read(name: str) -> str:
    return (Path(__file__).parent / name).read_text(encoding="utf-8")
