"""What may be asked of a simulator: finite values within physical ranges."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from gaitshift.errors import GaitshiftError

MOST_ANGLE = 20.0
"""Greatest joint angle or joint target [rad]; ours: three turns, more than any joint has."""

MOST_FORCE = 10_000.0
"""Greatest force on a base [N]; ours: ten times the hardest push of `PushConfig`."""

MOST_DISTANCE = 100_000.0
"""Greatest coordinate of a base [m]; ours: positions still resolve 0.1 nm."""

MOST_YAW = 1000.0
"""Greatest yaw of a base [rad]; ours: more turns than a robot makes in a day."""


def check_within(
    what: str,
    unit: str,
    values: np.ndarray,
    most: float,
    ids: Int[np.ndarray, " K"] | None = None,
    names: Sequence[str] = (),
) -> None:
    """`GaitshiftError` unless all values are within ± `most`, one row a robot (`ids`)."""
    if (np.abs(values) <= most).all():
        return
    row, *column = np.argwhere(~(np.abs(values) <= most))[0].tolist()
    robot = row if ids is None else int(ids[row])
    part = f"{names[column[0]]} of " if names else ""
    value = float(values[(row, *column)])
    raise GaitshiftError(
        f"{what} must be {-most:g} to {most:g} {unit}, got {value:g} for {part}robot {robot}"
    )


def check_unit(attitude: Float[np.ndarray, "K 4"], ids: Int[np.ndarray, " K"]) -> None:
    """`GaitshiftError` unless these are unit quaternions, one row a robot (`ids`)."""
    length = np.linalg.norm(attitude, axis=1)
    wrong = np.flatnonzero(~(np.abs(length - 1.0) <= 1e-3))
    if wrong.size:
        raise GaitshiftError(
            f"attitudes must be unit quaternions, got length {length[wrong[0]]:g} for robot "
            f"{ids[wrong[0]]}"
        )
