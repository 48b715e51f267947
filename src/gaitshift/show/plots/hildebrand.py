"""A gait in one picture: Hildebrand's diagram of a robot, the phases of all, the verdict."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownMemberType=false

from collections.abc import Mapping
from math import log, pi, sqrt
from pathlib import Path
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from gaitshift.gait import RewardMachine
from gaitshift.gait.elements import feet_text
from gaitshift.lab.gait_analysis.phase import axial_of, ideal_of
from gaitshift.lab.log import Log
from gaitshift.robot.legs import LEGS
from gaitshift.show.plots.rows import draw_contacts
from gaitshift.show.plots.signals import check_robot, fall_time, period, spans, window
from gaitshift.show.plots.style import (
    INK,
    LEG_COLOURS,
    PALE,
    PAPER,
    QUIET,
    check_target,
    gait_colours,
    house_style,
    save,
)

_RINGS = (1.0, 0.77, 0.54, 0.31)
"""Radius of each foot's ring: feet that touch down together are side by side."""

_NAMES = (PAPER, PAPER, INK, INK)
"""Colour of each foot's name on its mark; light for the hind feet."""


def draw_phase_circle(axes: Axes, figures: Mapping[str, Any], machine: RewardMachine) -> None:
    """Each foot on a ring of its own, clockwise from the top, where FL comes down.

    A filled mark at its mean phase, an arc of one circular standard deviation to either side,
    √(-2 ln R) [rad], and an open mark at the ideal. A foot that comes down p times a stride has p
    of each. `figures` are those of `gait_analysis.measure`.
    """
    polar = cast(PolarAxes, axes)
    polar.set_theta_zero_location("N")
    polar.set_theta_direction(-1)
    polar.set_ylim(0.0, 1.12)
    polar.set_yticks([])
    polar.set_xticks(np.arange(4) * np.pi / 2, ["0", "0.25", "0.5", "0.75"])
    polar.grid(visible=True, color=PALE)
    polar.spines["polar"].set_visible(False)
    ideal, axial = ideal_of(machine), axial_of(machine)
    circle = np.linspace(0, 2 * np.pi, 181)
    for leg, ring in enumerate(_RINGS):
        p = axial[leg]
        polar.plot(circle, np.full_like(circle, ring), color=PALE, linewidth=1.2, zorder=1)
        for turn in np.arange(p) / p:
            polar.plot(
                2 * np.pi * (ideal[leg] + turn),
                ring,
                "o",
                mfc="none",
                mec=INK,
                ms=19,
                zorder=5,
                mew=1.4,
            )
            _draw_mean(polar, figures, leg, ring, p, turn)


def _draw_mean(
    polar: PolarAxes, figures: Mapping[str, Any], leg: int, ring: float, p: int, turn: float
) -> None:
    phase: float | None = figures["phase"][leg]
    consistency: float | None = figures["phase_consistency"][leg]
    if phase is None or consistency is None:
        return
    angle = 2 * np.pi * (phase + turn)
    spread = min(sqrt(-2 * log(min(max(consistency, 1e-9), 1.0))), pi) / p
    arc = np.linspace(angle - spread, angle + spread, 61)
    colour = LEG_COLOURS[leg]
    polar.plot(arc, np.full_like(arc, ring), color=colour, linewidth=4, alpha=0.5, zorder=2)
    polar.plot(angle, ring, "o", color=colour, ms=15, zorder=3)
    polar.text(
        angle,
        ring,
        LEGS[leg],
        ha="center",
        va="center",
        color=_NAMES[leg],
        size=8,
        weight="bold",
        zorder=4,
    )


SHOWN = 2.0
"""Length of the diagram, up to the robot's last step on its feet [s]."""

_SIZE = (12.0, 4.4)
"""[inch]"""

_STRIP = 4.25
"""Position of the machine's states, below the lanes 0 to 3 of the feet."""

_LETTER = 0.0115
"""Width of a letter in the strip, as a share of the time shown."""


