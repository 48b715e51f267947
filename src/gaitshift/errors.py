"""The class of all errors that a user can cause."""


class GaitshiftError(Exception):
    """An input is wrong; the message names the setting or file, what is allowed and what it got.

    The command line prints the message as one line and ends with exit code 2.
    """
