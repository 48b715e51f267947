"""A machine as a picture: states as the feet seen from above, edges as arrows with their guards."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

import math
import re
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from gaitshift.errors import GaitshiftError
from gaitshift.gait.elements import State, Transition, feet_text
from gaitshift.gait.machine import RewardMachine
from gaitshift.robot.legs import LEGS
from gaitshift.whole_file import replacing

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import FancyBboxPatch

FORMATS = (".png", ".svg", ".pdf")
"""File endings that `draw` knows."""

_INK, _QUIET, _PALE, _PAPER = "#1f2933", "#616e7c", "#e4e7eb", "#ffffff"
_DOWN, _UP = "#0072b2", "#c04f00"
"""Blue and vermilion after Okabe and Ito, distinct for every kind of colour vision."""

_FOOT = {"FL": (-1, 1), "FR": (1, 1), "BL": (-1, -1), "BR": (1, -1)}
"""Where a foot is drawn: to the right of the body, towards its nose."""

_CARD, _END_CARD = (1.7, 2.1), (1.7, 0.9)
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NEIGHBOURS = 5.0
_BULGE = -0.28
_INCHES = 0.62


def draw(machine: RewardMachine, path: Path) -> None:
    """Draw the machine into a PNG, SVG or PDF file, on white.

    Each state is a card with the robot seen from above, nose up; feet on the ground are filled.
    Each arrow names the feet down, the feet up and the dwell [control steps].
    Raises `GaitshiftError` for another file ending or a folder that is not there.
    """
    if path.suffix.lower() not in FORMATS:
        raise GaitshiftError(f"{path}: the name of a picture must end in {' or '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise GaitshiftError(f"{path}: no folder {path.parent}")
    import matplotlib
    from matplotlib.figure import Figure

    middles = layout(machine)
    half_width = max(abs(x) for x, _ in middles.values()) + 2.6
    bottom = min(y for _, y in middles.values()) - 2.4
    top = max(y for _, y in middles.values()) + 3.6
    with cast(Any, matplotlib).rc_context(
        {"svg.hashsalt": "gaitshift", "font.family": "DejaVu Sans", "text.parse_math": False}
    ):
        size = (2 * half_width * _INCHES, (top - bottom) * _INCHES)
        figure = Figure(figsize=size, facecolor=_PAPER)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(-half_width, half_width), ylim=(bottom, top), aspect="equal")
        axes.set_axis_off()
        _draw_words(axes, machine, top, bottom)
        cards = {s.name: _draw_state(axes, s, middles[s.name]) for s in machine.states}
        _draw_start(axes, middles[machine.states[machine.initial].name])
        for edge, bulge in _bulges(machine.edges):
            _draw_edge(axes, edge, cards, middles, bulge)
        undated = {"Date": None} if path.suffix.lower() == ".svg" else None
        with replacing(path) as part:
            figure.savefig(part, format=path.suffix[1:], dpi=160, metadata=undated)


def layout(machine: RewardMachine) -> dict[str, tuple[float, float]]:
    """Return the middle (x, y) of each state's card.

    States lie clockwise on a circle: two side by side, more from the top on. Accepting states
    lie in a row, inside a circle of three or more and below a smaller one.
    """
    live = [state.name for state in machine.states if not state.accepting]
    ends = [state.name for state in machine.states if state.accepting]
    n, wide = len(live), len(live) > 2
    apart = _NEIGHBOURS + (1.5 if ends else 0.0)
    radius = apart / (2 * math.sin(math.pi / n)) if n > 1 else 0.0
    first = math.pi / 2 if wide else math.pi
    angles = [first - 2 * math.pi * i / n for i in range(n)]
    row = [(2.2 * (i - (len(ends) - 1) / 2), 0.0 if wide else -4.0) for i in range(len(ends))]
    circle = [(radius * math.cos(angle), radius * math.sin(angle)) for angle in angles]
    return dict(zip(live + ends, circle + row, strict=True))


def _bulges(edges: tuple[Transition, ...]) -> list[tuple[Transition, float]]:
    """Say how far each arrow bends to its left; the second of a pair of states bends further."""
    pairs = [(edge.source, edge.target) for edge in edges]
    return [(e, _BULGE * (1 + 1.5 * pairs[:i].count(pairs[i]))) for i, e in enumerate(edges)]


def _draw_words(axes: "Axes", machine: RewardMachine, top: float, bottom: float) -> None:
    axes.text(0, top - 0.55, machine.title, ha="center", va="center", size=15, color=_INK)
    words = textwrap.fill(machine.description, width=60, max_lines=2)
    axes.text(0, top - 0.95, words, ha="center", va="top", size=9, color=_QUIET)
    for x, text, colour in ((-1.2, "● foot down", _DOWN), (1.2, "○ foot up", _UP)):
        axes.text(x, bottom + 0.5, text, ha="center", va="center", size=8, color=colour)


def _draw_state(axes: "Axes", state: State, middle: tuple[float, float]) -> "FancyBboxPatch":
    x, y = middle
    if state.accepting:
        width, height = _END_CARD
        card = _draw_box(axes, middle, (width, height), rounding=0.22)
        _draw_box(axes, middle, (width - 0.18, height - 0.18), rounding=0.15)
        _draw_name(axes, state.name, middle)
        return card
    card = _draw_box(axes, middle, _CARD, rounding=0.22)
    body = y + 0.2
    _draw_box(axes, (x, body), (0.5, 1.0), rounding=0.15, face=_PALE, line=_PALE)
    nose_x, nose_y = [x - 0.13, x, x + 0.13], [body + 0.6, body + 0.72, body + 0.6]
    axes.plot(nose_x, nose_y, color=_QUIET, solid_capstyle="round")
    for leg in LEGS:
        right, ahead = _FOOT[leg]
        down = leg in state.stance
        axes.plot(
            x + 0.5 * right,
            body + 0.42 * ahead,
            marker="o",
            markersize=11,
            markerfacecolor=_DOWN if down else _PAPER,
            markeredgecolor=_DOWN if down else _UP,
            markeredgewidth=1.6,
        )
    _draw_name(axes, state.name, (x, y - 0.8))
    return card


def _draw_name(axes: "Axes", name: str, middle: tuple[float, float]) -> None:
    """Draw a state's name, a long one small enough for its card."""
    axes.text(*middle, name, ha="center", va="center", size=min(9, 108 / len(name)), color=_INK)


