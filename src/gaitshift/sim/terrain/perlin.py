"""Fractal Perlin noise: the uneven ground of the paper."""

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.sim.terrain.height_field import Terrain
from gaitshift.sim.terrain.kind import CELL, Grid, Kind, Quantity, spell

_AMPLITUDE = Quantity(name="amplitude", unit="m", low=0.0, high=1.0)
"""Of the largest |height|. Ours: twice ANYmal's standing height is no ground to walk on."""

_WAVELENGTH = Quantity(name="wavelength", unit="m", low=0.1, high=100.0)
_OCTAVES = Quantity(name="octaves", unit="", low=1.0, high=8.0)
_LACUNARITY = Quantity(name="lacunarity", unit="", low=1.0, high=4.0)
_GAIN = Quantity(name="gain", unit="", low=0.0, high=1.0)


def perlin(
    amplitude: float,
    *,
    seed: int | np.random.Generator,
    length: float,
    width: float,
    wavelength: float = 1.5,
    octaves: int = 3,
    lacunarity: float = 2.0,
    gain: float = 0.25,
    cell: float = CELL,
    origin: tuple[float, float] | None = None,
) -> Terrain:
    """Fractal gradient noise whose largest |height| over the field is exactly `amplitude` [m].

    The sum of `octaves` layers of Perlin noise: layer o has lattice spacing
    `wavelength` / `lacunarity`^o [m] and weight `gain`^o. The lattices start at sample [0, 0] and
    do not depend on `cell`, so that a finer cell samples the same ground. Octaves, lacunarity and
    gain are those of the first author's code for another robot (Quadruped_MPC_vs_RL), as the paper
    gives none. The wavelength, about two body lengths, is ours.

    `GaitshiftError` where a number is out of range or `cell` is longer than half of the shortest
    lattice spacing. Source: Perlin, "Improving Noise", SIGGRAPH 2002, with random unit gradients.
    """
    _AMPLITUDE.check(amplitude)
    _WAVELENGTH.check(wavelength)
    _OCTAVES.check(float(octaves))
    _LACUNARITY.check(lacunarity)
    _GAIN.check(gain)
    grid = Grid(length=length, width=width, cell=cell)
    spacings = wavelength / lacunarity ** np.arange(octaves)
    if cell > spacings[-1] / 2:
        raise GaitshiftError(
            f"cell must be at most {spacings[-1] / 2:g} m, half of the shortest of the noise's "
            f"wavelengths, got {cell:g}"
        )
    generator = np.random.default_rng(seed)
    noise = np.zeros(grid.shape)
    for octave, spacing in enumerate(spacings):
        noise += gain**octave * _gradient_noise(grid.x / spacing, grid.y / spacing, generator)
    # Divide first: the peak becomes 1 and then the amplitude itself, without rounding.
    height = noise / np.abs(noise).max() * amplitude
    return grid.terrain(height, name=spell("perlin", amplitude), origin=origin)


def _gradient_noise(
    u: Float[np.ndarray, " cols"], v: Float[np.ndarray, " rows"], generator: np.random.Generator
) -> Float[np.ndarray, "rows cols"]:
    """One layer of Perlin noise at all (u, v), in lattice spacings ≥ 0: zero on the lattice.

    Each lattice node has a random unit gradient. The height is the blend of the four planes that
    pass through the corners of a point's lattice cell with the corners' gradients.
    """
    j, i = np.floor(u).astype(int), np.floor(v).astype(int)
    angle = generator.uniform(0.0, 2.0 * np.pi, size=(i[-1] + 2, j[-1] + 2))
    slope_u, slope_v = np.cos(angle), np.sin(angle)
    du, dv = u - j, (v - i)[:, None]

    def plane(row: int, col: int) -> Float[np.ndarray, "rows cols"]:
        node = np.ix_(i + row, j + col)
        return slope_u[node] * (du - col) + slope_v[node] * (dv - row)

    across, along = smoothstep(du), smoothstep(dv)
    lower = (1.0 - across) * plane(0, 0) + across * plane(0, 1)
    upper = (1.0 - across) * plane(1, 0) + across * plane(1, 1)
    return (1.0 - along) * lower + along * upper


def smoothstep(t: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """6t⁵ − 15t⁴ + 10t³: 0 up to t = 0, 1 from t = 1 on, two continuous derivatives.

    Source: Perlin, "Improving Noise", SIGGRAPH 2002. Its steepest slope is 1.875, at t = 1/2.
    """
    t = np.clip(t, 0.0, 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)


KINDS = (
    Kind(
        name="perlin",
        number=_AMPLITUDE,
        cell=CELL,
        meaning="fractal noise with this largest |height|; wavelength 1.5 m, 3 octaves",
        make=lambda number, seed, length, width, cell: perlin(
            number, seed=seed, length=length, width=width, cell=cell
        ),
        rough_from=0.05,  # ours: a trot steps over less
    ),
)
