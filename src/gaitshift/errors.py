"""The errors a user can cause: one class, one clear line each."""


class GaitshiftError(Exception):
    """Something the user gave is wrong; the message says what, where, and what would be right.

    The command line prints the message as one line and ends with exit code 2.
    """
