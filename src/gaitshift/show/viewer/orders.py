"""Orders of whoever looks at a page, carried out between two steps."""

import queue
from collections.abc import Callable
from typing import Any

from gaitshift.errors import GaitshiftError


class Orders:
    """Handles of the page give them from threads of the server's; the one that runs obeys."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()

    def on_click(self, button: Any, order: Callable[[], None]) -> None:
        """Gives the order whenever the button is clicked."""

        def enqueue(_: Any) -> None:
            self._waiting.put(order)

        button.on_click(enqueue)

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
        """Carries out what has come in, and says what cannot be done."""
        while True:
            try:
                order = self._waiting.get_nowait()
            except queue.Empty:
                return
            try:
                order()
            except GaitshiftError as error:
                refuse(error)
