"""Reads the command line, runs the subcommand, turns errors into one line and an exit code."""

import io
import os
import select
import sys
from contextlib import redirect_stderr
from dataclasses import make_dataclass
from importlib import import_module
from typing import Annotated, Any, Protocol, Union, cast, runtime_checkable

from gaitshift.cli.output import say
from gaitshift.errors import GaitshiftError

COMMANDS = {
    "demo": "Simulate a robot that crosses flat and rough ground and shifts its gait by itself.",
    "gaits": "List the gaits, print the machine of one as a Mermaid diagram, or draw the machines.",
    "train": "Train a gait with PPO: flat ground first, then rough ground with pushes.",
    "evaluate": "Evaluate a policy on many robots, without exploration noise.",
    "record": "Record gaits on the standard courses: flat, slopes, steps, stairs, pebbles, noise.",
    "identify": "Find α and β of a shift condition from logs, and judge them on others.",
    "reproduce": "Reproduce the paper: train trot, bound and pace with its recipe on five seeds, "
    "and ablations.",
    "study": "Compare robots on rough ground: in either gait alone, and with shifts by each "
    "condition.",
    "transitions": "Test gait shifts of every ordered pair of gaits at random phases of the "
    "stride.",
    "report": "Make one self-contained page of a log or of a training run.",
    "view": "Show robots in the browser: a live simulation with controls, or a log.",
    "bench": "Measure speed.",
}
"""The subcommands in the order of `--help`, with the first paragraph of their own help.

A new one is a line here and a file of its name beside this one, with a dataclass of its name:
`time-to-gait` is `TimeToGait` in `time_to_gait.py`. Only the file of the subcommand that runs is
imported.
"""


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
        _parse(sys.argv[1:] if arguments is None else arguments).run()
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


def _parse(arguments: list[str]) -> Command:
    """The command in the arguments; `GaitshiftError` where they cannot be read."""
    import tyro  # slow to import

    named = arguments[0] if arguments else ""
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            if named in COMMANDS:
                return tyro.cli(
                    _command(named),
                    prog=f"gaitshift {named}",
                    args=arguments[1:],
                    config=(tyro.conf.OmitArgPrefixes, tyro.conf.FlagCreatePairsOff),
                )
            return tyro.cli(
                _any_command(),
                prog="gaitshift",
                description=(
                    "Train quadruped gaits described by reward machines, and let the robot shift "
                    "between them by itself."
                ),
                args=arguments[:1],
            )
    except SystemExit as end:
        if end.code:
            raise GaitshiftError(_first_part(said.getvalue())) from None
        raise


def _command(name: str) -> type[Command]:
    """The dataclass of a subcommand."""
    module = import_module(f"gaitshift.cli.{name.replace('-', '_')}")
    return getattr(module, name.title().replace("-", ""))


def _any_command() -> Any:
    """All subcommands with their help and without their options: for `--help`, and for errors."""
    from tyro.conf import subcommand

    return cast(Any, Union)[
        tuple(
            Annotated[make_dataclass(name, ()), subcommand(name, description=help)]
            for name, help in COMMANDS.items()
        )
    ]


def _first_part(box: str) -> str:
    """The text of a tyro box above its first rule, as one line."""
    lines = [line.strip("│ ") for line in box.splitlines()[1:]]
    rule = next((i for i, line in enumerate(lines) if line.startswith(("─", "╰"))), len(lines))
    return f"{' '.join(line for line in lines[:rule] if line)}; see --help"
