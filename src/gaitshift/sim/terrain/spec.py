"""Terrains written as text: `perlin:0.10`, or a track `flat@8,perlin:0.10@12,flat@10`."""

import re
from dataclasses import dataclass
from importlib import import_module

import numpy as np

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.grid import CELL_RANGE, LENGTH, Grid
from gaitshift.sim.terrain.height_field import Terrain
from gaitshift.sim.terrain.kind import Kind, Quantity, Seed
from gaitshift.sim.terrain.track import track

_TRACK = "flat@8,perlin:0.10@12,flat@10"
"""An example of a track."""

_FILES = (
    "shapes",
    "perlin",
    "pebbles",
)
"""The files beside this one that hold kinds of ground in `KINDS`; a new kind is a file and a line
here."""

KINDS: tuple[Kind, ...] = tuple(
    kind for file in _FILES for kind in import_module(f"gaitshift.sim.terrain.{file}").KINDS
)
"""Every kind of ground."""


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """One piece of a spec, read but not made."""

    text: str
    kind: Kind
    number: float
    length: float | None

    def make(self, seed: Seed, *, length: float, width: float, cell: float) -> Terrain:
        try:
            return self.kind.make(self.number, seed, length, width, cell)
        except GaitshiftError as error:
            raise _faulty(self.text, str(error)) from error


def from_spec(
    spec: str, *, seed: int, length: float, width: float, cell: float | None = None
) -> Terrain:
    """Terrain that a spec describes: one piece, or a track of pieces separated by commas.

    A piece is `NAME` or `NAME:NUMBER`, optionally followed by its length `@METRES`; the names and
    their numbers are in `KINDS`. A single piece without a length is `length` [m] long. Every piece
    of a track needs a length, which is rounded to whole cells; `length` is then ignored. `cell` [m]
    is the largest distance between samples; None: the finest default of the pieces. Fields begin at
    x = 0 with y = 0 in the middle.

    The same spec, seed and sizes give the same bits. In a track each piece draws from its own
    stream of the seed, so that a change of one piece does not change the noise of the others.

    `GaitshiftError`, one line that names the faulty piece and what is allowed.
    """
    if seed < 0:
        raise GaitshiftError(f"terrain {spec!r}: seed must be 0 or larger, got {seed}")
    pieces = [_read(text.strip()) for text in spec.split(",")]
    if cell is None:
        cell = min(piece.kind.cell for piece in pieces)
    if len(pieces) == 1:
        piece = pieces[0]
        return piece.make(seed, length=piece.length or length, width=width, cell=cell)
    CELL_RANGE.check(cell)
    lengths = [_whole_cells(piece, cell) for piece in pieces]
    try:
        Grid(length=sum(lengths), width=width, cell=cell)
    except GaitshiftError as error:
        raise _faulty(spec, str(error)) from error
    seeds = np.random.default_rng(seed).spawn(len(pieces))
    made = zip(pieces, seeds, lengths, strict=True)
    return track([p.make(s, length=x, width=width, cell=cell) for p, s, x in made])


def spec_help() -> str:
    """Grammar of specs, one line a kind, for the command line's `--help`."""
    lines = [f"{kind.usage}: {kind.meaning}" for kind in KINDS]
    return "\n".join([*lines, f"a track, pieces in a row with lengths in metres: {_TRACK}"])


_FORM = re.compile(r"(?P<name>[^:@]*)(:(?P<number>[^:@]*))?(@(?P<length>[^:@]*))?")


def _read(text: str) -> _Piece:
    """One piece read; `GaitshiftError` where it is not written as pieces are."""
    form = _FORM.fullmatch(text)
    if form is None:
        raise _faulty(text, "a piece must be NAME, NAME:NUMBER or NAME:NUMBER@METRES")
    kind = next((kind for kind in KINDS if kind.name == form["name"].strip()), None)
    if kind is None:
        raise _faulty(text, f"unknown terrain {form['name']!r}")
    written, length = form["number"], form["length"]
    if kind.number is None and written is not None:
        raise _faulty(text, f"{kind.name} must have no number, got {written}")
    if kind.number is not None and written is None:
        raise _faulty(text, f"{kind.number.name} is missing, must be {kind.number.range}")
    return _Piece(
        text=text,
        kind=kind,
        number=0.0 if kind.number is None else _number(text, str(written), kind.number),
        length=None if length is None else _number(text, length, LENGTH),
    )


def _number(text: str, written: str, quantity: Quantity) -> float:
    """Value of what is written, if it is a number in range, for the piece `text`."""
    try:
        return quantity.check(float(written))
    except ValueError:
        problem = f"{quantity.name} must be {quantity.range}, got {written!r}"
        raise _faulty(text, problem) from None
    except GaitshiftError as error:
        raise _faulty(text, str(error)) from None


def _whole_cells(piece: _Piece, cell: float) -> float:
    """Length of a piece of a track, rounded to whole cells [m]."""
    if piece.length is None:
        raise _faulty(piece.text, f"every piece of a track must have a length, as in {_TRACK}")
    return max(1, round(piece.length / cell)) * cell


def _faulty(text: str, problem: str) -> GaitshiftError:
    """Error about one piece, in one line."""
    usages = ", ".join(kind.usage for kind in KINDS)
    return GaitshiftError(f"terrain {text!r}: {problem}; known pieces: {usages}")
