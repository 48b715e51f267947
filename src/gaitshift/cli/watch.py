"""The page beside a training: a process of its own, which takes the time that is left."""

import multiprocessing
import os
import signal
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from gaitshift.cli.output import say
from gaitshift.cli.view import RECORDINGS, save_recording
from gaitshift.errors import GaitshiftError

HOST = "127.0.0.1"

PUBLISH_EVERY = 3.0
"""Time between two policies for the page [s]; ours: one costs 0.1 s."""


class Watch:
    """Serves the live page of a training during the block."""

    def __init__(self, folder: Path, port: int) -> None:
        self._folder, self._port = folder, port

    def __enter__(self) -> None:
        """Returns when the page can be opened.

        Raises:
            GaitshiftError: a package is missing, or the port is taken.
        """
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        self._process = context.Process(
            target=_serve, args=(self._folder, self._port, there), daemon=True
        )
        self._process.start()
        there.close()
        try:
            problem: str = here.recv()
        except EOFError:
            problem = "the page of --watch ended at once"
        if problem:
            raise GaitshiftError(problem)
        say(f"watch it at http://{HOST}:{self._port}")

    def __exit__(self, *_: object) -> None:
        self._process.terminate()
        self._process.join()


def _serve(folder: Path, port: int, ready: "Connection[str, Any]") -> None:
    """Serves the page until the training ends, also if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the training ends first, and then this page
    _yield_to_others()
    try:
        from gaitshift.show.viewer import LivePage, Training, close, serve

        training = Training(folder)
        server = serve(HOST, port)
    except GaitshiftError as error:
        ready.send(str(error))
        return
    except ImportError as error:
        ready.send(f"--watch needs the package '{error.name}'; install gaitshift[view]")
        return
    save = partial(save_recording, folder=RECORDINGS, robot=training.robot)
    page = LivePage(server, training.live(), save, training)
    ready.send("")
    parent = multiprocessing.parent_process()
    page.run(lambda: parent is not None and not parent.is_alive())
    close(server)


def _yield_to_others() -> None:
    """Gives this process the lowest priority, so that it takes only the time that is left."""
    if hasattr(os, "SCHED_IDLE"):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
    elif hasattr(os, "nice"):
        os.nice(19)
