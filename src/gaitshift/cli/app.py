"""Reads the command line, runs the subcommand, turns errors into one line and an exit code."""

import io
import os
import select
import sys
from contextlib import redirect_stderr
from importlib import import_module
from typing import Annotated, Any, Protocol, Union, cast, runtime_checkable

import tyro

from gaitshift.cli.output import say
from gaitshift.errors import GaitshiftError

COMMANDS = (
    "demo",
    "gaits",
    "train",
    "evaluate",
    "record",
    "identify",
    "reproduce",
    "study",
    "transitions",
    "report",
    "view",
    "bench",
)
"""The subcommands in the order of `--help`. A new one is a line here and a file of its name beside
this one, with a dataclass of its name: `time-to-gait` is `TimeToGait` in `time_to_gait.py`."""


@runtime_checkable
class Command(Protocol):
    """A subcommand: a dataclass whose fields are its options."""

    def run(self) -> None:
        """Runs the command; `GaitshiftError` for bad input."""


INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it."""


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line; ends the process with 0, 2 (bad input) or 130 (Ctrl-C).

    A reader that closes the pipe (`| head`) is not an error, and causes no message.
    """
    try:
        _parse(arguments).run()
        sys.stdout.flush()  # here, where the error of a closed pipe can be caught
    except GaitshiftError as error:
        say(f"gaitshift: {error}")
        sys.exit(2)
    except KeyboardInterrupt:
        say("gaitshift: interrupted")
        sys.exit(INTERRUPTED)
    except OSError as error:
        if isinstance(error, BrokenPipeError) and _nobody_reads():
            sys.exit(0)
        where = "" if error.filename is None else f"{error.filename}: "
        say(f"gaitshift: {where}{error.strerror or error}")
        sys.exit(2)


def _nobody_reads() -> bool:
    """Whether stdout has no reader; if so, the rest of the output is discarded."""
    look = select.poll()
    look.register(sys.stdout.fileno(), 0)  # errors and hang-ups are always reported
    if not look.poll(0):
        return False
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return True


def _parse(arguments: list[str] | None) -> Command:
    """The command in the arguments; `GaitshiftError` where they cannot be read."""
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            return tyro.cli(
                cast(Any, Union)[tuple(_subcommand(name) for name in COMMANDS)],
                prog="gaitshift",
                description=(
                    "Train quadruped gaits described by reward machines, and let the robot shift "
                    "between them by itself."
                ),
                args=arguments,
                config=(tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff),
            )
    except SystemExit as end:
        if end.code:
            raise GaitshiftError(_first_part(said.getvalue())) from None
        raise


def _subcommand(name: str) -> Any:
    module = import_module(f"gaitshift.cli.{name.replace('-', '_')}")
    made = getattr(module, name.title().replace("-", ""))
    return Annotated[made, tyro.conf.subcommand(name)]


def _first_part(box: str) -> str:
    """The text of a tyro box above its first rule, as one line."""
    lines = [line.strip("│ ") for line in box.splitlines()[1:]]
    rule = next((i for i, line in enumerate(lines) if line.startswith(("─", "╰"))), len(lines))
    return f"{' '.join(line for line in lines[:rule] if line)}; see --help"
