"""Pieces of ground joined into tracks, and terrains written as text.

A piece is written `perlin:0.10`, a track `flat@8,perlin:0.10@12,flat@10`.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.height_field import Section, Terrain
from gaitshift.sim.terrain.kind import CELL_RANGE, LENGTH, Grid, Kind, Quantity, Seed
from gaitshift.sim.terrain.perlin import smoothstep

_BORDER = Quantity(name="border", unit="m", low=0.1, high=100.0)

_LEVEL = 1e-9
"""An edge whose heights differ by no more is level [m]: well above rounding, below any effect."""


def track(
    pieces: Sequence[Terrain], *, border: float = 0.75, origin: tuple[float, float] | None = None
) -> Terrain:
    """Pieces one behind the other along +x, each beginning at the height where the last ended.

    A piece with level edges (flat, slope, stairs, step) is only lifted. A rough edge that meets
    another piece fades to one height within `border` [m], or within half the piece if that is less:
    to the piece's own z = 0 where the edge crosses it, as noise and pebbles do, else to the edge's
    height nearest to it. A faded piece that both starts and ends on its z = 0 is then scaled to
    keep its largest |height|, so that `perlin:0.1` means 0.1 m here as well. Outer edges stay.

    Without `origin` the track begins at x = 0 and has y = 0 in its middle. Each piece becomes a
    section, or several where it is a track itself. The default of `border` is ours: about one body
    length of ANYmal.

    `GaitshiftError` without pieces, or where their widths or cells differ.
    """
    _BORDER.check(border)
    _check_alike(pieces)
    x0, y0 = (0.0, -pieces[0].size[1] / 2) if origin is None else origin
    columns, x = [pieces[0].height[:, :1]], x0
    sections: list[Section] = []
    for n, piece in enumerate(pieces):
        height = _faded(piece, border, start=n > 0, end=n < len(pieces) - 1)
        lift = columns[-1][0, -1] - height[0, 0] if n > 0 else 0.0
        columns.append(height[:, 1:] + lift)
        shift = x - piece.origin[0]
        sections += [replace(s, x0=s.x0 + shift, x1=s.x1 + shift) for s in piece.sections]
        x += piece.size[0]
    return Terrain(
        height=np.concatenate(columns, axis=1),
        size=(x - x0, pieces[0].size[1]),
        origin=(x0, y0),
        name=",".join(f"{s.name}@{s.x1 - s.x0:.9g}" for s in sections),
        sections=tuple(sections),
    )


def sections_of(name: str, x0: float, length: float) -> tuple[Section, ...]:
    """The pieces along x of a ground by its name alone, from `x0` on over `length` [m].

    Raises:
        GaitshiftError: it is not a name as `Terrain.name` has them.
    """
    sections: list[Section] = []
    for text in name.split(","):
        piece, _, metres = text.partition("@")
        try:
            end = x0 + (float(metres) if metres else length)
        except ValueError:
            raise GaitshiftError(
                f"terrain '{text}': length must be a number of metres, got '{metres}'"
            ) from None
        sections.append(Section(name=piece, x0=x0, x1=end))
        x0 = end
    return tuple(sections)


def _check_alike(pieces: Sequence[Terrain]) -> None:
    """`GaitshiftError` unless there are pieces and all have the first one's width and cell."""
    if not pieces:
        raise GaitshiftError("a track must have at least one piece, got none")
    first = pieces[0]
    for piece in pieces:
        same_rows = piece.height.shape[0] == first.height.shape[0]
        if not (same_rows and np.allclose(piece.cell, first.cell, rtol=1e-6, atol=0.0)):
            raise GaitshiftError(
                f"the pieces of a track must have the same width and cell, got "
                f"'{piece.name}' {piece.size[1]:g} m wide with a cell of {piece.cell} and "
                f"'{first.name}' {first.size[1]:g} m wide with a cell of {first.cell}"
            )


def _faded(
    piece: Terrain, border: float, *, start: bool, end: bool
) -> Float[np.ndarray, "rows cols"]:
    """Heights of the piece, its rough edges faded at the start and the end where asked for."""
    height, length = piece.height, piece.size[0]
    edges = height[:, 0], height[:, -1]
    rough = [float(np.ptp(edge)) > _LEVEL for edge in edges]
    levels = [float(np.clip(0.0, edge.min(), edge.max())) for edge in edges]
    fade_start, fade_end = start and rough[0], end and rough[1]
    if not (fade_start or fade_end):
        return height
    inwards = np.linspace(0.0, length, height.shape[1]) / min(border, length / 2)
    faded = height
    if fade_start:
        faded = levels[0] + smoothstep(inwards) * (faded - levels[0])
    if fade_end:
        faded = levels[1] + smoothstep(inwards[::-1]) * (faded - levels[1])
    if levels == [0.0, 0.0] and faded.any():
        faded = faded / np.abs(faded).max() * np.abs(height).max()
    return faded


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
