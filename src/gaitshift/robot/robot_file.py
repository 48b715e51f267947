"""A user's robot: its numbers from a TOML file, checked together with its model."""

import warnings
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, cast

import mujoco
import numpy as np

from gaitshift.data import Table, located, tables_in
from gaitshift.errors import GaitshiftError
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import ANYMAL_B, FREE_JOINTS, Gains, Robot
from gaitshift.robot.legs import JOINTS, LEGS
from gaitshift.robot.mjcf_limits import check_mjcf
from gaitshift.robot.motor import Motor

_NUMBERS = ("foot_radius", "action_scale")
_KEYS = ("name", "model", "stance", *_NUMBERS, "motor", "gains")
_MOTOR = tuple(field.name for field in fields(Motor))

_LEVEL = 0.05
"""Largest difference of foot heights in a stance [m]; ours."""

SENSORS = (
    *(f"{leg}_position" for leg in LEGS),
    *(f"{leg}_velocity" for leg in LEGS),
    *(f"{leg}_touch" for leg in LEGS),
    "body_touch",
)
"""Sensors of a robot's model, in order: framepos, framelinvel and touch of the feet's sites, and
touch of a site around the body."""


def read_robot(path: Path) -> Robot:
    """The robot in a TOML file, with its model checked.

    Raises:
        GaitshiftError: one line that begins with the file's path.
    """
    with located(str(path)):
        table = Table(tables_in(path), keys=_KEYS)
        name = table.text("name")
        if name == ANYMAL_B.name:
            raise GaitshiftError(f"'name' must not be that of a robot of the package, got '{name}'")
        numbers = {key: table.number(key) for key in _NUMBERS}
        stance = table.numbers("stance", 12, "12 angles: FL, FR, BL, BR × (HAA, HFE, KFE)")
        gains = {preset: _gains(preset, of) for preset, of in table.table("gains").items()}
        model_file = path.parent / table.text("model")
        robot = Robot(
            name=name,
            model_file=model_file.resolve(),
            stance=stance,
            stance_height=np.inf,  # measured from the model below, like the mass
            mass=np.inf,
            motor=_motor(table.get("motor")),
            gains=gains,
            joint_range=FREE_JOINTS,  # those of the model below, too
            **numbers,
        )
        with located(str(model_file)):
            return _measured(robot, _checked_model(robot))


def to_dict(robot: Robot) -> dict[str, Any]:
    """The robot as plain data, for the files of a run."""
    return {**asdict(robot), "model_file": str(robot.model_file)}


def from_dict(data: Any) -> Robot:
    """The inverse of `to_dict`.

    Raises:
        GaitshiftError: something is missing or of another type, or the file of the robot's model no
            longer exists.
    """
    try:
        gains = {name: Gains(**values) for name, values in data["gains"].items()}
        path, motor = Path(data["model_file"]), Motor(**data["motor"])
        values = {**data, "gains": gains, "motor": motor, "model_file": path}
        values["stance"] = tuple(data["stance"])
        values["joint_range"] = tuple((low, high) for low, high in data["joint_range"])
        robot = Robot(**cast(dict[str, Any], values))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise GaitshiftError(f"robot is damaged: {error}") from error
    if not path.is_file():
        raise GaitshiftError(f"robot '{robot.name}': no model file {path}")
    return robot


def _gains(preset: str, data: object) -> Gains:
    with located(f"gains.{preset}"):
        table = Table(data, keys=("kp", "kd"))
        return Gains(kp=table.number("kp"), kd=table.number("kd"))


def _motor(data: object) -> Motor:
    with located("motor"):
        table = Table(data, keys=_MOTOR)
        limit = table.number("torque_limit")
        return Motor(
            torque_limit=limit,
            no_load_speed=table.number("no_load_speed"),
            stall_torque=table.number("stall_torque", default=limit),
            friction=table.number("friction", default=0.0),
            armature=table.number("armature", default=0.0),
            thermal_resistance=table.number("thermal_resistance", default=0.0),
        )


