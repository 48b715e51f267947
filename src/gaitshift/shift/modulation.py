"""α modified online: by time, or by speed (paper III-E: it "can be modified online")."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from jaxtyping import Float

from gaitshift.errors import GaitshiftError
from gaitshift.robot.state import Proprioception

QUANTITIES = ("speed", "time")
"""Quantities on which α may depend: the commanded forward speed [m/s], or the time [s]."""


@dataclass(frozen=True, kw_only=True)
class Modulation:
    """A factor on α, linear between given points and constant beyond them."""

    of: Literal["speed", "time"]
    """The quantity on which it depends."""
    points: tuple[tuple[float, float], ...]
    """Pairs of a speed [m/s] or time [s], rising, and the factor there."""

    def __post_init__(self) -> None:
        if self.of not in QUANTITIES:
            raise GaitshiftError(f"α over: 'of' must be {' or '.join(QUANTITIES)}, got {self.of!r}")
        if not self.points or any(b[0] <= a[0] for a, b in pairwise(self.points)):
            raise GaitshiftError(
                f"α over {self.of}: points must be pairs with rising {self.of}s, such as "
                f"[[0.4, 0.8], [1.2, 1.0]], got {list(map(list, self.points))}"
            )
        if not all(np.isfinite(x) and factor > 0 for x, factor in self.points):
            raise GaitshiftError(
                f"α over {self.of}: factors must be above 0 and {self.of}s finite, got "
                f"{list(map(list, self.points))}"
            )

    def factor(self, sensed: Proprioception) -> Float[np.ndarray, " N"]:
        """Present factor on each robot's α."""
        at, factors = zip(*self.points, strict=True)
        if self.of == "time":
            return np.full(len(sensed.contact), float(np.interp(sensed.time, at, factors)))
        return np.interp(sensed.need("forward_speed_command", "α over speed"), at, factors)
