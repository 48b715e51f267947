"""What a run of N robots left behind, step by step: the one format of `--log FILE.npz`."""

import zipfile
import zlib
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log_check import TIMELESS, checked


@dataclass(frozen=True, kw_only=True, eq=False)
class Log:
    """T control steps of N robots. Time comes first, then the robot, then the leg or joint.

    Entry t is the motion after control step t: what the controllers saw before their next action.
    Positions, velocities, torques and heights may be kept in single precision: 4 µm at 50 m.
    """

    time: Float[np.ndarray, " T"]
    """[s] from the start of the run."""
    qpos: Float[np.ndarray, "T N 19"]
    """MuJoCo's positions: base position [m], base quaternion (w, x, y, z), joint angles [rad]."""
    qvel: Float[np.ndarray, "T N 18"]
    """Base velocity, world frame [m/s]; its angular velocity, body frame, and joints [rad/s]."""
    torque: Float[np.ndarray, "T N 12"]
    """Joint torques [N·m]."""
    contact: Bool[np.ndarray, "T N 4"]
    """Whether each foot touches."""
    foot_position_w: Float[np.ndarray, "T N 4 3"]
    """Lowest point of each foot, world frame [m]."""
    clearance: Float[np.ndarray, "T N 4"]
    """Height of that point above the ground under it [m]."""
    foot_height: Float[np.ndarray, "T N 4"]
    """The condition's h_i: height of each foot at its last touch, in the condition's frame [m]."""
    k: Float[np.ndarray, "T N"]
    """The shift condition's counter, before a firing sets it back to 0."""
    threshold: Float[np.ndarray, "T N"]
    """β (or the reverse rule's) that k is held against."""
    gait: Int[np.ndarray, "T N"]
    """Index into `gaits` of the gait that acts next."""
    machine_state: Int[np.ndarray, "T N"]
    """State of that gait's machine."""
    stance_shown: Bool[np.ndarray, "T N"]
    """Whether the contacts are a stance set of that gait's machine."""
    fallen: Bool[np.ndarray, "T N"]
    """Whether the robot has fallen by now; it lies where it fell, and counts no more."""
    command: Float[np.ndarray, "T N 3"]
    """Commanded forward speed [m/s], yaw rate [rad/s] and stride frequency [Hz]."""
    gaits: tuple[str, ...]
    """Names of the gaits."""
    robot: str
    """Name of the robot."""
    terrain: str
    """Spec of the ground."""
    terrain_height: Float[np.ndarray, "rows cols"]
    """Heights of the ground, rows along +y, columns along +x [m]; the first one's where robots
    stood on several."""
    terrain_size: Float[np.ndarray, " 2"]
    """Length along x and width along y of the ground [m]."""
    terrain_origin: Float[np.ndarray, " 2"]
    """World x, y of its first sample [m]."""
    value: Float[np.ndarray, "T N"] | None = None
    """What the policy's critic expected from what robots acted on; None where nobody asked."""

    def part(self, entries: slice) -> "Log":
        """The same robots in some of the entries; arrays are shared."""
        return replace(self, time=self.time[entries], **self._courses((entries,)))

    def robots(self, ids: slice) -> "Log":
        """Some of the robots over the whole time; arrays are shared."""
        return replace(self, **self._courses((slice(None), ids)))

    def _courses(self, where: tuple[slice, ...]) -> dict[str, Any]:
        """All arrays over time and robots, there."""
        names = (f.name for f in fields(self) if not f.name.startswith((*TIMELESS, "time")))
        given = ((name, getattr(self, name)) for name in names)
        return {name: rows[where] for name, rows in given if rows is not None}

    def save(self, path: Path) -> None:
        """Writes a compressed npz file, whole or not at all."""
        part = path.with_suffix(".part.npz")
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        given: dict[str, Any] = {k: np.asarray(v) for k, v in values.items() if v is not None}
        np.savez_compressed(part, **given)
        part.replace(path)

    @classmethod
    def load(cls, path: Path) -> "Log":
        """Reads what `save` wrote.

        Other arrays in the file are passed over.

        Raises:
            GaitshiftError: no such file, not an npz file, or an array is missing or is not what a
                log has: of another shape, not finite, a time that does not rise at one rate.
        """
        names = [f.name for f in fields(cls)]
        try:
            with path.open("rb") as file:
                entries = np.load(file)
                if not isinstance(entries, np.lib.npyio.NpzFile):
                    raise ValueError("it holds a single array")
                values: dict[str, Any] = {name: entries[name] for name in names if name in entries}
        except FileNotFoundError as error:
            raise GaitshiftError(f"no log file {path}") from error
        except (OSError, EOFError, ValueError, zipfile.BadZipFile, zlib.error) as error:
            raise GaitshiftError(f"{path} is not a complete npz file: {error}") from error
        missing = [name for name in names if name not in values and name != "value"]
        if missing:
            raise GaitshiftError(f"{path} is not a gaitshift log: it lacks '{missing[0]}'")
        for name in ("robot", "terrain"):
            values[name] = str(values[name])
        values["gaits"] = tuple(str(name) for name in np.atleast_1d(values["gaits"]))
        declared = {f.name: f.type for f in fields(cls) if f.name in values}
        return cls(**checked(path, values, declared))
