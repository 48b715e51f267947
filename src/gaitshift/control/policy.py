"""A policy file: one ONNX network with all data needed to run it, checked when loaded."""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from jaxtyping import Float32

from gaitshift.control.observation import Observation
from gaitshift.control.policy_info import PolicyInfo, read_info
from gaitshift.control.walker import Walker
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine
from gaitshift.robot.command import CONTROL_PERIOD, Command
from gaitshift.robot.description import ANYMAL_B, Robot

if TYPE_CHECKING:
    import onnxruntime

MOST_BYTES = 64 << 20
"""Size of the largest policy file that is read [bytes]; ours: a hundred times that of a shipped
one."""

_SHIPPED = Path(__file__).parent / "policies"


@dataclass(frozen=True)
class Policy:
    """A trained policy: observation in, action out, by onnxruntime without torch."""

    path: Path
    info: PolicyInfo
    machine: RewardMachine
    session: "onnxruntime.InferenceSession"
    robot: Robot
    """The robot that it drives."""

    @property
    def gait(self) -> str:
        """Name of the gait."""
        return self.machine.name

    @cached_property
    def observation(self) -> Observation:
        """Its observation."""
        return Observation(self.machine, tuple(self.info.stance), tuple(self.info.observation))

    @cached_property
    def walker(self) -> Walker:
        """The walker of its gait."""
        return Walker(
            machine=self.machine,
            observation=self.observation,
            action_scale=self.info.action_scale,
        )

    def within(self, command: Command) -> Command:
        """The command, less what the policy was not trained for.

        Lateral speeds and body heights are clipped to their ranges: of a gait that never saw any,
        the command stays at 0. A gait that stands gets no speed and no turn.
        """
        side, (low, high) = self.info.lateral_speed, self.info.height_range
        aside, height = command.lateral_speed, command.body_height
        asked = command
        if (np.abs(aside) > side).any() or (height < low).any() or (height > high).any():
            asked = replace(
                command,
                lateral_speed=np.clip(aside, -side, side),
                body_height=np.clip(height, low, high),
            )
        if not self.machine.stands:
            return asked
        still = np.zeros(len(command.forward_speed))
        return replace(asked, forward_speed=still, yaw_rate=still)

    def __call__(self, observation: Float32[np.ndarray, "N D"]) -> Float32[np.ndarray, "N 12"]:
        """The deterministic actions for N observations."""
        return self._run("action", observation)

    @cached_property
    def has_critic(self) -> bool:
        """Whether the file has the critic that the policy was trained with."""
        return "value" in {output.name for output in cast(Any, self.session).get_outputs()}

    def value(self, observation: Float32[np.ndarray, "N D"]) -> Float32[np.ndarray, " N"]:
        """Values of the critic for N observations: scaled discounted future rewards.

        Raises:
            GaitshiftError: the file has no critic.
        """
        if not self.has_critic:
            raise GaitshiftError(f"{self.path} has no critic; export it again from its run")
        return self._run("value", observation)[:, 0]

    def _run(self, output: str, observation: np.ndarray) -> np.ndarray:
        session: Any = self.session
        return session.run([output], {"observation": observation}, self._only_what_is_asked)[0]

    @cached_property
    def _only_what_is_asked(self) -> Any:
        """Options of a run that skips the critic where its value is not asked for."""
        import onnxruntime

        options = cast(Any, onnxruntime).RunOptions()
        options.only_execute_path_to_fetches = True
        return options


def shipped(folder: str = ".") -> tuple[str, ...]:
    """Names of the gaits whose policies come with the package.

    The folder "deployable" has policies for a robot with real sensors; `load` takes one as
    "deployable/trot".
    """
    return tuple(sorted(path.stem for path in (_SHIPPED / folder).glob("*.onnx")))


def record_file(gait: str) -> Path:
    """The record of the training of a shipped policy: preset, seed, figures."""
    return _SHIPPED / f"{gait}.json"


