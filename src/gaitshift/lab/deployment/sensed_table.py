"""What a controller sensed and sent, as a table that `identify` and the shift tools read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from gaitshift.control.deployment import ControlStep
from gaitshift.lab.identification.log_files import ATTITUDES, CONTACTS, FEET, columns_of
from gaitshift.robot.legs import JOINTS, LEGS
from gaitshift.robot.state import Proprioception
from gaitshift.table import Row, write

_SIGNALS = (
    *("joint_position", "joint_velocity", "joint_torque", "velocity_b", "angular_velocity_b"),
    *("forward_speed_command", "stride_frequency_command"),
)
"""Optional signals of a table that the robot measures, or that it is commanded."""

TARGETS = tuple(f"target_{leg}_{joint}" for leg in LEGS for joint in JOINTS)
"""Columns of the joint targets that were sent [rad]."""

OWN = ("sequence", *TARGETS, "k", "threshold", "gait")
"""Columns that no other tool reads: the number of the sensors, targets, counters, the gait."""


class SensedTable:
    """A row a control step, a kilobyte each in memory until it is written."""

    def __init__(self, gaits: tuple[str, ...]) -> None:
        """`gaits` are the names that the steps' gaits are indices of."""
        self._gaits = gaits
        self._columns: tuple[str, ...] = ()
        self._rows: list[Float[np.ndarray, " C"]] = []

    def add(self, step: ControlStep) -> None:
        """Adds a control step; all steps have the same signals."""
        sensed = step.sensed
        signals = _signals(sensed)
        if not self._rows:
            yaw = ("yaw",) if sensed.has_heading else ()
            named = (column for name in signals for column in columns_of(name))
            self._columns = ("time", *CONTACTS, *FEET, *ATTITUDES[0], *yaw, *named, *OWN)
        parts: list[Any] = [
            [sensed.time],
            sensed.contact[0],
            sensed.foot_position_b[0],
            sensed.gravity_b[0],
            sensed.yaw if sensed.has_heading else [],
            *(getattr(sensed, name)[0] for name in signals),
            [step.sequence],
            step.target,
            step.decision.k,
            step.decision.threshold,
            [step.gait],
        ]
        self._rows.append(np.concatenate([np.ravel(part) for part in parts]).astype(float))

    def write(self, path: Path) -> None:
        """Writes the table, whole or not at all; its header alone where there was no step."""
        write(path, self._named(), self._columns)

    def _named(self) -> Iterator[Row]:
        whole = {*CONTACTS, "sequence"}
        for values in self._rows:
            row: Row = dict(zip(self._columns, values.tolist(), strict=True))
            row |= {name: int(row[name]) for name in whole}
            yield {**row, "gait": self._gaits[int(row["gait"])]}


def _signals(sensed: Proprioception) -> tuple[str, ...]:
    return tuple(name for name in _SIGNALS if getattr(sensed, name) is not None)
