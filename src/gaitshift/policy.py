"""A policy file: one ONNX network with all that is needed to run it, and checks that it fits."""

import json
from dataclasses import dataclass
from functools import cached_property
from math import inf
from pathlib import Path
from reprlib import repr as shortened
from typing import Any, cast

import numpy as np
import onnxruntime
from jaxtyping import Float, Float32

from gaitshift.command import CONTROL_PERIOD
from gaitshift.errors import GaitshiftError
from gaitshift.observation import Observation
from gaitshift.reward_machine import RewardMachine
from gaitshift.reward_machine.reading import Table
from gaitshift.robot import ROBOTS, Robot

FORMAT_VERSION = 2
"""Raised when a file of an earlier version could be misread."""

_SHIPPED = Path(__file__).parent / "policies"

_ONLY_WHAT_IS_ASKED: Any = cast(Any, onnxruntime).RunOptions()
_ONLY_WHAT_IS_ASKED.only_execute_path_to_fetches = True  # the critic rests while the actor acts


@dataclass(frozen=True, kw_only=True)
class PolicyInfo:
    """What stands in a policy file beside the network."""

    robot: str
    """Name of the robot it was trained for."""
    machine: dict[str, Any]
    """The reward machine, whole (`RewardMachine.to_dict`)."""
    observation: dict[str, list[int]]
    """Start and end of each named slice of the observation."""
    action_scale: float
    """Joint target = stance + action_scale · action [rad]."""
    stance: list[float]
    """The robot's default joint angles [rad]."""
    gains: str
    """Preset of the robot's joint gains."""
    kp: float
    """[N·m/rad]"""
    kd: float
    """[N·m·s/rad]"""
    control_rate: float
    """Control steps a second [Hz]."""
    forward_speed: float
    """Nominal forward speed [m/s]."""
    speed_range: list[float]
    """Least and greatest forward speed that it was trained for [m/s]."""
    stride_frequency: float
    """Nominal stride frequency [Hz]."""
    stride_frequency_range: list[float]
    """Least and greatest stride frequency that it was trained for [Hz]."""
    training: dict[str, Any]
    """Command, seed, versions and figures of the training that made it."""
    format_version: int = FORMAT_VERSION

    def to_metadata(self) -> dict[str, str]:
        """As ONNX keeps it: every value a JSON text."""
        return {f"gaitshift.{key}": json.dumps(value) for key, value in vars(self).items()}


@dataclass(frozen=True)
class Policy:
    """A trained policy: observation in, action out, by onnxruntime without torch."""

    path: Path
    info: PolicyInfo
    machine: RewardMachine
    session: onnxruntime.InferenceSession

    @property
    def robot(self) -> Robot:
        """The robot it drives."""
        return ROBOTS[self.info.robot]

    @property
    def gait(self) -> str:
        """Name of the gait."""
        return self.machine.name

    @cached_property
    def observation(self) -> Observation:
        """The observation it wants."""
        return Observation(self.machine, tuple(self.info.observation))

    def __call__(self, observation: Float32[np.ndarray, "N D"]) -> Float32[np.ndarray, "N 12"]:
        """The deterministic actions for N observations."""
        return self._run("action", observation)

    @cached_property
    def has_critic(self) -> bool:
        """Whether the file has the critic that the policy was trained with."""
        return "value" in {output.name for output in cast(Any, self.session).get_outputs()}

    def value(self, observation: Float32[np.ndarray, "N D"]) -> Float32[np.ndarray, " N"]:
        """What the critic expects from N observations on: scaled rewards to come, discounted.

        Raises:
            GaitshiftError: the file has no critic.
        """
        if not self.has_critic:
            raise GaitshiftError(f"{self.path} has no critic; export it anew from its run")
        return self._run("value", observation)[:, 0]

    def _run(self, output: str, observation: np.ndarray) -> np.ndarray:
        options = _ONLY_WHAT_IS_ASKED
        return cast(Any, self.session).run([output], {"observation": observation}, options)[0]

    def target(self, action: Float[np.ndarray, "N 12"]) -> Float[np.ndarray, "N 12"]:
        """Joint targets [rad] of an action."""
        return np.asarray(self.info.stance) + self.info.action_scale * action


def shipped() -> tuple[str, ...]:
    """Names of the gaits whose policies come with the package."""
    return tuple(sorted(path.stem for path in _SHIPPED.glob("*.onnx")))


def load(name_or_path: str | Path) -> Policy:
    """A shipped policy by the name of its gait, or any policy file.

    Raises:
        GaitshiftError: no such policy; not a whole ONNX file; not one of gaitshift's; of another
            format version or robot; or its parts contradict each other.
    """
    path = Path(name_or_path)
    if path.suffix != ".onnx":
        path = _SHIPPED / f"{name_or_path}.onnx"
        if not path.is_file():
            raise GaitshiftError(
                f"no policy '{name_or_path}'; shipped: {', '.join(shipped())}; or give a .onnx file"
            )
    if not path.is_file():
        raise GaitshiftError(f"no policy file {path}")
    session = _open(path)
    info = _read_info(path, cast(Any, session).get_modelmeta().custom_metadata_map)
    try:
        policy = Policy(path, info, RewardMachine.from_dict(info.machine), session)
        _check(policy)
    except GaitshiftError as error:
        raise GaitshiftError(f"{path}: {error}") from error
    return policy


def _open(path: Path) -> onnxruntime.InferenceSession:
    options = cast(Any, onnxruntime).SessionOptions()
    options.intra_op_num_threads = 1  # the networks are small, the cores belong to the physics
    options.log_severity_level = 4
    try:
        return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # onnxruntime has a class for each fault, without a common base
        raise GaitshiftError(
            f"{path} is not a whole ONNX file (truncated or damaged); export it anew"
        ) from error


