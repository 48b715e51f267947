"""The newest valid datagram of a peer, and how many were dropped and why."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

from gaitshift.control.deployment.layout import Malformed


class _Numbered(Protocol):
    @property
    def sequence(self) -> int: ...
    @property
    def stamp(self) -> int: ...


Message = TypeVar("Message", bound=_Numbered)


@dataclass
class Counts:
    """Datagrams that arrived."""

    accepted: int = 0
    """Valid and newer than all before."""
    malformed: int = 0
    """Dropped: another length, header, CRC, or a field out of range."""
    late: int = 0
    """Dropped: a duplicate, out of order, or an answer to sensors long past."""


class Inbox(Generic[Message]):
    """Keeps the newest datagram of one kind; sequence and time stamp must both rise."""

    def __init__(
        self,
        decode: Callable[[bytes], Message],
        is_timely: Callable[[Message], bool] = lambda message: True,
    ) -> None:
        """`is_timely` may drop a decoded message as late; it raises `Malformed` for a wrong one."""
        self._decode, self._is_timely = decode, is_timely
        self.newest: Message | None = None
        """The newest datagram; None before the first."""
        self.arrived = 0.0
        """When it arrived [s]."""
        self.counts = Counts()

    def add(self, data: bytes, arrived: float) -> bool:
        """Takes a datagram that arrived at this time [s]; whether it is now the newest."""
        try:
            message = self._decode(data)
            timely = self._is_timely(message)
        except Malformed:
            self.counts.malformed += 1
            return False
        before = self.newest
        rises = before is None or (
            message.sequence > before.sequence and message.stamp > before.stamp
        )
        if not (timely and rises):
            self.counts.late += 1
            return False
        self.counts.accepted += 1
        self.newest, self.arrived = message, arrived
        return True