def _checked_model(robot: Robot) -> mujoco.MjModel:
    """The compiled model of the robot; `GaitshiftError` where `World` cannot use it."""
    if not robot.model_file.is_file():
        raise GaitshiftError("no such file")
    check_mjcf(robot.model_file)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", UserWarning)
            model = cast(mujoco.MjModel, robot.spec(robot.gains_of("default")).compile())
    except UserWarning as warning:
        raise GaitshiftError(
            f"MuJoCo warns of the model: {' '.join(str(warning).split())}"
        ) from None
    except (ValueError, mujoco.FatalError, mujoco.UnexpectedError) as error:
        raise GaitshiftError(
            f"MuJoCo cannot read the model: {' '.join(str(error).split())}"
        ) from None
    joints = [model.joint(i).name for i in range(model.njnt)]
    free = model.njnt > 0 and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    if not free:
        raise GaitshiftError(
            f"the first joint must be the free joint of the base, got {joints[:1]}"
        )
    _compare("joints after the free one", joints[1:], robot.joint_names)
    driven = [model.joint(int(joint)).name for joint in model.actuator_trnid[:, 0]]
    _compare("actuators, by the joints they turn,", driven, robot.joint_names)
    _compare("sensors", [model.sensor(i).name for i in range(model.nsensor)], SENSORS)
    touching = model.geom_conaffinity[:] & 1
    for leg in LEGS:
        body = model.site(f"{leg}_foot").bodyid[0] if _has_site(model, f"{leg}_foot") else None
        if body is None or not touching[model.geom_bodyid == body].any():
            raise GaitshiftError(
                f"there must be a site {leg}_foot on a body with a geom of conaffinity 1"
            )
    if not (model.geom_group[model.geom_bodyid == model.jnt_bodyid[0]] <= 2).any():
        raise GaitshiftError("the base must have a geom in group 0, 1 or 2 to be drawn, got none")
    substeps = CONTROL_PERIOD / model.opt.timestep
    if abs(substeps - round(substeps)) > 1e-6 or round(substeps) < 1:
        raise GaitshiftError(
            f"timestep must divide {CONTROL_PERIOD:g} s, as 0.0025 s does, got "
            f"{model.opt.timestep:g} s"
        )
    return model


def _compare(what: str, found: list[str], wanted: tuple[str, ...]) -> None:
    if tuple(found) == wanted:
        return
    at = next(
        (i for i, pair in enumerate(zip(found, wanted, strict=False)) if pair[0] != pair[1]),
        min(len(found), len(wanted)),
    )
    here = found[at] if at < len(found) else "nothing"
    right = wanted[at] if at < len(wanted) else "nothing"
    raise GaitshiftError(
        f"{what} must be {', '.join(wanted[:4])} … {wanted[-1]}; number {at + 1} must be {right}, "
        f"got {here}"
    )


def _has_site(model: mujoco.MjModel, name: str) -> bool:
    return mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name) >= 0


def _measured(robot: Robot, model: mujoco.MjModel) -> Robot:
    """The robot with its mass, joint ranges, and height in the stance on its lowest foot."""
    data = mujoco.MjData(model)
    data.qpos[:] = [0, 0, 0, 1, 0, 0, 0, *robot.stance]
    mujoco.mj_kinematics(model, data)
    feet = [float(data.site(f"{leg}_foot").xpos[2]) for leg in LEGS]
    if (apart := max(feet) - min(feet)) > _LEVEL:
        raise GaitshiftError(
            f"stance must put the feet at one height, got heights {100 * apart:.0f} cm apart; "
            f"angles are in the order {', '.join(LEGS)} × {', '.join(JOINTS)}"
        )
    ranges = tuple(
        (max(low, free[0]), min(high, free[1])) if has_stops else free
        for (low, high), has_stops, free in zip(
            model.jnt_range[1:].tolist(), model.jnt_limited[1:], FREE_JOINTS, strict=True
        )
    )
    return replace(
        robot,
        mass=float(model.body_mass.sum()),
        stance_height=robot.foot_radius - min(feet),
        joint_range=ranges,
    )
