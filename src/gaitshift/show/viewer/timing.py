"""Whether a live page runs in real time, with a client that receives all that it sends."""

import multiprocessing as mp
import os
import socket
import time
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import Any

import viser
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.show.viewer.live import MOST_ROBOTS, LiveConfig, LiveRun
from gaitshift.show.viewer.live_page import LivePage
from gaitshift.show.viewer.server import close, serve

_HOST = "127.0.0.1"

ROBOTS = (1, MOST_ROBOTS)
"""Numbers of robots for which the speed is measured: one, and the most that a page shows."""

_PATIENCE = 60.0
"""Longest time until the client has connected [s]."""


def page_speed(robots: int, seconds: float, policies: Mapping[str, Policy]) -> dict[str, float]:
    """Speed of a page of walking robots, on one core where the system can restrict it to one.

    A client in another process, on any core, receives the data that a browser would receive.

    Args:
        robots: on the track.
        seconds: that the page runs [s]; 1 to 3600.
        policies: of the gaits.

    Returns:
        `real_time`: seconds walked per second; the target is 1.
        `pictures_per_s`: pictures drawn per second; the target is 50.
        `core_share`: share of one core's time, by all threads of the page's process.
        `sent_mb_per_s`: data received by the client per second.
    """
    if not 1.0 <= seconds <= 3600.0:
        raise GaitshiftError(f"page_seconds must be 1 to 3600 s, got {seconds:g}")
    port = _free_port()
    with _on_one_core(), _served(port) as server:
        page = LivePage(server, LiveRun(LiveConfig(robots=robots), policies), lambda log: "")
        with _watched(f"ws://{_HOST}:{port}") as taken_in:
            start, spent = time.perf_counter(), time.process_time()
            before = taken_in.value
            page.run(until=lambda: time.perf_counter() - start > seconds)
            lasted = time.perf_counter() - start
            return {
                "real_time": page.walked / lasted,
                "pictures_per_s": page.pictures / lasted,
                "core_share": (time.process_time() - spent) / lasted,
                "sent_mb_per_s": (taken_in.value - before) / 1e6 / lasted,
            }


@contextmanager
def _served(port: int) -> Generator[viser.ViserServer]:
    server = serve(_HOST, port)
    try:
        yield server
    finally:
        close(server)


@contextmanager
def _on_one_core() -> Generator[None]:
    """Restricts this thread, and those that it starts, to one core; on Linux only."""
    if not hasattr(os, "sched_setaffinity"):
        yield
        return
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {max(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


@contextmanager
def _watched(address: str) -> Generator[Any]:
    """A client at this address; yields the number of bytes that it has received so far."""
    context = mp.get_context("spawn")
    taken_in = context.Value("q", 0)
    client = context.Process(target=_take_in, args=(address, taken_in), daemon=True)
    client.start()
    try:
        deadline = time.perf_counter() + _PATIENCE
        while taken_in.value == 0:
            if not client.is_alive() or time.perf_counter() > deadline:
                raise GaitshiftError(f"a client could not connect to the page at {address}")
            time.sleep(0.05)
        yield taken_in
    finally:
        client.terminate()
        client.join()


def _take_in(address: str, taken_in: Any) -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, range(os.cpu_count() or 1))
    protocol = Subprotocol(f"viser-v{viser.__version__}")
    with connect(address, subprotocols=[protocol], max_size=None) as page:
        for message in page:
            taken_in.value += len(message)


def _free_port() -> int:
    with socket.socket() as trial:
        trial.bind((_HOST, 0))
        return trial.getsockname()[1]
