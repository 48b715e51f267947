"""What a critic may see beside the observation: what only a simulation knows.

A critic is for training alone, so it may see the true state and the body that was drawn (Pinto et
al. 2018, "Asymmetric Actor Critic for Image-Based Robot Learning").
"""

import numpy as np
from jaxtyping import Float, Float32

from gaitshift.robot.legs import MIRRORED_LEGS
from gaitshift.robot.state import Privileged, Proprioception
from gaitshift.sim.world.randomisation import SAME

_BODY = tuple(SAME.ranges())
_SIZES = {"velocity_b": 3, "base_height": 1, "contact": 4, "clearance": 4, "body": len(_BODY)}

PRIVILEGED_SIZE = sum(_SIZES.values())
"""Length of the vector: the true velocity of the base in its own frame [m/s], its height over the
lowest foot [m], the four true contacts, the clearances of the feet [m], and what was drawn for the
robot in the order of `Randomisation`."""


def privileged(
    ideal: Proprioception, truth: Privileged, body: Float[np.ndarray, "N 8"]
) -> Float32[np.ndarray, "N P"]:
    """The vector of N robots, from signals without errors, the true state and what was drawn."""
    columns = (
        truth.velocity_b,
        ideal.base_height[:, None],
        truth.foot_contact,
        truth.clearance,
        body,
    )
    return np.concatenate(columns, axis=1, dtype=np.float32)


def privileged_mirror() -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Order and signs such that `signs * vector[:, order]` is the mirror image."""
    feet = tuple(4 + leg for leg in MIRRORED_LEGS)
    clearances = tuple(4 + foot for foot in feet)
    order = (0, 1, 2, 3, *feet, *clearances, *range(12, PRIVILEGED_SIZE))
    body = tuple(-1 if name == "payload_y" else 1 for name in _BODY)
    return order, (1, -1, 1, 1, *(1,) * 8, *body)
