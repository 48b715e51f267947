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


def build_commands(gui: Any, orders: Orders, live: LiveRun) -> None:
    """Controls for speed and stride frequency."""
    own = gui.add_checkbox("the gait's own speed and stride", True)
    speed = gui.add_slider(
        "speed [m/s]", min=0.2, max=1.6, step=0.05, initial_value=1.2, disabled=True
    )
    stride = gui.add_slider(
        "stride [Hz]", min=1.0, max=3.5, step=0.1, initial_value=2.5, disabled=True
    )

    def command() -> None:
        speed.disabled = stride.disabled = bool(own.value)
        _change(
            live,
            speed=None if own.value else float(speed.value),
            stride_frequency=None if own.value else float(stride.value),
        )

    for handle in (own, speed, stride):
        orders.on_update(handle, command)


def build_condition(gui: Any, orders: Orders, live: LiveRun) -> None:
    """Controls for the condition and its numbers."""
    shown = live.config.condition
    offered = tuple(dict.fromkeys((*_CONDITIONS, shown)))  # it may be a file
    name = gui.add_dropdown("condition", offered, initial_value=shown)
    now = numbers_of(live.config.graph)
    ranges = {
        "alpha": ("α [m]", 0.001, 0.3, 0.0002),
        "beta": ("β [counts]", 0, 1500, 1),
        "leak": ("leak [counts/step]", 0, 6, 0.01),
        "alpha_back": ("α' [m]", 0.001, 0.3, 0.0005),
        "beta_back": ("β' [counts]", 0, 1500, 1),
    }
    numbers = {
        key: gui.add_slider(label, min=low, max=high, step=step, initial_value=now[key])
        for key, (label, low, high, step) in ranges.items()
    }

    def tune() -> None:
        values = {key: float(handle.value) for key, handle in numbers.items()}
        _change(live, condition=name.value, numbers=values)

    def choose() -> None:
        shipped = numbers_of(load_graph(name.value))
        for key, handle in numbers.items():
            handle.value = shipped[key]
        _change(live, condition=name.value, numbers={})

    orders.on_update(name, choose)
    for handle in numbers.values():
        orders.on_update(handle, tune)


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
