"""The live page: robots walk, and the user gives orders."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import viser

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.show.geometry import Frame
from gaitshift.show.viewer.charts import Charts, Tape
from gaitshift.show.viewer.live import LiveConfig, LiveRun
from gaitshift.show.viewer.panels import (
    build_commands,
    build_condition,
    build_gaits,
    build_ground,
    build_push,
)
from gaitshift.show.viewer.scene import Scene
from gaitshift.show.viewer.server import TICK, Clock, Orders
from gaitshift.show.viewer.training import Curves, Training

_CHARTS_EVERY = 6
"""Frames between two updates of the charts."""

_STEPS = round(TICK / CONTROL_PERIOD)
"""Control steps between two frames in real time."""


class LivePage:
    """Shows a `LiveRun` on a page. The running thread executes orders between two steps."""

    def __init__(
        self,
        server: viser.ViserServer,
        live: LiveRun,
        save: Callable[[Log], str],
        training: Training | None = None,
    ) -> None:
        """`save` saves a recording, and returns a line that says where.

        With a training, whose gait is the only one, the page has its curve, and the robots go on
        with each new policy.
        """
        self._server, self._save, self._training = server, save, training
        self._live = live
        self._scene = Scene(server, live.robot, live.gaits)
        self._tape = Tape()
        self._orders = Orders()
        self._paused = False
        self._singles = 0  # single steps that are asked for
        self._last: Frame | None = None
        self._factor = 1.0
        self._owed = 0.0
        self.pictures = 0
        """Number of frames drawn so far."""
        self.walked = 0.0
        """Time that robots have walked so far, over all restarts [s]."""
        self._build()
        self._show_ground()

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Walks and draws until `until()` is true, or for ever."""
        clock = Clock()
        while not until():
            self._orders.obey(self._refuse)
            self._learn()
            frame = self._advance()
            if frame is not None:
                self._scene.draw(frame)
                self.pictures += 1
                if self.pictures % _CHARTS_EVERY == 0 or self._paused:
                    self._charts.draw(self._tape)
                    self._tell(frame)
            clock.wait()

    def _learn(self) -> None:
        """Takes the newest policy of the training, if there is one."""
        policy = self._training.look() if self._training is not None else None
        if policy is None or self._training is None:
            return
        self._live.learn(policy)
        try:
            self._curves.draw(self._training)
        except GaitshiftError as error:
            self._refuse(error)

    def _advance(self) -> Frame | None:
        """Runs the steps that are due; returns the last frame, None without a step."""
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
        gui = cast(Any, self._server.gui)
        panel = gui.add_panel()
        if self._training is not None:
            with panel.add_tab("Training"):
                self._curves = Curves(gui)
            self._curves.draw(self._training)
        with panel.add_tab("Signals"):
            self._charts = Charts(self._server, self._live.machines)
        panel.dock_left()
        panel.set_width(340)
        self._status = gui.add_markdown("")
        self._build_clock(gui)
        with gui.add_folder("Gait"):
            if self._training is None:
                build_gaits(gui, self._orders, self._live)
            build_commands(gui, self._orders, self._live)
        if self._training is None:
            with gui.add_folder("Condition"):
                build_condition(gui, self._orders, self._live)
        with gui.add_folder("Push"):
            build_push(gui, self._orders, self._live)
        with gui.add_folder("Ground", expand_by_default=False):
            self._seed = build_ground(gui, self._orders, self._live, self._restart)
        with gui.add_folder("Recording", expand_by_default=False):
            self._record = gui.add_button("record")
            self._orders.on_click(self._record, self._toggle_recording)

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

        self._orders.on_click(pause, toggle)

        def other(chosen: str) -> None:
            if chosen == "restart":
                self._restart(self._live.config)
            else:
                self._singles += 1

        self._orders.on_choice(others, other)
        self._orders.on_update(pace, lambda: setattr(self, "_factor", float(pace.value)))
        self._orders.on_update(follow, lambda: setattr(self._scene, "follows", bool(follow.value)))

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

    def _refuse(self, error: GaitshiftError) -> None:
        self._notify("error", str(error), "red")

    def _notify(self, title: str, body: str, colour: str) -> None:
        for client in self._server.get_clients().values():
            cast(Any, client).add_notification(title, body, color=colour)

    def _tell(self, frame: Frame) -> None:
        step, speed = frame.step, float(frame.step.truth.forward_speed[0])
        gait = self._live.gaits[int(step.gait[0])].replace("_", "-")
        x = float(step.truth.base_position_w[0, 0])
        clock = f"{frame.time:.2f} s" if self._paused else f"{frame.time:.1f} s"
        state = "fallen" if step.fallen[0] else f"{speed:.2f} m/s"
        count = "–"
        if step.threshold[0]:
            graph, gait_now = self._live.config.graph, self._live.gaits[int(step.gait[0])]
            edge = next(edge for edge in graph.edges if edge.source == gait_now)
            soonest = edge.rule.soonest(graph.statistics[edge.statistic].width)
            way = soonest * max(speed, 0.0)
            count = (
                f"k {step.k[0]:.0f} of {step.threshold[0]:.0f} (β: {soonest:.2f} s, {way:.2f} m)"
            )
        self._status.content = f"**{gait}** · {state} · {x:.1f} m · {clock} · {count}"
