"""A machine as a picture: states on a circle as the feet seen from above, edges as arrows."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from gaitshift.errors import GaitshiftError
from gaitshift.legs import LEGS
from gaitshift.reward_machine.edge import Edge
from gaitshift.reward_machine.feet import feet_text
from gaitshift.reward_machine.machine import RewardMachine
from gaitshift.reward_machine.state import State

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import FancyBboxPatch

FORMATS = (".png", ".svg", ".pdf")
"""File endings that `draw` knows."""

_INK, _QUIET, _PALE, _PAPER = "#1f2933", "#7b8794", "#e4e7eb", "#ffffff"
_DOWN, _UP = "#0072b2", "#d55e00"
"""Blue and vermilion of Okabe and Ito, told apart by every kind of colour vision."""

_FOOT = {"FL": (-1, 1), "FR": (1, 1), "BL": (-1, -1), "BR": (1, -1)}
_CARD = (1.7, 2.1)
_NEIGHBOURS = 5.0
_BULGE = -0.28
_INCHES = 0.62


def draw(machine: RewardMachine, path: Path) -> None:
    """Draw the machine into a PNG, SVG or PDF file, with a white background.

    Each state is a card with the robot seen from above, nose up: filled feet are down. Each
    arrow tells the feet down and up, the swing height [cm] and the dwell [control steps] of its
    guard. Raises `GaitshiftError` for another file ending or a folder that is not there.
    """
    if path.suffix.lower() not in FORMATS:
        raise GaitshiftError(f"{path}: a picture's name ends in {', '.join(FORMATS)}")
    if not path.parent.is_dir():
        raise GaitshiftError(f"{path}: there is no folder {path.parent}")
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    middles = layout(machine)
    half_width = max(abs(x) for x, _ in middles.values()) + 2.6
    top = max(y for _, y in middles.values()) + 2.9
    bottom = min(y for _, y in middles.values()) - 2.5
    size = (2 * half_width * _INCHES, (top - bottom) * _INCHES)
    with rc_context({"svg.hashsalt": "gaitshift", "font.family": "DejaVu Sans"}):
        figure = Figure(figsize=size, facecolor=_PAPER)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.set(xlim=(-half_width, half_width), ylim=(bottom, top), aspect="equal")
        axes.set_axis_off()
        axes.text(0, top - 0.55, machine.title, ha="center", va="center", size=15, color=_INK)
        _draw_key(axes, bottom + 0.4)
        cards = {s.name: _draw_state(axes, s, middles[s.name]) for s in machine.states}
        _draw_start(axes, middles[machine.states[machine.initial].name])
        for edge, bulge in _bulges(machine.edges):
            _draw_edge(axes, edge, cards, middles, bulge)
        quiet = {"Date": None} if path.suffix.lower() == ".svg" else None
        figure.savefig(path, dpi=160, metadata=quiet)


def layout(machine: RewardMachine) -> dict[str, tuple[float, float]]:
    """Middle (x, y) of each state's card: a circle, clockwise, with neighbours 5 units apart.

    Two states lie side by side; more begin at the top.
    """
    n = len(machine.states)
    radius = _NEIGHBOURS / (2 * math.sin(math.pi / n)) if n > 1 else 0.0
    first = math.pi if n <= 2 else math.pi / 2
    angles = [first - 2 * math.pi * i / n for i in range(n)]
    return {
        state.name: (radius * math.cos(angle), radius * math.sin(angle))
        for state, angle in zip(machine.states, angles, strict=True)
    }


def _bulges(edges: tuple[Edge, ...]) -> list[tuple[Edge, float]]:
    """How far each arrow bends to its left; the second of one pair of states bends further."""
    pairs = [(edge.source, edge.target) for edge in edges]
    return [(e, _BULGE * (1 + 1.5 * pairs[:i].count(pairs[i]))) for i, e in enumerate(edges)]


def _draw_state(axes: "Axes", state: State, middle: tuple[float, float]) -> "FancyBboxPatch":
    x, y = middle
    card = _box(axes, x, y, *_CARD, rounding=0.22, face=_PAPER, edge=_INK)
    if state.accepting:
        _box(axes, x, y, _CARD[0] - 0.2, _CARD[1] - 0.2, rounding=0.16, face=_PAPER, edge=_INK)
        axes.text(x, y, f"{state.name}\n(end)", ha="center", va="center", size=9, color=_INK)
        return card
    body_y = y + 0.2
    _box(axes, x, body_y, 0.5, 1.0, rounding=0.15, face=_PALE, edge=_PALE)
    axes.plot([x - 0.13, x, x + 0.13], [body_y + 0.62, body_y + 0.74, body_y + 0.62], color=_QUIET)
    for leg in LEGS:
        side, end = _FOOT[leg]
        axes.plot(
            x + 0.5 * side,
            body_y + 0.45 * end,
            marker="o",
            markersize=11,
            markerfacecolor=_DOWN if leg in state.stance else _PAPER,
            markeredgecolor=_DOWN if leg in state.stance else _QUIET,
            markeredgewidth=1.6,
        )
    axes.text(x, y - 0.8, state.name, ha="center", va="center", size=9, color=_INK)
    return card


def _box(
    axes: "Axes",
    x: float,
    y: float,
    width: float,
    height: float,
    *,
    rounding: float,
    face: str,
    edge: str,
) -> "FancyBboxPatch":
    from matplotlib.patches import FancyBboxPatch

    box = FancyBboxPatch(
        (x - width / 2, y - height / 2),
        width,
        height,
        boxstyle=f"round,pad=0,rounding_size={rounding}",
        facecolor=face,
        edgecolor=edge,
        linewidth=1.3,
    )
    axes.add_patch(box)
    return box


def _draw_start(axes: "Axes", middle: tuple[float, float]) -> None:
    """The dot and short arrow that point at u0, from outside the circle."""
    x, y = middle
    away = (0.0, 1.0) if y > 1e-6 else (-1.0, 0.0)
    edge = (x + away[0] * _CARD[0] / 2, y + away[1] * _CARD[1] / 2)
    dot = (edge[0] + 0.85 * away[0], edge[1] + 0.85 * away[1])
    axes.plot(*dot, marker="o", markersize=7, color=_INK)
    arrow = {"arrowstyle": "-|>", "color": _INK, "linewidth": 1.3, "shrinkA": 3, "shrinkB": 1}
    axes.annotate("", xy=edge, xytext=dot, arrowprops=arrow)


def _draw_edge(
    axes: "Axes",
    edge: Edge,
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
    # The middle of matplotlib's arc3, a quadratic Bezier curve: half of its control point's offset.
    x = (ax + bx) / 2 + bulge * (by - ay) / 2
    y = (ay + by) / 2 - bulge * (bx - ax) / 2
    _draw_guard(axes, edge, x, y)


def _draw_guard(axes: "Axes", edge: Edge, x: float, y: float) -> None:
    """The guard in up to three lines around (x, y): feet down, feet up, dwell."""
    guard = edge.guard
    height = f" {100 * guard.swing_height:g} cm" if guard.swing_height else ""
    lines = [(f"● {feet_text(guard.down)}", _DOWN)] if guard.down else []
    lines += [(f"○ {feet_text(guard.up)}{height}", _UP)] if guard.up else []
    lines += [(f"≥ {guard.dwell} steps", _QUIET)] if guard.dwell > 1 else []
    for i, (text, colour) in enumerate(lines):
        axes.text(
            x,
            y + 0.36 * ((len(lines) - 1) / 2 - i),
            text,
            ha="center",
            va="center",
            size=9,
            color=colour,
            bbox={"facecolor": _PAPER, "edgecolor": "none", "pad": 2},
        )


def _draw_key(axes: "Axes", y: float) -> None:
    style = {"ha": "center", "va": "center", "size": 8}
    axes.text(-1.2, y, "● foot down", color=_DOWN, **style)
    axes.text(1.2, y, "○ foot up", color=_UP, **style)
