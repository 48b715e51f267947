"""The one smooth step from 0 to 1 that noise and the borders of tracks share."""

import numpy as np
from jaxtyping import Float


def smoothstep(t: Float[np.ndarray, "*shape"]) -> Float[np.ndarray, "*shape"]:
    """6t⁵ − 15t⁴ + 10t³: 0 up to t = 0, 1 from t = 1 on, two continuous derivatives.

    Source: Perlin, "Improving Noise", SIGGRAPH 2002. Its steepest slope is 1.875, at t = 1/2.
    """
    t = np.clip(t, 0.0, 1.0)
    return t * t * t * (t * (6.0 * t - 15.0) + 10.0)
