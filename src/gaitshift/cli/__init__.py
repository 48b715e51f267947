"""The command `gaitshift`: a thin layer over the package, with one file per subcommand."""

import sys

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it."""


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line; ends the process with 0, 2 (bad input), 130 (Ctrl-C) or 143 (SIGTERM).

    A reader that closes the pipe (`| head`) is not an error, and causes no message.
    """
    try:
        from gaitshift.cli.app import run  # here, where Ctrl-C during its imports can be caught

        run(sys.argv[1:] if arguments is None else arguments)
    except KeyboardInterrupt as stop:
        print(f"gaitshift: {str(stop) or 'interrupted'}", file=sys.stderr)
        sys.exit(getattr(stop, "exit_code", INTERRUPTED))
