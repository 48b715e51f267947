"""A terrain as MuJoCo stores it: samples in [0, 1] with a scale and a position."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32

from gaitshift.sim.terrain.height_field import Terrain

_FLAT_ELEVATION = 0.01
"""Scale of a field whose samples are all 0 [m]: it moves nothing, but MuJoCo wants it positive."""


@dataclass(frozen=True, kw_only=True, eq=False)
class UnitField:
    """The numbers that MuJoCo's `<hfield>` and the geom that shows it are made of."""

    data: Float32[np.ndarray, "rows cols"]
    """Samples from 0 (lowest) to 1 (highest), as `hfield_data` holds them; all 0 when flat.

    They span [0, 1] whole, so that the compiler's own normalisation leaves them as they are.
    """
    size: tuple[float, float, float, float]
    """The asset's `size`: half length, half width, height of a sample of 1, base thickness [m]."""
    position: tuple[float, float, float]
    """The geom's `pos`, world frame: the middle of the field, at the lowest sample's height [m]."""


def to_unit_interval(terrain: Terrain, *, base: float = 0.5) -> UnitField:
    """Terrain as MuJoCo's height field; `base` [m] is the solid ground below its lowest sample.

    float32 rounds samples to within 3e-8 of the relief (highest minus lowest sample), so that
    MuJoCo's surface and `Terrain.height_at` agree to 1e-6 m on any relief up to 30 m.

    The base's default is ours: thick against the few millimetres a foot sinks in, so that a contact
    never resolves downwards.
    """
    lowest = float(terrain.height.min())
    relief = float(terrain.height.max()) - lowest
    elevation = relief if relief > 0.0 else _FLAT_ELEVATION
    (x0, y0), (length, width) = terrain.origin, terrain.size
    return UnitField(
        data=((terrain.height - lowest) / elevation).astype(np.float32),
        size=(length / 2, width / 2, elevation, base),
        position=(x0 + length / 2, y0 + width / 2, lowest),
    )
