"""Terrains written as text: `perlin:0.10`, or a track `flat@8,perlin:0.10@12,flat@10`."""

import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.grid import CELL, CELL_RANGE, FINE_CELL, LENGTH, Grid
from gaitshift.sim.terrain.height_field import Terrain
from gaitshift.sim.terrain.pebbles import PEBBLE_HEIGHT, pebbles
from gaitshift.sim.terrain.perlin import AMPLITUDE, perlin
from gaitshift.sim.terrain.quantity import Quantity
from gaitshift.sim.terrain.shapes import (
    INCLINE,
    RISE,
    STEP_HEIGHT,
    bank,
    flat,
    slope,
    stairs,
    step,
)
from gaitshift.sim.terrain.track import track

_Seed = int | np.random.Generator

_TRACK = "flat@8,perlin:0.10@12,flat@10"
"""An example of a track."""


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A word of the language of specs."""

    name: str
    """The word."""
    number: Quantity | None
    """What stands behind its colon; None where nothing does."""
    cell: float
    """Its distance between samples where none is asked for [m]."""
    meaning: str
    """One line for `--help`."""
    make: Callable[[float, _Seed, float, float, float], Terrain]
    """Ground of a number, seed, length, width and cell [m]; some need no number or no seed."""

    @property
    def usage(self) -> str:
        """How it is written: `perlin:AMPLITUDE [0 to 1 m]`."""
        if self.number is None:
            return self.name
        return f"{self.name}:{self.number.name.upper()} [{self.number.range}]"


KINDS = (
    Kind(
        name="flat",
        number=None,
        cell=CELL,
        meaning="level ground",
        make=lambda number, seed, length, width, cell: flat(length, width, cell=cell),
    ),
    Kind(
        name="perlin",
        number=AMPLITUDE,
        cell=CELL,
        meaning="fractal noise with this largest |height|; wavelength 1.5 m, 3 octaves",
        make=lambda number, seed, length, width, cell: perlin(
            number, seed=seed, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="slope",
        number=INCLINE,
        cell=CELL,
        meaning="a plane rising along +x; negative: downhill",
        make=lambda number, seed, length, width, cell: slope(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="bank",
        number=INCLINE,
        cell=CELL,
        meaning="a plane rising along +y, to walk across",
        make=lambda number, seed, length, width, cell: bank(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="stairs",
        number=RISE,
        cell=FINE_CELL,
        meaning="up to ten steps of this height and 0.30 m depth up to a landing, and down again",
        make=lambda number, seed, length, width, cell: stairs(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="step",
        number=STEP_HEIGHT,
        cell=FINE_CELL,
        meaning="one step up, across the middle",
        make=lambda number, seed, length, width, cell: step(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="pebbles",
        number=PEBBLE_HEIGHT,
        cell=FINE_CELL,
        meaning="round bumps 0.1 to 0.2 m wide, 4 a square metre, the highest this high",
        make=lambda number, seed, length, width, cell: pebbles(
            number, seed=seed, length=length, width=width, cell=cell
        ),
    ),
)
"""Every word that `from_spec` reads; a new kind of ground is one entry more."""


@dataclass(frozen=True, kw_only=True)
class _Piece:
    """One piece of a spec, read but not made."""

    text: str
    kind: Kind
    number: float
    length: float | None

    def make(self, seed: _Seed, *, length: float, width: float, cell: float) -> Terrain:
        try:
            return self.kind.make(self.number, seed, length, width, cell)
        except GaitshiftError as error:
            raise _faulty(self.text, str(error)) from error


def from_spec(
    spec: str, *, seed: int, length: float, width: float, cell: float | None = None
) -> Terrain:
    """Terrain that a spec describes: one piece, or a track of pieces separated by commas.

    A piece is `NAME`, `NAME:NUMBER`, or either with its length `@METRES` behind it; the names and
    their numbers are in `KINDS`. One piece alone is `length` [m] long unless it says otherwise; the
    pieces of a track all say their lengths, which are rounded to whole cells, and `length` does not
    count. `cell` [m] is the largest distance between samples, if None the finest that a piece asks
    for. Fields begin at x = 0 with y = 0 in the middle.

    The same spec, seed and sizes give the same bits. In a track each piece draws from its own
    stream of the seed, so that changing one piece leaves the noise of the others.

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
    column = max(len(kind.usage) for kind in KINDS)
    lines = [f"{kind.usage:<{column}}  {kind.meaning}" for kind in KINDS]
    return "\n".join([*lines, f"pieces in a row, with their lengths in metres: {_TRACK}"])


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
    """Length of a track's piece, rounded to whole cells [m]."""
    if piece.length is None:
        raise _faulty(piece.text, f"every piece of a track must have a length, as in {_TRACK}")
    return max(1, round(piece.length / cell)) * cell


def _faulty(text: str, problem: str) -> GaitshiftError:
    """Error about one piece, in one line."""
    usages = ", ".join(kind.usage for kind in KINDS)
    return GaitshiftError(f"terrain {text!r}: {problem}; known pieces: {usages}")
