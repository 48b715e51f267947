"""Reads the command line, runs the subcommand, turns errors into one line and an exit code."""

import io
import os
import select
import sys
from contextlib import redirect_stderr
from typing import Annotated

import tyro

from gaitshift.cli.bench import Bench
from gaitshift.cli.demo import Demo
from gaitshift.cli.evaluate import Evaluate
from gaitshift.cli.gaits import Gaits
from gaitshift.cli.identify import Identify
from gaitshift.cli.output import say
from gaitshift.cli.record import Record
from gaitshift.cli.report import Report
from gaitshift.cli.reproduce import Reproduce
from gaitshift.cli.study import Study
from gaitshift.cli.train import Train
from gaitshift.cli.transitions import Transitions
from gaitshift.cli.view import View
from gaitshift.errors import GaitshiftError

Command = (
    Annotated[Demo, tyro.conf.subcommand("demo")]
    | Annotated[Gaits, tyro.conf.subcommand("gaits")]
    | Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Record, tyro.conf.subcommand("record")]
    | Annotated[Identify, tyro.conf.subcommand("identify")]
    | Annotated[Reproduce, tyro.conf.subcommand("reproduce")]
    | Annotated[Study, tyro.conf.subcommand("study")]
    | Annotated[Transitions, tyro.conf.subcommand("transitions")]
    | Annotated[Report, tyro.conf.subcommand("report")]
    | Annotated[View, tyro.conf.subcommand("view")]
    | Annotated[Bench, tyro.conf.subcommand("bench")]
)

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it."""


def main(arguments: list[str] | None = None) -> None:
    """Runs the command line; ends the process with 0, 2 (bad input) or 130 (Ctrl-C).

    A reader that has seen enough (`| head`) is no fault, and nothing is said of it.
    """
    try:
        _parse(arguments).run()
        sys.stdout.flush()  # here, where a closed pipe can still be met
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
    """Whether it is stdout whose reader is gone; then what is left to print goes nowhere."""
    look = select.poll()
    look.register(sys.stdout.fileno(), 0)  # errors and hang-ups are told in any case
    if not look.poll(0):
        return False
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return True


def _parse(arguments: list[str] | None) -> Command:
    """The command that the arguments ask for; `GaitshiftError` where they cannot be read."""
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            return tyro.cli(
                Command,  # pyright: ignore[reportArgumentType]  (a union of annotated types)
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


def _first_part(box: str) -> str:
    """What a box of tyro's says above its first rule, as one line."""
    lines = [line.strip("│ ") for line in box.splitlines()[1:]]
    rule = next((i for i, line in enumerate(lines) if line.startswith(("─", "╰"))), len(lines))
    return f"{' '.join(line for line in lines[:rule] if line)}; see --help"
