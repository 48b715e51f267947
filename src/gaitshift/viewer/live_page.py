"""The live page: robots walk, and whoever looks at it gives orders."""

import math
import queue
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import viser

from gaitshift.command import CONTROL_PERIOD
from gaitshift.errors import GaitshiftError
from gaitshift.geometry import Frame
from gaitshift.log import Log
from gaitshift.switching import CONDITIONS, Condition
from gaitshift.viewer.charts import Charts
from gaitshift.viewer.live import DIRECTIONS, MOST_ROBOTS, LiveConfig, LiveRun, with_amplitude
from gaitshift.viewer.scene import Scene
from gaitshift.viewer.server import TICK, Clock
from gaitshift.viewer.tape import Tape

_CHARTS_EVERY = 6
"""Pictures between two of the charts."""

_STEPS = round(TICK / CONTROL_PERIOD)
"""Control steps from picture to picture at real time."""

_GAITS_A_ROW = 4
"""Buttons for gaits beside each other."""


class LivePage:
    """Puts a `LiveRun` on a page. Orders are taken between two steps, by the thread that runs."""

    def __init__(
        self,
        server: viser.ViserServer,
        live: LiveRun,
        save: Callable[[Log], str],
    ) -> None:
        """`save` keeps a recording, and says in a line where it is."""
        self._server, self._save = server, save
        self._live = live
        self._scene = Scene(server, live.robot, live.gaits)
        self._tape = Tape()
        self._orders: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._paused = False
        self._singles = 0  # single steps that are asked for
        self._last: Frame | None = None
        self._factor = 1.0
        self._owed = 0.0
        self.pictures = 0
        """Drawn so far."""
        self.walked = 0.0
        """Time that robots have walked so far, over all restarts [s]."""
        self._build()
        self._show_ground()

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Walks and draws until told to end, or for ever."""
        clock = Clock()
        while not until():
            self._obey()
            frame = self._advance()
            if frame is not None:
                self._scene.draw(frame)
                self.pictures += 1
                if self.pictures % _CHARTS_EVERY == 0 or self._paused:
                    self._charts.draw(self._tape)
                    self._tell(frame)
            clock.wait()

    def _advance(self) -> Frame | None:
        """The steps that are due, and the last frame; None where nothing moved."""
        self._owed = float(self._singles) if self._paused else self._owed + _STEPS * self._factor
        self._singles = 0
        frame: Frame | None = None
        while self._owed >= 1.0:
            self._owed -= 1.0
            frame = self._live.step()
            self.walked += CONTROL_PERIOD
            self._tape.add(frame)
        self._last = frame or self._last
        if self._live.is_over:
            self._restart(replace(self._live.config, seed=self._live.config.seed + 1))
        return frame

    # What stands in the panels --------------------------------------------------------------------

    def _build(self) -> None:
        gui, config = cast(Any, self._server.gui), self._live.config
        panel = gui.add_panel()
        with panel.add_tab("Signals"):
            self._charts = Charts(self._server, self._live.machines)
        panel.dock_left()
        panel.set_width(340)
        self._status = gui.add_markdown("")
        self._build_clock(gui)
        with gui.add_folder("Gait"):
            self._build_gaits(gui, config)
        with gui.add_folder("Condition"):
            self._build_condition(gui, config.condition)
        with gui.add_folder("Push"):
            force = gui.add_slider("force [N]", min=0, max=300, step=10, initial_value=120)
            way = gui.add_dropdown("direction", tuple(DIRECTIONS), initial_value="left")
            self._on_click(
                gui.add_button("push"),
                lambda: self._live.push(float(force.value), DIRECTIONS[way.value]),
            )
        with gui.add_folder("Ground", expand_by_default=False):
            self._build_ground(gui, config)
        with gui.add_folder("Recording", expand_by_default=False):
            self._record = gui.add_button("record")
            self._on_click(self._record, self._toggle_recording)

    def _build_clock(self, gui: Any) -> None:
        pause = gui.add_button("pause")
        others = gui.add_button_group("", ("one step", "restart"))
        pace = gui.add_slider("times real time", min=0.1, max=2.0, step=0.1, initial_value=1.0)
        follow = gui.add_checkbox("camera follows", True)

        def toggle() -> None:
            self._paused = not self._paused
            pause.label = "go on" if self._paused else "pause"
            if self._last is not None:
                self._tell(self._last)

        self._on_click(pause, toggle)

        def other(chosen: str) -> None:
            if chosen == "restart":
                self._restart(self._live.config)
            else:
                self._singles += 1

        self._on_choice(others, other)
        self._on_update(pace, lambda: setattr(self, "_factor", float(pace.value)))
        self._on_update(follow, lambda: setattr(self._scene, "follows", bool(follow.value)))

    def _build_gaits(self, gui: Any, config: LiveConfig) -> None:
        alone = gui.add_checkbox(
            "shifts by itself", config.is_autonomous, hint="trot on flat, bound on rough ground"
        )
        self._on_update(alone, lambda: self._change(is_autonomous=bool(alone.value)))
        names = {gait.replace("_", "-"): gait for gait in self._live.gaits}
        for row in range(0, len(names), _GAITS_A_ROW):
            some = gui.add_button_group("", tuple(names)[row : row + _GAITS_A_ROW])
            self._on_choice(some, lambda chosen: self._live.take(names[chosen]))
        own = gui.add_checkbox("the gait's own speed and stride", True)
        speed = gui.add_slider(
            "speed [m/s]", min=0.2, max=1.6, step=0.05, initial_value=1.2, disabled=True
        )
        stride = gui.add_slider(
            "stride [Hz]", min=1.0, max=3.5, step=0.1, initial_value=2.5, disabled=True
        )

        def command() -> None:
            speed.disabled = stride.disabled = bool(own.value)
            self._change(
                speed=None if own.value else float(speed.value),
                stride_frequency=None if own.value else float(stride.value),
            )

        for handle in (own, speed, stride):
            self._on_update(handle, command)

    def _build_condition(self, gui: Any, condition: Condition) -> None:
        names = tuple(CONDITIONS)
        now = next((name for name in names if CONDITIONS[name] == condition), names[0])
        name = gui.add_dropdown("condition", names, initial_value=now)
        ranges = {
            "alpha": ("α [m]", 0.001, 0.3, 0.001),
            "beta": ("β [counts]", 0, 1500, 1),
            "leak": ("leak [counts/step]", 0, 6, 0.01),
            "alpha_back": ("α' [m]", 0.001, 0.3, 0.0005),
            "beta_back": ("β' [counts]", 0, 1500, 1),
        }
        numbers = {
            key: gui.add_slider(
                label, min=low, max=high, step=step, initial_value=getattr(condition, key)
            )
            for key, (label, low, high, step) in ranges.items()
        }

        def tuned() -> None:
            values = {key: float(handle.value) for key, handle in numbers.items()}
            self._change(condition=replace(CONDITIONS[name.value], **values))

        def choose() -> None:
            for key, handle in numbers.items():
                handle.value = getattr(CONDITIONS[name.value], key)
            self._change(condition=CONDITIONS[name.value])

        self._on_update(name, choose)
        for handle in numbers.values():
            self._on_update(handle, tuned)

    def _build_ground(self, gui: Any, config: LiveConfig) -> None:
        track = gui.add_text("track", config.track)
        height = gui.add_slider(
            "noise [m]", min=0.0, max=0.25, step=0.01, initial_value=_amplitude(config.track)
        )
        seed = gui.add_number("seed", config.seed, min=0, step=1)
        robots = gui.add_slider(
            "robots", min=1, max=MOST_ROBOTS, step=1, initial_value=config.robots
        )

        def walk_anew() -> None:
            asked = {"track": track.value, "seed": int(seed.value), "robots": int(robots.value)}
            self._restart(replace(self._live.config, **asked))

        def raise_noise() -> None:
            track.value = with_amplitude(track.value, float(height.value))

        self._on_update(height, raise_noise)
        self._on_click(gui.add_button("walk there"), walk_anew)
        self._seed = seed

    # Orders ---------------------------------------------------------------------------------------

    def _on_click(self, button: Any, order: Callable[[], None]) -> None:
        def enqueue(_: Any) -> None:
            self._orders.put(order)

        button.on_click(enqueue)

    def _on_choice(self, group: Any, order: Callable[[str], None]) -> None:
        def enqueue(event: Any) -> None:
            chosen = str(event.target.value)
            self._orders.put(lambda: order(chosen))

        group.on_click(enqueue)

    def _on_update(self, handle: Any, order: Callable[[], None]) -> None:
        def enqueue(event: Any) -> None:
            if event.client is not None:  # not what the page itself has set
                self._orders.put(order)

        handle.on_update(enqueue)

    def _obey(self) -> None:
        """Carries out the orders that came in; what cannot be done is told on the page."""
        while True:
            try:
                order = self._orders.get_nowait()
            except queue.Empty:
                return
            try:
                order()
            except GaitshiftError as error:
                self._notify("that cannot be done", str(error), "red")

    def _change(self, **values: Any) -> None:
        self._live.change(replace(self._live.config, **values))

    def _restart(self, config: LiveConfig) -> None:
        self._save_recording()
        before = self._live.ground
        self._live.restart(config)
        self._singles = 1  # so that a page that is paused shows where they begin
        self._tape.clear()
        self._seed.value = config.seed
        if self._live.ground is not before:
            self._show_ground()

    def _show_ground(self) -> None:
        self._scene.set_ground(self._live.ground)
        self._scene.set_robots(self._live.config.robots)

    def _toggle_recording(self) -> None:
        if self._live.is_recording:
            self._save_recording()
        else:
            self._live.record()
            self._record.label = "end and save"

    def _save_recording(self) -> None:
        log = self._live.end_recording()
        self._record.label = "record"
        if log is None:
            return
        self._notify("recorded", self._save(log), "green")

    def _notify(self, title: str, body: str, colour: str) -> None:
        for client in self._server.get_clients().values():
            cast(Any, client).add_notification(title, body, color=colour)

    def _tell(self, frame: Frame) -> None:
        gait = self._live.gaits[int(frame.gait[0])].replace("_", "-")
        x = float(frame.qpos[0, 0])
        clock = f"{frame.time:.2f} s" if self._paused else f"{frame.time:.1f} s"
        state = "fallen" if frame.fallen[0] else f"{frame.speed[0]:.2f} m/s"
        count = "–"
        if frame.threshold[0]:
            config = self._live.config
            shifted = self._live.gaits[int(frame.gait[0])] != config.start
            soonest = config.condition.soonest(shifted=shifted)
            way = soonest * max(float(frame.speed[0]), 0.0)
            count = (
                f"k {frame.k[0]:.0f} of {frame.threshold[0]:.0f} (β: {soonest:.2f} s, {way:.2f} m)"
            )
        self._status.content = f"**{gait}** · {state} · {x:.1f} m · {clock} · {count}"


def _amplitude(track: str) -> float:
    """Of the first noise on a track, as far as the slider goes [m]."""
    for piece in track.split(","):
        kind, _, number = piece.strip().partition(":")
        if kind == "perlin":
            try:
                amplitude = float(number.partition("@")[0])
            except ValueError:
                break
            return min(amplitude, 0.25) if math.isfinite(amplitude) else 0.1
    return 0.1
