"""The page beside a training: a process of its own, which takes the time that is left."""

import multiprocessing
import os
import signal
import threading
from contextlib import suppress
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path

from gaitshift.cli.output import say
from gaitshift.cli.view import RECORDINGS, save_recording
from gaitshift.errors import GaitshiftError

HOST = "127.0.0.1"

PUBLISH_EVERY = 3.0
"""Time between two policies for the page [s]; ours: one costs 0.1 s."""


LEAST = 19
"""The lowest priority of a process that still gets some time beside others."""


class Watch:
    """Serves the live page while its `with` block runs; `show` names the training to show."""

    def __init__(self, port: int) -> None:
        self._port = port

    def __enter__(self) -> "Watch":
        """Returns when the page can be opened.

        Raises:
            GaitshiftError: a package is missing, or the port is taken.
        """
        context = multiprocessing.get_context("spawn")
        self._connection, there = context.Pipe()
        self._process = context.Process(target=_serve, args=(self._port, there), daemon=True)
        self._process.start()
        there.close()
        try:
            problem: str = self._connection.recv()
        except EOFError:
            problem = "the page of --watch ended at once"
        if problem:
            raise GaitshiftError(problem)
        return self

    def show(self, folder: Path) -> None:
        """Shows the training in this folder, which has a policy."""
        self._connection.send(folder)
        say(f"watch it at http://{HOST}:{self._port}")

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.join()


def _serve(port: int, connection: "Connection[str, Path]") -> None:
    """Serves the page until the training ends, also if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the training ends first, and then this page
    try:
        from gaitshift.show.viewer import LivePage, Training, close, serve

        server = serve(HOST, port)
    except GaitshiftError as error:
        connection.send(str(error))
        return
    except ImportError as error:
        connection.send(f"--watch needs the package '{error.name}'; install gaitshift[view]")
        return
    connection.send("")
    try:
        folder = connection.recv()
    except EOFError:  # the training did not begin
        return
    training = Training(folder)
    save = partial(save_recording, folder=RECORDINGS, robot=training.robot)
    page = LivePage(server, training.live(), save, training)
    _yield_to_others()  # not before: on a busy machine the page would not come to be
    parent = multiprocessing.parent_process()
    page.run(lambda: parent is not None and not parent.is_alive())
    close(server)


def _yield_to_others() -> None:
    """Gives all threads of this process the lowest priority, so that it takes idle time."""
    for thread in threading.enumerate():
        with suppress(OSError, AttributeError):  # Windows has none
            os.setpriority(os.PRIO_PROCESS, thread.native_id or 0, LEAST)
