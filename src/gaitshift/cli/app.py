"""Reads the command line, runs the subcommand, turns errors into one line and an exit code."""

import io
import os
import select
import signal
import sys
from collections import Counter
from collections.abc import Generator
from contextlib import contextmanager, redirect_stderr
from dataclasses import make_dataclass
from importlib import import_module
from itertools import groupby
from typing import Annotated, Any, Protocol, Union, cast, runtime_checkable

from gaitshift.cli.output import say
from gaitshift.errors import GaitshiftError
from gaitshift.show import opengl

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
    "map": "Measure survival, progress and cost of gaits at many speeds, on many grounds.",
    "plan": "Identify a gait graph from a map: which gait at which speed, and where to shift.",
    "report": "Make one self-contained page of a log or of a training run.",
    "deploy": "Drive a robot that is reached by datagrams, at 100 Hz, and stop it softly.",
    "robot-sim": "Simulate a robot in real time that is reached by datagrams, for `deploy`.",
    "view": "Show robots in the browser: a live simulation with controls, a log, or a training.",
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


class Terminated(KeyboardInterrupt):
    """SIGTERM: the command ends as after Ctrl-C."""

    exit_code = 128 + signal.SIGTERM


def run(arguments: list[str]) -> None:
    """Runs the subcommand; ends the process with 2 after an error that a user can cause.

    Raises:
        KeyboardInterrupt: Ctrl-C; `Terminated` after SIGTERM.
    """
    _prepare_streams()
    try:
        with _stoppable(), opengl.postponed():
            _run(arguments)
    except GaitshiftError as error:
        say(f"gaitshift: {error}")
        sys.exit(2)
    except OSError as error:
        if isinstance(error, BrokenPipeError) and _nobody_reads():
            _end_output()
            sys.exit(0)
        where = "" if error.filename is None else f"{error.filename}: "
        say(f"gaitshift: {where}{error.strerror or error}")
        _end_output()
        sys.exit(2)


def _run(arguments: list[str]) -> None:
    try:
        _parse(arguments).run()
    except SystemExit:  # after `--help`
        sys.stdout.flush()
        raise
    sys.stdout.flush()  # here, where the error of a closed pipe can be caught


def _prepare_streams() -> None:
    """Standard streams that are open and encode any text.

    A closed one (`>&-`) becomes the null device: otherwise the next file gets its number, and what
    is printed. A character that is not in the encoding of the terminal is written as its number.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        stream = getattr(sys, name)
        if stream is None:
            null = os.open(os.devnull, os.O_RDWR)  # the lowest free number, which is its own
            setattr(sys, name, os.fdopen(null, mode, encoding="utf-8"))
        elif mode == "w" and isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


@contextmanager
def _stoppable() -> Generator[None]:
    """Ctrl-C and SIGTERM raise, and end the command whatever becomes of their exception.

    A compiled module that is stopped while it is imported raises an `ImportError` in its place.
    """
    stops: list[KeyboardInterrupt] = []

    def stop(number: int, _: object) -> None:
        stops.append(KeyboardInterrupt() if number == signal.SIGINT else Terminated("terminated"))
        raise stops[-1]

    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    for number, handler in before.items():
        if handler is not signal.SIG_IGN:  # as of a shell's background job
            signal.signal(number, stop)
    try:
        yield
    except Exception:
        if stops:
            raise stops[0] from None
        raise
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _nobody_reads() -> bool:
    """Whether stdout has no reader."""
    look = select.poll()
    look.register(sys.stdout.fileno(), 0)  # errors and hang-ups are always reported
    return bool(look.poll(0))


def _end_output() -> None:
    """Writes the rest of the output; discards it where Python, at its end, would fail again."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _parse(arguments: list[str]) -> Command:
    """The command in the arguments; `GaitshiftError` where they cannot be read."""
    import tyro  # slow to import

    named = arguments[0] if arguments else ""
    _refuse_repeated(arguments)
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


def _refuse_repeated(arguments: list[str]) -> None:
    """Options that stand twice, of which tyro would take the last and say nothing."""
    options = (word.split("=")[0].replace("_", "-") for word in arguments if word[:2] == "--")
    for option, number in Counter(options).items():
        if number > 1:
            raise GaitshiftError(
                f"{option} must be given once, with all of its values after it, got {number} times"
            )


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
    """The text of a tyro box between its title and its next rule, as one line."""
    lines = [line.strip("│ ") for line in box.splitlines()[1:]]
    parts = (list(part) for is_rule, part in groupby(lines, _is_rule) if not is_rule)
    return f"{' '.join(line for line in next(parts, list[str]()) if line)}; see --help"


def _is_rule(line: str) -> bool:
    return bool(line) and set(line) <= set("─╰╯-")
