"""The page's server, its real-time clock, and the queue of orders from the page."""

import io
import queue
import socket
import time
from collections.abc import Callable
from contextlib import redirect_stdout
from typing import Any, cast

import viser

from gaitshift.errors import GaitshiftError

TICK = 0.02
"""Time between two frames [s]."""

_LATE = 0.25
"""A clock that is late by more than this skips the lost time [s]."""

_CAMERA = (-1.6, -2.4, 1.3)
"""Initial position of the camera, which looks towards the origin [m]."""


def serve(host: str, port: int) -> viser.ViserServer:
    """Opens the page.

    Raises:
        GaitshiftError: the address or port is not available.
    """
    if not 1 <= port <= 65535:
        raise GaitshiftError(f"port must be 1 to 65535, got {port}")
    try:
        family, *_, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        with socket.socket(family) as trial:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind(address)
    except (OSError, UnicodeError) as error:  # a name that is no host name is a UnicodeError
        reason = getattr(error, "strerror", None) or error
        raise GaitshiftError(
            f"cannot listen on {host}:{port} ({reason}); give another --host or --port"
        ) from error
    with redirect_stdout(io.StringIO()):  # it prints a box of its own
        server = viser.ViserServer(host=host, port=port, label="gaitshift", verbose=False)
    gui = cast(Any, server.gui)
    gui.configure_theme(
        show_logo=False,
        show_share_button=False,
        brand_color=(0, 114, 178),
    )
    gui.set_panel_label("gaitshift")
    gui.main_panel.dock_right()
    gui.main_panel.set_width(330)
    server.initial_camera.position = _CAMERA
    server.initial_camera.look_at = (0.0, 0.0, 0.35)
    return server


def address_of(host: str, port: int) -> str:
    """The address that opens the page on this machine."""
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)  # not addresses, but all of them
    return f"http://[{host}]:{port}" if ":" in host else f"http://{host}:{port}"


def as_markdown(text: str) -> str:
    """Text for a page's Markdown, in which no sign means anything but itself."""
    return "".join(sign if sign.isalnum() or sign in " ,.@" else f"&#{ord(sign)};" for sign in text)


def close(server: viser.ViserServer) -> None:
    """Closes the page."""
    with redirect_stdout(io.StringIO()):
        server.stop()


class Clock:
    """Waits between frames, at a multiple of real time."""

    def __init__(self) -> None:
        self._due = time.perf_counter()

    def wait(self) -> None:
        """Waits until the next frame is due."""
        self._due += TICK
        left = self._due - time.perf_counter()
        if left > 0:
            time.sleep(left)
        elif left < -_LATE:
            self._due = time.perf_counter()


class Orders:
    """Orders of the page: threads of the server add them, and the running thread executes them."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def on_click(self, button: Any, order: Callable[[], None]) -> None:
        """Gives the order whenever the button is clicked."""

        def enqueue(_: Any) -> None:
            self._waiting.put(order)

        button.on_click(enqueue)

    def on_key(self, command: Any, order: Callable[[], None]) -> None:
        """Gives the order whenever the key of the command is pressed."""

        def enqueue(_: Any) -> None:
            self._waiting.put(order)

        command.on_trigger(enqueue)

    def on_choice(self, group: Any, order: Callable[[str], None]) -> None:
        """Gives the order with the name of the button that is clicked."""

        def enqueue(event: Any) -> None:
            chosen = str(event.target.value)
            self._waiting.put(lambda: order(chosen))

        group.on_click(enqueue)

    def on_update(self, handle: Any, order: Callable[[], None]) -> None:
        """Gives the order whenever someone, not the page itself, changes the handle's value."""

        def enqueue(event: Any) -> None:
            if event.client is not None:
                self._waiting.put(order)

        handle.on_update(enqueue)

    def obey(self, refuse: Callable[[GaitshiftError], None]) -> None:
        """Executes the waiting orders, and reports those that fail."""
        while True:
            try:
                order = self._waiting.get_nowait()
            except queue.Empty:
                return
            try:
                order()
            except GaitshiftError as error:
                refuse(error)
