"""The charts beside the scene: the last seconds of a robot, and its gait's machine."""

from collections import deque
from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any, cast

import numpy as np
import viser

from gaitshift.gait import RewardMachine
from gaitshift.robot.legs import LEGS
from gaitshift.show.geometry import Frame
from gaitshift.show.plots.style import INK, LEG_COLOURS, PALE, QUIET, gait_colours

_QUANTITIES: dict[str, Callable[[Frame], np.ndarray]] = {
    "contact": lambda frame: frame.step.sensed.contact,
    "touch_height": lambda frame: frame.touch_height,
    "speed": lambda frame: frame.step.truth.forward_speed,
    "k": lambda frame: frame.step.k,
    "threshold": lambda frame: frame.step.threshold,
    "gait": lambda frame: frame.step.gait,
    "machine_state": lambda frame: frame.step.machine_state,
}
"""Quantities of the charts, by name."""

WINDOW = 8.0
"""Time window of the charts [s]."""


class Tape:
    """The last seconds of one robot, for charts."""

    def __init__(self, robot: int = 0) -> None:
        self.robot = robot
        self._frames: deque[Frame] = deque()

    def add(self, frame: Frame) -> None:
        """Adds a frame; drops those before the window or later than this one."""
        while self._frames and self._frames[-1].time >= frame.time:
            self._frames.pop()  # the run began anew, or the slider was moved back
        self._frames.append(frame)
        while self._frames[0].time < frame.time - WINDOW:
            self._frames.popleft()

    def clear(self) -> None:
        """Drops all frames."""
        self._frames.clear()

    @property
    def last(self) -> Frame | None:
        """The newest frame."""
        return self._frames[-1] if self._frames else None

    def of(self, name: str) -> np.ndarray:
        """A quantity of the robot over the window, time first; of `time` itself: [s]."""
        if name == "time":
            return np.array([frame.time for frame in self._frames])
        return np.array([_QUANTITIES[name](frame)[self.robot] for frame in self._frames])


_HEIGHT = 150
"""Size of a chart [pixels]."""

_WIDE, _ROW, _LEFT = 300, 16, 22
"""The contact diagram: width of the time axis, height of a leg's row, room for names [units]."""


class Charts:
    """The charts of one robot's tape, in the panel in which they are created."""

    def __init__(
        self, server: viser.ViserServer, machines: Mapping[str, RewardMachine | None]
    ) -> None:
        """The machine of each gait by its name; None: not drawn."""
        self._machines = tuple(machines.values())
        self._colours = tuple(gait_colours(machines).values())
        gui = cast(Any, server.gui)
        self._contacts = gui.add_html(contact_svg(Tape(), self._colours))
        self._counter = self._chart(
            gui, "k and β [counts]", ("k", "β", "shift"), (INK, "#d55e00", "#0072b2")
        )
        self._heights = self._chart(gui, "heights of the last touches [m]", LEGS, LEG_COLOURS)
        self._speed = self._chart(gui, "speed [m/s]", ("speed",), (INK,))
        self._machine = gui.add_html("")

    def draw(self, tape: Tape) -> None:
        """Draws the last seconds."""
        last = tape.last
        if last is None:
            return
        self._contacts.content = contact_svg(tape, self._colours)
        time = tape.of("time") - last.time
        if len(time) < 2:
            return
        self._show_condition(bool((tape.of("threshold") + tape.of("k")).any()))
        self._counter.data = (time, *counter(tape))
        self._heights.data = (time, *foot_heights(tape).T)
        self._speed.data = (time, tape.of("speed").astype(float))
        gait, state = int(last.step.gait[tape.robot]), int(last.step.machine_state[tape.robot])
        machine = self._machines[gait]
        self._machine.content = (
            "" if machine is None else machine_svg(machine, state, self._colours[gait])
        )

    def _show_condition(self, shown: bool) -> None:
        """Shows or hides the two charts of the condition."""
        for chart in (self._counter, self._heights):
            if chart.visible != shown:
                chart.visible = shown

    @staticmethod
    def _chart(gui: Any, title: str, names: tuple[str, ...], colours: tuple[str, ...]) -> Any:
        axis = {"stroke": QUIET, "grid": {"stroke": PALE, "width": 1}, "font": "11px sans-serif"}
        return gui.add_uplot(
            data=tuple(np.array([-WINDOW, 0.0]) for _ in range(len(names) + 1)),
            series=(
                {"label": "t"},
                *(
                    {"label": name, "stroke": colour, "width": 1.5}
                    for name, colour in zip(names, colours, strict=True)
                ),
            ),
            title=title,
            scales={"x": {"time": False, "range": (-WINDOW, 0.0)}},
            axes=({**axis, "label": "time [s]", "labelSize": 16, "size": 32}, {**axis, "size": 44}),
            legend={"show": len(names) > 1, "live": False},
            height=_HEIGHT,
        )