def hildebrand_diagram(
    log: Log, figures: Mapping[str, Any], machine: RewardMachine, path: Path, robot: int = 0
) -> Figure:
    """Draws one robot's gait and the figures of all robots into a PNG, SVG or PDF file.

    Left: bars where each foot is down over the last 2 s [s], the state of the machine below, the
    duty factors beside. Right: the phases (`draw_phase_circle`). `figures` are those of
    `gait_analysis.measure`.

    Raises:
        GaitshiftError: no such robot, fewer than two steps on its feet, another file ending, or no
            such folder.
    """
    check_target(path)
    check_robot(log, robot)
    fell = fall_time(log, robot)
    end = float(log.time[-1]) if fell is None else fell - period(log) / 2
    part = window(log, end - SHOWN, end)
    colour = gait_colours([machine.name])[machine.name]
    with house_style():
        figure = Figure(figsize=_SIZE)
        axes = figure.add_axes((0.045, 0.145, 0.575, 0.60))
        _draw_feet(axes, part, robot, figures)
        _draw_states(axes, part, robot, machine, colour)
        circle = figure.add_axes((0.709, 0.10, 0.24, 0.65), projection="polar")
        draw_phase_circle(circle, figures, machine)
        figure.text(0.015, 0.95, machine.title, size=19, weight="bold", color=colour, va="top")
        figure.text(0.64, 0.935, _pace(figures), size=13, color=INK, ha="right", va="top")
        figure.text(0.015, 0.85, _verdict(figures["verdict"]), size=12, color=INK, va="top")
        figure.text(0.829, 0.95, "touchdown within the stride of FL", ha="center", va="top")
        figure.text(
            0.829,
            0.885,
            "filled: mean, arc: ± 1 sd of all robots; open: ideal",
            ha="center",
            va="top",
            size=10.5,
            color=QUIET,
        )
        save(figure, path)
    return figure


def _pace(figures: Mapping[str, Any]) -> str:
    """Speed and cycles of the machine, where known."""
    forms = {"speed_mean": "{:.2f} m/s", "cycles_per_s": "{:.2f} cycles/s"}
    known = [
        form.format(figures[name]) for name, form in forms.items() if figures[name] is not None
    ]
    return "   ·   ".join(known)


def _verdict(verdict: Mapping[str, Any]) -> str:
    score = max(verdict["scores"].values())
    clean = "clean" if verdict["clean"] else f"not clean: {_misses(verdict['misses'])}"
    return f"gait by contacts: {verdict['gait']} ({score:.2f})   ·   {clean}"


def _misses(misses: list[dict[str, Any]]) -> str:
    names = [str(miss["figure"]).replace("_", " ") for miss in misses]
    shown = ", ".join(names[:2]) or "another gait"
    return f"{shown} and {len(names) - 2} more" if len(names) > 2 else shown


def _draw_feet(axes: Axes, log: Log, robot: int, figures: Mapping[str, Any]) -> None:
    draw_contacts(axes, log, robot)
    axes.set_ylabel("")
    axes.set_xlim(float(log.time[0]), float(log.time[-1]) + period(log))
    axes.set_xlabel("time [s]")
    right = axes.get_xlim()[1]
    for leg, share in enumerate(figures["duty_factor"] or ()):
        axes.annotate(
            f"{share:.2f}", (right, leg), (8, 0), textcoords="offset points", va="center", size=12
        )
    axes.text(right, -0.55, "  duty", va="bottom", size=11, color=QUIET)


def _draw_states(axes: Axes, log: Log, robot: int, machine: RewardMachine, colour: str) -> None:
    """A strip of the machine's states, alternately light and dark, with feet where they fit."""
    low, high = _STRIP - 0.22, _STRIP + 0.22
    for span in spans(log, log.machine_state[:, robot]):
        state = int(log.machine_state[span.entry, robot])
        axes.fill_between(
            [span.begin, span.end],
            low,
            high,
            color=colour,
            alpha=0.45 if state % 2 else 0.18,
            linewidth=0,
        )
        stance = machine.states[state].stance
        name = "all feet" if len(stance) == len(LEGS) else feet_text(stance)
        if (span.end - span.begin) / SHOWN > _LETTER * len(name):
            axes.text(span.middle, _STRIP, name, ha="center", va="center", size=8.5, color=INK)
        axes.plot([span.begin] * 2, [low, high], color=PAPER, linewidth=1.0)
    axes.set_ylim(high + 0.1, -0.5)
    axes.annotate(
        "state",
        (axes.get_xlim()[1], _STRIP),
        (8, 0),
        textcoords="offset points",
        va="center",
        size=11,
        color=QUIET,
    )
