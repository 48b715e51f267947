"""The order of the legs, their pairs and their contact patterns.

Every array whose axis is the leg follows `LEGS`; every array whose axis is the joint follows
`LEGS` × `JOINTS`. A contact pattern is one integer, its label: bit i is set where leg i touches.
"""

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Int

LEGS = ("FL", "FR", "BL", "BR")
"""Front left, front right, back left, back right (LF, RF, LH, RH in ANYbotics' names)."""

JOINTS = ("HAA", "HFE", "KFE")
"""Hip abduction-adduction, hip flexion-extension, knee flexion-extension."""

LEG_PAIRS = tuple(combinations(range(4), 2))
"""The six unordered pairs of leg indices, over which the foot-height condition runs."""

MIRRORED_LEGS = (1, 0, 3, 2)
"""The mirror image of leg i is leg `MIRRORED_LEGS[i]`: left and right are exchanged."""

LABEL_COUNT = 16
"""Number of contact patterns, 2^P for the paper's P = {FL, FR, BL, BR}."""

_BITS = np.array([1, 2, 4, 8])


def label_of(contact: Bool[np.ndarray, "*batch 4"]) -> Int[np.ndarray, "*batch"]:
    """Contact booleans as one integer label in [0, 16): bit i is leg i of `LEGS`."""
    return contact @ _BITS


def contact_of(label: Int[np.ndarray, "*batch"]) -> Bool[np.ndarray, "*batch 4"]:
    """Contact booleans of a label: the inverse of `label_of`."""
    return (np.asarray(label)[..., None] & _BITS) != 0