def counter(tape: Tape) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """k, β, and the shifts: the larger of both where the gait changes, 0 elsewhere."""
    k, beta, gait = (tape.of(name) for name in ("k", "threshold", "gait"))
    shift = np.zeros(len(k))
    changed = np.flatnonzero(gait[1:] != gait[:-1])
    shift[changed + 1] = np.maximum(np.maximum(k, beta)[changed], 1.0)
    return k.astype(float), beta.astype(float), shift


def foot_heights(tape: Tape) -> np.ndarray:
    """Heights of the last touches (T, 4) [m]; NaN for a foot that has not touched yet."""
    return tape.of("touch_height")


def contact_svg(tape: Tape, colours: tuple[str, ...]) -> str:
    """When each foot was down over the window: one row per leg, coloured by gait."""
    high = _ROW * len(LEGS)
    parts = [
        f'<text x="0" y="{row * _ROW + 12}" font-size="11" fill="{QUIET}">{leg}</text>'
        f'<rect x="{_LEFT}" y="{row * _ROW + 2}" width="{_WIDE}" height="{_ROW - 4}" '
        f'fill="{PALE}"/>'
        for row, leg in enumerate(LEGS)
    ]
    last = tape.last
    if last is not None:
        time, contact, gait = (tape.of(name) for name in ("time", "contact", "gait"))
        x = _LEFT + _WIDE * (1 - (last.time - time) / WINDOW)
        for row in range(len(LEGS)):
            down = contact[:, row]
            # A bar goes on as long as the foot stays down in one gait.
            same = (down[1:] == down[:-1]) & (gait[1:] == gait[:-1])
            cuts = [0, *(np.flatnonzero(~same) + 1).tolist(), len(down)]
            for begin, end in pairwise(cuts):
                if down[begin]:
                    until = x[end] if end < len(x) else x[-1]
                    parts.append(
                        f'<rect x="{x[begin]:.1f}" y="{row * _ROW + 2}" '
                        f'width="{max(until - x[begin], 0.5):.1f}" height="{_ROW - 4}" '
                        f'fill="{colours[int(gait[begin])]}"/>'
                    )
    return (
        f'<div style="padding:0 1em"><div style="font-size:12px">feet on the ground, last '
        f'{WINDOW:g} s</div><svg viewBox="0 0 {_LEFT + _WIDE} {high}" width="100%" role="img" '
        f'aria-label="contacts">{"".join(parts)}</svg></div>'
    )


def machine_svg(machine: RewardMachine, state: int, colour: str) -> str:
    """The states of a machine in a ring, with the feet of each stance and the present one lit."""
    names = [" ".join(leg for leg in LEGS if leg in s.stance) or "no foot" for s in machine.states]
    number = {s.name: i for i, s in enumerate(machine.states)}
    count, wide, high, radius = len(names), 320, 130, 46
    angle = np.pi / 2 - 2 * np.pi * np.arange(count) / count
    x = wide / 2 + 105 * np.cos(angle) * (1 if count > 1 else 0)
    y = high / 2 - radius * np.sin(angle) * (1 if count > 1 else 0)
    arrows = "".join(
        f'<line x1="{x[a]:.0f}" y1="{y[a]:.0f}" x2="{x[b]:.0f}" y2="{y[b]:.0f}" '
        f'stroke="{PALE}" stroke-width="2"/>'
        for a, b in ((number[e.source], number[e.target]) for e in machine.edges)
    )
    nodes = "".join(
        f'<g><rect x="{x[i] - 45:.0f}" y="{y[i] - 11:.0f}" width="90" height="22" rx="11" '
        f'fill="{colour if i == state else "#ffffff"}" stroke="{colour}" stroke-width="1.5"/>'
        f'<text x="{x[i]:.0f}" y="{y[i] + 4:.0f}" font-size="11" text-anchor="middle" '
        f'fill="{"#ffffff" if i == state else INK}">{names[i]}</text></g>'
        for i in range(count)
    )
    return (
        f'<div style="padding:0 1em"><div style="font-size:12px">machine of <b>{machine.name}</b>, '
        f'feet that should be down</div><svg viewBox="0 0 {wide} {high}" width="100%" '
        f'role="img" aria-label="machine">{arrows}{nodes}</svg></div>'
    )
