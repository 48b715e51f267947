"""Planes and edges: flat ground, a slope, a bank, stairs, one step."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.height_field import Terrain
from gaitshift.sim.terrain.kind import CELL, FINE_CELL, Grid, Kind, Quantity, spell

_INCLINE = Quantity(name="angle", unit="degrees", low=-45.0, high=45.0)
"""Of a slope. Ours: at 45° feet slip unless friction is above 1."""

_RISE = Quantity(name="rise", unit="m", low=0.0, high=1.0)
"""Of one stair."""

_STEP_HEIGHT = Quantity(name="height", unit="m", low=0.0, high=1.0)
"""Of the single step."""

_RUN = Quantity(name="run", unit="m", low=0.05, high=5.0)
_FLIGHT = Quantity(name="flight", unit="steps", low=1.0, high=1000.0)
_LANDING = Quantity(name="landing", unit="m", low=0.05, high=100.0)


def flat(
    length: float, width: float, *, cell: float = CELL, origin: tuple[float, float] | None = None
) -> Terrain:
    """Level ground at z = 0, `length` × `width` [m]."""
    return Grid(length=length, width=width, cell=cell).terrain(
        np.zeros(()), name="flat", origin=origin
    )


def slope(
    degrees: float,
    *,
    length: float,
    width: float,
    towards: float = 0.0,
    cell: float = CELL,
    origin: tuple[float, float] | None = None,
) -> Terrain:
    """Plane that rises by `degrees` in the direction `towards` [degrees from +x to +y].

    It is at z = 0 in the middle of its first column; negative: downhill. `GaitshiftError` beyond
    45°.
    """
    grid = Grid(length=length, width=width, cell=cell)
    ahead, left = np.cos(np.radians(towards)), np.sin(np.radians(towards))
    along = ahead * grid.x + left * (grid.y - width / 2)[:, None]
    height = np.tan(np.radians(_INCLINE.check(degrees))) * along
    return grid.terrain(height, name=spell("slope", degrees), origin=origin)


def bank(
    degrees: float,
    *,
    length: float,
    width: float,
    cell: float = CELL,
    origin: tuple[float, float] | None = None,
) -> Terrain:
    """Slope to walk across: it rises along +y, to the left of a robot that faces +x."""
    plane = slope(degrees, towards=90.0, length=length, width=width, cell=cell, origin=origin)
    return replace(plane, name=spell("bank", degrees), sections=())


def stairs(
    rise: float,
    *,
    length: float,
    width: float,
    run: float = 0.30,
    flight: int = 10,
    landing: float = 1.0,
    cell: float = FINE_CELL,
    origin: tuple[float, float] | None = None,
) -> Terrain:
    """Stairs up to a landing and down again along x, each step `rise` high and `run` deep [m].

    Each end has `landing` metres of level ground at z = 0, then at most `flight` steps up, so many
    that `landing` metres or more remain on top in the middle. So the ground starts and ends at 0
    and is at most `flight` × `rise` high. A face slopes over the cell in which it lies. The default
    run is the tread of a common staircase; flight and landing are ours.

    `GaitshiftError` where a number is out of range or the length is too short for one step.
    """
    _RISE.check(rise)
    _RUN.check(run)
    _FLIGHT.check(float(flight))
    _LANDING.check(landing)
    grid = Grid(length=length, width=width, cell=cell)
    room = length / 2 - 1.5 * landing
    if room < 0.0:
        raise GaitshiftError(
            f"length must be {3 * landing:g} m or more for stairs with landings of {landing:g} m, "
            f"got {length:g}"
        )
    if cell > run / 2:
        raise GaitshiftError(f"cell must be at most {run / 2:g} m, half a tread, got {cell:g}")
    steps = min(flight, _whole(np.asarray(room / run)) + 1)
    from_end = np.minimum(grid.x, length - grid.x)
    height = rise * np.clip(_whole((from_end - landing) / run) + 1, 0, steps)
    return grid.terrain(height, name=spell("stairs", rise), origin=origin)


def step(
    height: float,
    *,
    length: float,
    width: float,
    cell: float = FINE_CELL,
    origin: tuple[float, float] | None = None,
) -> Terrain:
    """Level ground at 0 and, from the middle of the length on, at `height` [m]: one step up.

    The face slopes over the cell in which it lies. `GaitshiftError` where a number is out of range.
    """
    _STEP_HEIGHT.check(height)
    grid = Grid(length=length, width=width, cell=cell)
    profile = np.where(_whole(grid.x / (length / 2)) >= 1, height, 0.0)
    return grid.terrain(profile, name=spell("step", height), origin=origin)


def _whole(ratio: Float[np.ndarray, "*shape"]) -> Int[np.ndarray, "*shape"]:
    """Whole part of a ratio of lengths, tolerant of rounding errors."""
    return np.asarray(np.floor(ratio + 1e-9)).astype(int)


KINDS = (
    Kind(
        name="flat",
        number=None,
        cell=CELL,
        meaning="level ground",
        make=lambda number, seed, length, width, cell: flat(length, width, cell=cell),
    ),
    Kind(
        name="slope",
        number=_INCLINE,
        cell=CELL,
        meaning="a plane rising along +x; negative: downhill",
        make=lambda number, seed, length, width, cell: slope(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="bank",
        number=_INCLINE,
        cell=CELL,
        meaning="a plane rising along +y, to walk across",
        make=lambda number, seed, length, width, cell: bank(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="stairs",
        number=_RISE,
        cell=FINE_CELL,
        meaning="up to ten steps of this height and 0.30 m depth up to a landing, and down again",
        make=lambda number, seed, length, width, cell: stairs(
            number, length=length, width=width, cell=cell
        ),
    ),
    Kind(
        name="step",
        number=_STEP_HEIGHT,
        cell=FINE_CELL,
        meaning="one step up, across the middle",
        make=lambda number, seed, length, width, cell: step(
            number, length=length, width=width, cell=cell
        ),
    ),
)
