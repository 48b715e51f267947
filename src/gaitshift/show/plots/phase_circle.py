"""The circle of phases: when in the stride of FL each foot comes down, and how firmly."""

# matplotlib's own stubs leave **kwargs untyped:
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from collections.abc import Mapping
from math import log, pi, sqrt
from typing import Any, cast

import numpy as np
from matplotlib.axes import Axes
from matplotlib.projections.polar import PolarAxes

from gaitshift.gait import RewardMachine
from gaitshift.lab.gait_analysis.phase import axial_of, ideal_of
from gaitshift.robot.legs import LEGS
from gaitshift.show.plots.palette import INK, LEG_COLOURS, PALE, PAPER

_RINGS = (1.0, 0.77, 0.54, 0.31)
"""Radius of each foot's ring: feet that come down together lie side by side."""

_WORDS = (PAPER, PAPER, INK, INK)
"""Colour of each foot's name on its mark: the hind feet's are light."""


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
        color=_WORDS[leg],
        size=8,
        weight="bold",
        zorder=4,
    )