def _draw_box(
    axes: "Axes",
    middle: tuple[float, float],
    size: tuple[float, float],
    *,
    rounding: float,
    face: str = _PAPER,
    line: str = _INK,
) -> "FancyBboxPatch":
    from matplotlib.patches import FancyBboxPatch

    box = FancyBboxPatch(
        (middle[0] - size[0] / 2, middle[1] - size[1] / 2),
        *size,
        boxstyle=f"round,pad=0,rounding_size={rounding}",
        facecolor=face,
        edgecolor=line,
        linewidth=1.3,
    )
    axes.add_patch(box)
    return box


def _draw_start(axes: "Axes", middle: tuple[float, float]) -> None:
    """Draw the dot and short arrow that point at u0, from outside the circle."""
    x, y = middle
    right, up = (0, 1) if y > 1e-6 else (-1, 0)
    tip = (x + right * _CARD[0] / 2, y + up * _CARD[1] / 2)
    dot = (tip[0] + 0.85 * right, tip[1] + 0.85 * up)
    axes.plot(*dot, marker="o", markersize=7, color=_INK)
    style = {"arrowstyle": "-|>", "color": _INK, "linewidth": 1.3, "shrinkA": 3, "shrinkB": 1}
    axes.annotate("", xy=tip, xytext=dot, arrowprops=style)


def _draw_edge(
    axes: "Axes",
    edge: Transition,
    cards: "dict[str, FancyBboxPatch]",
    middles: dict[str, tuple[float, float]],
    bulge: float,
) -> None:
    from matplotlib.patches import FancyArrowPatch

    (ax, ay), (bx, by) = middles[edge.source], middles[edge.target]
    arrow = FancyArrowPatch(
        (ax, ay),
        (bx, by),
        connectionstyle=f"arc3,rad={bulge}",
        arrowstyle="-|>",
        mutation_scale=14,
        patchA=cards[edge.source],
        patchB=cards[edge.target],
        shrinkA=2,
        shrinkB=2,
        color=_INK,
        linewidth=1.3,
    )
    axes.add_patch(arrow)
    # arc3 is a quadratic Bezier curve: its middle lies half as far out as its control point.
    middle = ((ax + bx) / 2 + bulge * (by - ay) / 2, (ay + by) / 2 - bulge * (bx - ax) / 2)
    _draw_guard(axes, edge, middle)


def _draw_guard(axes: "Axes", edge: Transition, middle: tuple[float, float]) -> None:
    """Draw the guard in up to three lines: feet down, feet up, dwell."""
    from matplotlib.offsetbox import AnnotationBbox, TextArea, VPacker

    guard = edge.guard
    lines = [(f"● {feet_text(guard.down)}", _DOWN)] if guard.down else []
    lines += [(f"○ {feet_text(guard.up)}", _UP)] if guard.up else []
    lines += [(f"≥ {guard.dwell} steps", _QUIET)] if guard.dwell > 1 else []
    areas = [TextArea(text, textprops={"color": colour, "size": 9}) for text, colour in lines]
    packed = VPacker(children=[*areas], align="center", pad=0, sep=3)
    axes.add_artist(AnnotationBbox(packed, middle, pad=0.25, bboxprops={"linewidth": 0}))


def mermaid(machine: RewardMachine) -> str:
    """Write the machine as a Mermaid `stateDiagram-v2`: a line a state, a line an edge."""
    names = [state.name for state in machine.states]
    ids = mermaid_ids(names)
    lines = ["stateDiagram-v2", "    direction LR"]
    lines += [f"    {ids[s.name]} : {s.name}, {s.stance_text()}" for s in machine.states]
    lines += [f"    [*] --> {ids[names[machine.initial]]}"]
    lines += [
        f"    {ids[edge.source]} --> {ids[edge.target]} : {', '.join(edge.guard.demands())}"
        for edge in machine.edges
    ]
    lines += [f"    {ids[names[u]]} --> [*]" for u in machine.accepting]
    return "\n".join(lines) + "\n"


_MERMAID_WORDS = frozenset(
    (
        *("accdescr", "acctitle", "as", "choice", "class", "classdef", "click", "default"),
        *("direction", "end", "fork", "hide", "href", "join", "note", "root", "scale", "state"),
        *("statediagram", "style"),
    )
)
"""Words that mean something else to Mermaid than a state, in small letters."""


def mermaid_ids(names: Sequence[str]) -> dict[str, str]:
    """An identifier that Mermaid reads as a state for each of some names, itself where it can be.

    In others, signs become underscores, and a number makes the identifier unlike all others.
    """
    plain = [n for n in names if _WORD.fullmatch(n) and n.lower() not in _MERMAID_WORDS]
    ids = dict(zip(plain, plain, strict=True))
    for name in names:
        number = 1
        while name not in ids:
            made = f"{re.sub('[^A-Za-z0-9]', '_', name)}_{number}"
            if made not in ids.values():
                ids[name] = made
            number += 1
    return ids
