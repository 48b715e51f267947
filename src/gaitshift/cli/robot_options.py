"""Shared options of commands: the robot and its policies."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from gaitshift.control import Controller, policy
from gaitshift.control.controller import ControllerMaker, controller_maker
from gaitshift.control.policy import Policy
from gaitshift.errors import GaitshiftError
from gaitshift.robot.description import ANYMAL_B, Robot
from gaitshift.robot.robot_file import read_robot
from gaitshift.sim.sensor_config import PERFECT, PRESETS, SensorConfig, sensor_preset

_preset_option = tyro.constructors.PrimitiveConstructorSpec[SensorConfig](
    nargs=1,
    metavar=f"{{{','.join(preset.name for preset in PRESETS)}}}",
    instance_from_str=lambda args: sensor_preset(args[0]),
    is_instance=lambda instance: isinstance(instance, SensorConfig),
    str_from_instance=lambda instance: [instance.name],
)


@dataclass(frozen=True, kw_only=True)
class SensorOption:
    """For a command that runs a simulated robot."""

    sensors: Annotated[SensorConfig, _preset_option] = PERFECT
    """Sensors of the robot and its link to the joints: perfect; like those of ANYmal; or cheap.
    With the last two, the velocity of the base is estimated."""


@dataclass(frozen=True, kw_only=True)
class RobotOption:
    """For a command that runs or shows a robot."""

    robot_file: Path | None = None
    """Another robot than ANYmal B: a TOML file beside its MJCF."""

    def read_robot(self) -> Robot:
        """The robot of the file; without one, ANYmal B."""
        return ANYMAL_B if self.robot_file is None else read_robot(self.robot_file)


@dataclass(frozen=True, kw_only=True)
class RobotOptions(RobotOption):
    """For a command that runs policies by the names of their gaits."""

    policy_files: tuple[Path, ...] = ()
    """Policy files ending in .onnx that take the place of the shipped policies of their gaits, or
    shipped ones for real sensors by name, such as deployable/trot."""

    def known_gaits(self) -> tuple[str, ...]:
        """Gaits with a policy: those of the files and, for ANYmal B, the shipped ones."""
        shipped = policy.shipped() if self.robot_file is None else ()
        return tuple(dict.fromkeys((*shipped, *self._from_files(self.read_robot()))))

    def load_policies(self, gaits: Sequence[str]) -> dict[str, Policy]:
        """The policies of these gaits.

        Raises:
            GaitshiftError: a gait has no policy, or a file is of another robot.
        """
        robot = self.read_robot()
        given = self._from_files(robot)
        return {gait: given.get(gait) or policy.load(gait, robot) for gait in gaits}

    def maker(self, name: str) -> ControllerMaker:
        """The maker of this name, for controllers of this robot with the policy files.

        Raises:
            GaitshiftError: the maker is unknown, or a file is of another robot.
        """
        make, own = controller_maker(name), self.read_robot()
        files = {gait: str(given.path) for gait, given in self._from_files(own).items()}

        def with_options(gaits: Sequence[str], n: int, *, robot: Robot | None = None) -> Controller:
            return make([files.get(gait, gait) for gait in gaits], n, robot=robot or own)

        return with_options

    def _from_files(self, robot: Robot) -> dict[str, Policy]:
        given: dict[str, Policy] = {}
        for path in self.policy_files:
            loaded = policy.load(path, robot)
            if loaded.gait in given:
                raise GaitshiftError(f"two of --policy-files are of the gait '{loaded.gait}'")
            given[loaded.gait] = loaded
        return given
