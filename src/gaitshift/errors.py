"""The class of all errors that a user can cause."""


class GaitshiftError(Exception):
    """An input is wrong; the message names the setting or file, what is allowed and what it got.

    The command line prints the message as one line and ends with exit code 2. Signs that cannot be
    printed, such as line ends in a name that is quoted, are written as escapes.
    """

    def __init__(self, message: str) -> None:
        super().__init__("".join(sign if sign.isprintable() else _escape(sign) for sign in message))


def _escape(sign: str) -> str:
    return sign.encode("unicode_escape").decode("ascii")