def load(name_or_path: str | Path, robot: Robot = ANYMAL_B) -> Policy:
    """A shipped policy by the name of its gait, or any policy file, for this robot.

    Raises:
        GaitshiftError: no such policy; not a complete ONNX file; not a gaitshift policy; another
            format version or robot; or its parts contradict each other.
    """
    path = Path(name_or_path)
    if path.suffix != ".onnx":
        path = _SHIPPED / f"{name_or_path}.onnx"
        if not path.is_file():
            sensed = ", ".join(f"deployable/{gait}" for gait in shipped("deployable"))
            raise GaitshiftError(
                f"policy must be one of {', '.join(shipped())}; or, for real sensors, one of "
                f"{sensed}; or a .onnx file, got '{name_or_path}'"
            )
        if robot != ANYMAL_B:
            raise GaitshiftError(
                f"'{robot.name}' has no policy for the gait '{name_or_path}'; give its .onnx file"
            )
    if not path.is_file():
        raise GaitshiftError(f"no policy file {path}")
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise GaitshiftError(
            f"{path}: a policy file must have {MOST_BYTES >> 20} MB or less, got {size >> 20} MB"
        )
    session, metadata = _open(path)
    info = read_info(path, metadata)
    try:
        policy = Policy(path, info, RewardMachine.from_dict(info.machine), session, robot)
        _check(policy)
    except GaitshiftError as error:
        raise GaitshiftError(f"{path}: {error}") from error
    return policy


def _open(path: Path) -> "tuple[onnxruntime.InferenceSession, dict[str, str]]":
    """The network of a file, and its metadata; all its texts are UTF-8."""
    import onnxruntime  # slow to import, and the names of the shipped policies need none of it

    options = cast(Any, onnxruntime).SessionOptions()
    options.intra_op_num_threads = 1  # the networks are small, and the physics uses the cores
    options.log_severity_level = 4
    try:
        session: Any = onnxruntime.InferenceSession(
            path,
            options,
            providers=["CPUExecutionProvider"],
            enable_fallback=0,  # it prints, and tries the same again
        )
        _ = [end.name for end in (*session.get_inputs(), *session.get_outputs())]
        return session, session.get_modelmeta().custom_metadata_map
    except Exception as error:  # onnxruntime has a class for each fault, without a common base
        raise GaitshiftError(
            f"{path} is a truncated or damaged ONNX file; export it again from its run"
        ) from error


def _check(policy: Policy) -> None:
    """`GaitshiftError` for a policy of another robot, or with parts that contradict each other."""
    info = policy.info
    session: Any = policy.session
    inputs, outputs = (
        {one.name: one.shape for one in ends}
        for ends in (session.get_inputs(), session.get_outputs())
    )
    for kind, name, there in (("input", "observation", inputs), ("output", "action", outputs)):
        if name not in there or len(there[name]) != 2:
            raise GaitshiftError(
                f"the network must have an {kind} '{name}' of N rows; export it again from its run"
            )
    if outputs["action"][1] != 12:
        raise GaitshiftError(
            f"the network must give 12 actions, one for each joint, got {outputs['action'][1]}"
        )
    policy.robot.check_is(info.robot, "it")
    if info.control_rate != 1.0 / CONTROL_PERIOD:
        raise GaitshiftError(
            f"control_rate must be {1.0 / CONTROL_PERIOD:g} Hz, got {info.control_rate:g}"
        )
    robot = policy.robot
    gains = robot.gains_of(info.gains)
    if (gains.kp, gains.kd) != (info.kp, info.kd):
        raise GaitshiftError(
            f"gains must be kp {gains.kp}, kd {gains.kd}, the preset '{info.gains}' of "
            f"{robot.name}, got kp {info.kp}, kd {info.kd}"
        )
    if list(robot.stance) != info.stance:
        raise GaitshiftError(f"stance must be that of {robot.name}, got {info.stance}")
    expected = {name: [s.start, s.stop] for name, s in policy.observation.slices.items()}
    wanted = inputs["observation"][1]
    if expected != info.observation or wanted != policy.observation.size:
        raise GaitshiftError(f"the observation slices must match the network's {wanted} inputs")
    _try(policy)


def _try(policy: Policy) -> None:
    """`GaitshiftError` for a network that does not run on several robots, or gives no numbers."""
    outputs = {"action": (2, 12)} | ({"value": (2, 1)} if policy.has_critic else {})
    nothing = np.zeros((2, policy.observation.size), dtype=np.float32)
    for name, shape in outputs.items():
        try:
            given = policy(nothing) if name == "action" else policy.value(nothing)[:, None]
        except Exception as error:  # as in `_open`
            raise GaitshiftError(
                f"the network cannot give '{name}' for two robots; export it again from its run"
            ) from error
        if given.shape != shape or not np.isfinite(given).all():
            raise GaitshiftError(
                f"the network must give finite numbers as '{name}', of the shape {shape} for two "
                f"robots, got the shape {given.shape}; export it again from its run"
            )
