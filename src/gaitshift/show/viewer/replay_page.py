"""The page of a log: its frames, with a slider over its time."""

import queue
from collections.abc import Callable, Mapping
from typing import Any, cast

import viser

from gaitshift.gait import RewardMachine, gaits
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.show.geometry import frames_of
from gaitshift.show.plots.signals import check_robot, ground_of
from gaitshift.show.viewer.charts import WINDOW, Charts, Tape
from gaitshift.show.viewer.live import MOST_ROBOTS
from gaitshift.show.viewer.scene import Scene
from gaitshift.show.viewer.server import TICK, Clock, as_markdown

_EVERY = round(TICK / CONTROL_PERIOD)
"""Entries of a log between two frames."""


class ReplayPage:
    """Shows a log on a page."""

    def __init__(self, server: viser.ViserServer, log: Log, robot: Robot = ANYMAL_B) -> None:
        """`robot` is the robot of the log; `GaitshiftError` if it is another one."""
        robot.check_is(log.robot, "the log")
        check_robot(log, 0)
        self._frames = frames_of(_few(log), _EVERY)
        self._scene = Scene(server, robot, log.gaits)
        self._scene.set_ground(ground_of(log))
        self._scene.set_robots(self._frames[0].step.n)
        self._tape, self._at, self._plays = Tape(), 0, True
        self._factor, self._owed = 1.0, 0.0
        self._orders: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self._build(server, log)

    def run(self, until: Callable[[], bool] = lambda: False) -> None:
        """Plays until `until()` is true, or for ever."""
        clock, picture, shown = Clock(), 0, -1
        while not until():
            while not self._orders.empty():
                self._orders.get_nowait()()
            if self._plays:
                self._owed += self._factor
                self._go_to((self._at + int(self._owed)) % len(self._frames))
                self._owed %= 1.0
            if self._at != shown:
                shown = self._at
                self._scene.draw(self._frames[self._at])
                picture += 1
                if picture % 6 == 0 or not self._plays:
                    self._charts.draw(self._tape)
                    self._slider.value = self._frames[self._at].time
            clock.wait()

    def _go_to(self, at: int) -> None:
        """Makes frame `at` the present one, with the tape up to it."""
        if 0 <= at - self._at <= 10:
            for index in range(self._at, at + 1):
                self._tape.add(self._frames[index])
        else:
            self._tape.clear()
            first = max(0, at - round(WINDOW / TICK))
            for frame in self._frames[first : at + 1]:
                self._tape.add(frame)
        self._at = at

    def _build(self, server: viser.ViserServer, log: Log) -> None:
        gui = cast(Any, server.gui)
        panel = gui.add_panel()
        with panel.add_tab("Signals"):
            self._charts = Charts(server, _machines(log))
        panel.dock_left()
        panel.set_width(340)
        end = self._frames[-1].time
        n = self._frames[0].step.n
        ground = as_markdown(log.terrain)
        gui.add_markdown(f"{ground} · {n} robot{'s' if n > 1 else ''} · {end:.1f} s")
        play = gui.add_button("pause")
        self._slider = gui.add_slider(
            "time [s]", min=0.0, max=end, step=TICK, initial_value=self._frames[0].time
        )
        pace = gui.add_slider("times real time", min=0.1, max=4.0, step=0.1, initial_value=1.0)
        follow = gui.add_checkbox("camera follows", True)

        def toggle() -> None:
            self._plays = not self._plays
            play.label = "pause" if self._plays else "play"

        def seek() -> None:
            self._go_to(min(round(self._slider.value / TICK), len(self._frames) - 1))

        def put(order: Callable[[], None]) -> Callable[[Any], None]:
            def enqueue(event: Any) -> None:
                if event.client is not None:  # not what the page itself has set
                    self._orders.put(order)

            return enqueue

        play.on_click(put(toggle))
        self._slider.on_update(put(seek))
        pace.on_update(put(lambda: setattr(self, "_factor", float(pace.value))))
        follow.on_update(put(lambda: setattr(self._scene, "follows", bool(follow.value))))


def _machines(log: Log) -> Mapping[str, RewardMachine | None]:
    """The machines of the log's gaits; None for a gait that is not shipped."""
    known = gaits.names()
    return {name: gaits.load(name) if name in known else None for name in log.gaits}


def _few(log: Log) -> Log:
    """The first robots of a log, at most as many as a page shows."""
    return log if log.n <= MOST_ROBOTS else log.robots(slice(0, MOST_ROBOTS))
