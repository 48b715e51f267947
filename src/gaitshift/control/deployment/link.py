"""The way of datagrams to a peer and back, with the clock that they are timed by."""

import errno
import select
import socket
import time
from contextlib import suppress
from typing import Protocol, runtime_checkable

from gaitshift.errors import GaitshiftError

MOST_BYTES = 2048
"""Longest datagram that is read; a longer one is cut, and malformed."""

_MOST_WAITING = 256
"""Most datagrams that are taken at once where the time is over; ours: a flood cannot stop the
loop."""


@runtime_checkable
class Link(Protocol):
    """Datagrams to and from one peer."""

    def now(self) -> float:
        """A monotonic clock [s]."""
        ...

    def receive(self, until: float) -> list[tuple[bytes, float]]:
        """Datagrams that arrive until this time [s], and when; those that wait already too."""
        ...

    def send(self, data: bytes) -> None:
        """Sends a datagram; one that cannot be sent is lost."""
        ...


class UdpLink:
    """A UDP socket that is connected to its peer: datagrams of other addresses never arrive."""

    def __init__(self, host: str, port: int, peer: str) -> None:
        """Listens on `host`:`port` for `peer`, written HOST:PORT.

        Raises:
            GaitshiftError: an address is wrong, or the port is in use.
        """
        self.peer = peer
        """The peer's address."""
        _check_port("port", port)
        there = _resolved(*_split(peer))
        family = there[0]
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.bind(_resolved(host, port, family)[1])
            self._socket.connect(there[1])
        except GaitshiftError:
            self._socket.close()
            raise
        except OSError as error:
            self._socket.close()
            if error.errno == errno.EADDRINUSE:
                raise GaitshiftError(
                    f"port {port} on {host} is in use; give another --port"
                ) from None
            raise GaitshiftError(
                f"{peer} cannot be reached from {host}:{port}: {error.strerror}"
            ) from None
        self._socket.setblocking(False)

    def __enter__(self) -> "UdpLink":
        return self

    def __exit__(self, *_: object) -> None:
        self._socket.close()

    def now(self) -> float:
        """A monotonic clock [s]."""
        return time.monotonic()

    def receive(self, until: float) -> list[tuple[bytes, float]]:
        """Datagrams that arrive until this time [s], and when; those that wait already too."""
        got = list[tuple[bytes, float]]()
        while True:
            left = until - self.now()
            if left <= 0.0 and len(got) >= _MOST_WAITING:
                return got
            if not select.select([self._socket], [], [], max(left, 0.0))[0]:
                return got
            with suppress(OSError):  # the peer's port is closed, which a send before found out
                got.append((self._socket.recv(MOST_BYTES), self.now()))

    def send(self, data: bytes) -> None:
        """Sends a datagram; one that cannot be sent is lost."""
        with suppress(OSError):
            self._socket.send(data)


def _split(peer: str) -> tuple[str, int]:
    host, _, port = peer.rpartition(":")
    if not host or not port.isascii() or not port.isdecimal():
        raise GaitshiftError(f"peer must be HOST:PORT, such as 127.0.0.1:9870, got '{peer}'")
    _check_port("port of the peer", int(port))
    return host.removeprefix("[").removesuffix("]"), int(port)


def _check_port(what: str, port: int) -> None:
    if not 1 <= port <= 65535:
        raise GaitshiftError(f"{what} must be 1 to 65535, got {port}")


def _resolved(
    host: str, port: int, family: int = socket.AF_UNSPEC
) -> tuple[socket.AddressFamily, tuple[str, int] | tuple[str, int, int, int] | tuple[int, bytes]]:
    """Family and address of the first entry for a host; `GaitshiftError` where there is none."""
    try:
        found = socket.getaddrinfo(host, port, family=family, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        why = error.strerror if isinstance(error, OSError) else "no name of a host"
        raise GaitshiftError(f"host '{host}' cannot be found: {why}") from None
    return found[0][0], found[0][4]