def _read_info(path: Path, metadata: dict[str, str]) -> PolicyInfo:
    version = metadata.get("gaitshift.format_version")
    if version is None:
        raise GaitshiftError(f"{path} is an ONNX file, but not a policy of gaitshift")
    if version != str(FORMAT_VERSION):
        raise GaitshiftError(
            f"{path} has format version {version}; this gaitshift reads {FORMAT_VERSION}: "
            "export it with this version"
        )
    fields = PolicyInfo.__dataclass_fields__
    missing = [name for name in fields if f"gaitshift.{name}" not in metadata]
    if missing:
        raise GaitshiftError(f"{path} lacks the metadata '{missing[0]}'; export it anew")
    try:
        values = {name: json.loads(metadata[f"gaitshift.{name}"]) for name in fields}
    except json.JSONDecodeError as error:
        raise GaitshiftError(f"{path} has damaged metadata; export it anew") from error
    try:
        return _info_of(values)
    except GaitshiftError as error:
        raise GaitshiftError(f"{path}: metadata {error}; export it anew") from error


def _info_of(values: dict[str, object]) -> PolicyInfo:
    """The description in plain data, each value of its type and size.

    Raises:
        GaitshiftError: one that is not, by its key.
    """
    read = Table(values, keys=tuple(PolicyInfo.__dataclass_fields__))
    info = PolicyInfo(
        robot=read.text("robot"),
        machine=_table(values, "machine"),
        observation={
            name: _ends(name, ends) for name, ends in _table(values, "observation").items()
        },
        action_scale=_above_0(read, "action_scale"),
        stance=_angles(read, "stance"),
        gains=read.text("gains"),
        kp=read.number("kp"),
        kd=read.number("kd"),
        control_rate=_above_0(read, "control_rate"),
        forward_speed=_above_0(read, "forward_speed"),
        speed_range=_range(read, "speed_range"),
        stride_frequency=_above_0(read, "stride_frequency"),
        stride_frequency_range=_range(read, "stride_frequency_range"),
        training=_table(values, "training"),
        format_version=read.whole("format_version"),
    )
    if info.stride_frequency_range[0] == 0:
        raise GaitshiftError("'stride_frequency_range' must begin above 0")
    return info


def _table(values: dict[str, object], key: str) -> dict[str, Any]:
    value = values[key]
    if not isinstance(value, dict):
        raise GaitshiftError(f"{key!r} must be a table of keys and values, not {shortened(value)}")
    return cast("dict[str, Any]", value)


def _ends(name: str, ends: object) -> list[int]:
    whole: list[int] = []
    if isinstance(ends, list):
        whole = [end for end in cast("list[object]", ends) if type(end) is int]
    if len(whole) != 2 or ends != whole:
        told = shortened(cast(object, ends))
        raise GaitshiftError(f"'observation' must give {name!r} a start and an end, not {told}")
    return whole


def _above_0(read: Table, key: str) -> float:
    value = read.number(key)
    if not 0 < value < inf:
        raise GaitshiftError(f"{key!r} must be a finite number above 0, not {value:g}")
    return value


def _angles(read: Table, key: str) -> list[float]:
    value = read.get(key)
    count = len(cast("list[object]", value)) if isinstance(value, list) else 12
    return list(read.numbers(key, count, "the angles of 12 joints"))


def _range(read: Table, key: str) -> list[float]:
    low, high = read.numbers(key, 2, "two numbers, such as [0.4, 1.6]")
    if not 0 <= low <= high < inf:
        raise GaitshiftError(
            f"{key!r} must be two finite numbers, 0 or above and rising, not {low:g} to {high:g}"
        )
    return [low, high]


def _check(policy: Policy) -> None:
    """Refuses a policy whose robot is unknown or whose parts contradict each other."""
    info = policy.info
    session: Any = policy.session
    inputs, outputs = (
        {one.name: one.shape for one in ends}
        for ends in (session.get_inputs(), session.get_outputs())
    )
    for kind, name, there in (("input", "observation", inputs), ("output", "action", outputs)):
        if name not in there or len(there[name]) != 2:
            raise GaitshiftError(
                f"its network has no {kind} '{name}' of N rows; export it anew from its run"
            )
    if outputs["action"][1] != 12:
        raise GaitshiftError(
            f"its network gives {outputs['action'][1]} actions; 12, one a joint, would be right"
        )
    if info.robot not in ROBOTS:
        raise GaitshiftError(
            f"it is for the robot '{info.robot}'; known: {', '.join(ROBOTS)}; any other one needs "
            "its file (--robot-file)"
        )
    if info.control_rate != 1.0 / CONTROL_PERIOD:
        raise GaitshiftError(
            f"it acts {info.control_rate:g} times a second; {1.0 / CONTROL_PERIOD:g} would be right"
        )
    robot = policy.robot
    gains = robot.gains_of(info.gains)
    if (gains.kp, gains.kd) != (info.kp, info.kd):
        raise GaitshiftError(
            f"it was trained with kp {info.kp}, kd {info.kd}, but the preset '{info.gains}' "
            f"of {robot.name} is kp {gains.kp}, kd {gains.kd}"
        )
    if list(robot.stance) != info.stance:
        raise GaitshiftError(f"it was trained from another stance of {robot.name}")
    expected = {name: [s.start, s.stop] for name, s in policy.observation.slices.items()}
    wanted = inputs["observation"][1]
    if expected != info.observation or wanted != policy.observation.size:
        raise GaitshiftError(
            f"its observation slices do not add up to its network's {wanted} inputs"
        )
