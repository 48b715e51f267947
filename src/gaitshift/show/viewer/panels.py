"""Panels of the live page that control its robots."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from gaitshift.shift import load_graph, numbers_of
from gaitshift.show.viewer.live import DIRECTIONS, MOST_ROBOTS, LiveConfig, LiveRun
from gaitshift.show.viewer.server import Orders

_CONDITIONS = ("terrain", "height_difference", "paper")
"""Shipped graphs of two gaits on the page."""

_GAITS_A_ROW = 4
"""Number of gait buttons per row."""


def build_gaits(gui: Any, orders: Orders, live: LiveRun) -> None:
    """Controls for the gait and for autonomous shifts."""
    alone = gui.add_checkbox(
        "shifts by itself",
        live.config.is_autonomous,
        hint="trot on flat, bound on rough ground",
    )
    orders.on_update(alone, lambda: _change(live, is_autonomous=bool(alone.value)))
    names = {gait.replace("_", "-"): gait for gait in live.gaits}
    for row in range(0, len(names), _GAITS_A_ROW):
        some = gui.add_button_group("", tuple(names)[row : row + _GAITS_A_ROW])
        orders.on_choice(some, lambda chosen: live.take(names[chosen]))


STOP = "stop"
_PAD = (
    ("turn left", "faster", "turn right"),
    ("left", STOP, "right"),
    ("lower", "slower", "higher"),
)
"""Buttons of the joystick, row by row."""

_PARTS = {
    "faster": ("speed", 0.1, "arrowup"),
    "slower": ("speed", -0.1, "arrowdown"),
    "turn left": ("turn", 0.1, "arrowleft"),
    "turn right": ("turn", -0.1, "arrowright"),
    "left": ("side", 0.1, "Q"),
    "right": ("side", -0.1, "E"),
    "higher": ("height", 0.01, "pageup"),
    "lower": ("height", -0.01, "pagedown"),
}
"""What a button of the joystick adds to which part of the command, and its key."""


def build_commands(gui: Any, orders: Orders, live: LiveRun) -> None:
    """Sliders for the parts of the command; a joystick of buttons and keys that moves them."""
    own = gui.add_checkbox("the gait's own speed and stride", True)
    ranges = {
        "speed": ("speed [m/s]", 0.0, 1.6, 0.05, 1.2),
        "side": ("to the left [m/s]", -0.4, 0.4, 0.05, 0.0),
        "turn": ("turn left [rad/s]", -0.5, 0.5, 0.05, 0.0),
        "height": ("height from stance [m]", -0.15, 0.02, 0.005, -0.03),
        "stride": ("stride [Hz]", 1.0, 3.5, 0.1, 2.5),
    }
    sliders = {
        name: gui.add_slider(
            label, min=low, max=high, step=step, initial_value=value, disabled=True
        )
        for name, (label, low, high, step, value) in ranges.items()
    }

    def command() -> None:
        for slider in sliders.values():
            slider.disabled = bool(own.value)
        asked = {name: float(slider.value) for name, slider in sliders.items()}
        _change(
            live,
            speed=None if own.value else asked["speed"],
            stride_frequency=None if own.value else asked["stride"],
            lateral_speed=0.0 if own.value else asked["side"],
            yaw_rate=None if own.value else asked["turn"],
            body_height=None if own.value else asked["height"],
        )

    def drive(button: str) -> None:
        own.value = False
        if button == STOP:
            for name in ("speed", "side", "turn"):
                sliders[name].value = 0.0
        else:
            name, step, _ = _PARTS[button]
            _, low, high, _, _ = ranges[name]
            sliders[name].value = round(min(max(sliders[name].value + step, low), high), 3)
        command()

    for handle in (own, *sliders.values()):
        orders.on_update(handle, command)
    for row in _PAD:
        orders.on_choice(gui.add_button_group("", row), drive)
    keys = {button: key for button, (_, _, key) in _PARTS.items()} | {STOP: "space"}
    for button, key in keys.items():
        orders.on_key(gui.add_command(button, hotkey=key), lambda chosen=button: drive(chosen))


class Logarithmic:
    """A number with a slider of its logarithm beside it, for values of several decades."""

    def __init__(self, gui: Any, name: str, unit: str, ends: tuple[float, float], value: float):
        """`ends` are the least and the greatest value, above 0, in `unit`."""
        low, high = (math.log10(end) for end in ends)
        decades = range(math.ceil(low - 1e-9), math.floor(high + 1e-9) + 1)
        marks = tuple((float(d), f"{10.0**d:g}") for d in decades)
        self._number = gui.add_number(f"{name} [{unit}]", value, min=ends[0], max=ends[1], step=0.1)
        self._slider = gui.add_slider(
            f"log₁₀ {name}",
            min=low,
            max=high,
            step=0.01,
            initial_value=math.log10(value),
            marks=marks,
        )

    @property
    def value(self) -> float:
        """The value, in the unit."""
        return float(self._number.value)

    @value.setter
    def value(self, value: float) -> None:
        self._number.value, self._slider.value = value, math.log10(value)

    def on_update(self, orders: Orders, order: Callable[[], None]) -> None:
        """Gives the order whenever someone changes the value."""

        def from_slider() -> None:
            self._number.value = float(f"{10.0**self._slider.value:.3g}")
            order()

        def from_number() -> None:
            self._slider.value = math.log10(self._number.value)
            order()

        orders.on_update(self._slider, from_slider)
        orders.on_update(self._number, from_number)


_MILLIMETRES = 1000.0
_HEIGHTS = {"alpha": "α", "alpha_back": "α'"}
"""Numbers of the condition that are heights, and their names on the page."""


def build_condition(gui: Any, orders: Orders, live: LiveRun) -> None:
    """Controls for the condition and its numbers."""
    shown = live.config.condition
    offered = tuple(dict.fromkeys((*_CONDITIONS, shown)))  # it may be a file
    name = gui.add_dropdown("condition", offered, initial_value=shown)
    now = numbers_of(live.config.graph)
    heights = {
        key: Logarithmic(gui, symbol, "mm", (1.0, 300.0), _MILLIMETRES * now[key])
        for key, symbol in _HEIGHTS.items()
    }
    ranges = {
        "beta": ("β [counts]", 0, 1500, 1),
        "leak": ("leak [counts/step]", 0, 6, 0.01),
        "beta_back": ("β' [counts]", 0, 1500, 1),
    }
    counts = {
        key: gui.add_slider(label, min=low, max=high, step=step, initial_value=now[key])
        for key, (label, low, high, step) in ranges.items()
    }

    def tune() -> None:
        values = {key: float(handle.value) for key, handle in counts.items()}
        values |= {key: handle.value / _MILLIMETRES for key, handle in heights.items()}
        _change(live, condition=name.value, numbers=values)

    def choose() -> None:
        shipped = numbers_of(load_graph(name.value))
        for key, handle in counts.items():
            handle.value = shipped[key]
        for key, handle in heights.items():
            handle.value = _MILLIMETRES * shipped[key]
        _change(live, condition=name.value, numbers={})

    orders.on_update(name, choose)
    for handle in counts.values():
        orders.on_update(handle, tune)
    for handle in heights.values():
        handle.on_update(orders, tune)


def build_push(gui: Any, orders: Orders, live: LiveRun) -> None:
    """Force, direction, and a button that pushes."""
    force = gui.add_slider("force [N]", min=0, max=300, step=10, initial_value=120)
    way = gui.add_dropdown("direction", tuple(DIRECTIONS), initial_value="left")
    orders.on_click(
        gui.add_button("push"),
        lambda: live.push(float(force.value), DIRECTIONS[way.value]),
    )


def build_ground(
    gui: Any, orders: Orders, live: LiveRun, restart: Callable[[LiveConfig], None]
) -> Any:
    """Controls for track, seed and number of robots; returns the seed's handle."""
    config = live.config
    track = gui.add_text("track", config.track)
    height = gui.add_slider(
        "noise [m]", min=0.0, max=0.25, step=0.01, initial_value=amplitude_of(config.track)
    )
    seed = gui.add_number("seed", config.seed, min=0, step=1)
    robots = gui.add_slider("robots", min=1, max=MOST_ROBOTS, step=1, initial_value=config.robots)

    def walk_anew() -> None:
        asked = {"track": track.value, "seed": int(seed.value), "robots": int(robots.value)}
        restart(replace(live.config, **asked))

    def raise_noise() -> None:
        track.value = with_amplitude(track.value, float(height.value))

    orders.on_update(height, raise_noise)
    orders.on_click(gui.add_button("walk there"), walk_anew)
    return seed


def with_amplitude(track: str, amplitude: float) -> str:
    """A track whose pieces of noise have this amplitude [m]."""
    pieces = [piece.strip() for piece in track.split(",")]
    return ",".join(
        f"perlin:{amplitude:.3f}@{piece.split('@')[1]}"
        if piece.startswith("perlin:") and "@" in piece
        else piece
        for piece in pieces
    )


def amplitude_of(track: str) -> float:
    """Amplitude of the first noise on a track, within the slider's range [m]."""
    for piece in track.split(","):
        kind, _, number = piece.strip().partition(":")
        if kind == "perlin":
            try:
                amplitude = float(number.partition("@")[0])
            except ValueError:
                break
            return min(amplitude, 0.25) if math.isfinite(amplitude) else 0.1
    return 0.1


def _change(live: LiveRun, **values: Any) -> None:
    live.change(replace(live.config, **values))
