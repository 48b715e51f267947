"""The order of the legs, their pairs and contact patterns, and the kinematics of ANYmal B's legs.

Every array whose axis is the leg follows `LEGS`; every array whose axis is the joint follows
`LEGS` × `JOINTS`. A contact pattern is one integer, its label: bit i is set where leg i touches.
The kinematics are in closed form, with the lengths of ANYmal B's model.
"""

from itertools import combinations

import numpy as np
from jaxtyping import Bool, Float, Int

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


HIP_X, HIP_Y = 0.277, 0.116
"""Position of the abduction axis from the base origin [m]."""

THIGH_X, LEG_Y = 0.0635, 0.13
"""Offset from there to the flexion axis, and lateral offset of the leg's plane [m]."""

THIGH = 0.25
"""From the flexion axis to the knee [m]."""

SHANK_X, SHANK_Z = 0.1, 0.298
"""From the knee to the middle of the foot: ahead (at hind legs behind), and below [m]."""

SHANK = float(np.hypot(SHANK_X, SHANK_Z))
BEND = float(np.arctan2(SHANK_X, SHANK_Z))
"""Length of this offset [m], and its angle from the shank's axis [rad]."""

FORE = np.array([1.0, 1.0, -1.0, -1.0])
SIDE = np.array([1.0, -1.0, 1.0, -1.0])
"""Front or hind, left or right, in the order of `LEGS`."""


def joint_angles(foot: Float[np.ndarray, "N 4 3"]) -> Float[np.ndarray, "N 12"]:
    """Joint angles [rad] that bring the middle of each foot to a point in the body frame [m].

    Knees point towards each other, as in the stance. Points out of reach are replaced by the
    nearest point in reach.
    """
    x = foot[..., 0] - FORE * (HIP_X + THIGH_X)
    y = foot[..., 1] - SIDE * HIP_Y
    z = foot[..., 2]
    depth = np.sqrt(np.maximum(y * y + z * z - LEG_Y * LEG_Y, 1e-6))
    abduction = np.arctan2(y, -z) - np.arctan2(SIDE * LEG_Y, depth)
    length = np.clip(np.hypot(x, depth), abs(SHANK - THIGH) + 1e-3, THIGH + SHANK - 1e-3)
    cosine = (length * length - THIGH * THIGH - SHANK * SHANK) / (2.0 * THIGH * SHANK)
    knee = -FORE * np.arccos(np.clip(cosine, -1.0, 1.0))
    flexion = np.arctan2(-x, depth) - np.arctan2(SHANK * np.sin(knee), THIGH + SHANK * np.cos(knee))
    angles = np.stack([abduction, flexion, knee + FORE * BEND], axis=-1)
    return angles.reshape(*foot.shape[:-2], 12)


def lift_torques(
    angles: Float[np.ndarray, "N 12"], force: Float[np.ndarray, "N 4"]
) -> Float[np.ndarray, "N 12"]:
    """Joint torques [N·m] with which legs at these angles bear a force along body z [N] each.

    By virtual work: τ = −f ∂z/∂q.
    """
    abduction, flexion, knee = np.moveaxis(angles.reshape(*angles.shape[:-1], 4, 3), -1, 0)
    bent = flexion + knee - FORE * BEND
    depth = THIGH * np.cos(flexion) + SHANK * np.cos(bent)
    shank = np.cos(abduction) * SHANK * np.sin(bent)
    rise = np.stack(
        [
            SIDE * LEG_Y * np.cos(abduction) + depth * np.sin(abduction),
            np.cos(abduction) * THIGH * np.sin(flexion) + shank,
            shank,
        ],
        axis=-1,
    )
    return (-force[..., None] * rise).reshape(angles.shape)
