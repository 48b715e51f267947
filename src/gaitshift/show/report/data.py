"""The input of a report's player, as JSON: arrays in base64, little-endian."""

import base64
from typing import Any, cast

import numpy as np
from jaxtyping import Float, Shaped

from gaitshift.gait import gaits
from gaitshift.lab.log import Log
from gaitshift.robot.description import Robot
from gaitshift.robot.legs import LEGS
from gaitshift.show.geometry import Shape, frames_of, ground_grid, plane_corners
from gaitshift.show.plots.signals import (
    ground_below,
    ground_of,
    has_condition,
    period,
    shift_times,
)
from gaitshift.show.plots.style import GROUND, LEG_COLOURS, gait_colours
from gaitshift.sim.terrain import Terrain

EVERY = 2
"""Control steps between two poses, 50 poses a second."""

_AROUND = 3.0
"""Width of the drawn ground around the robot's course [m]."""

_TYPES = {"f4": "<f4", "u4": "<u4", "u1": "u1"}


def run_data(log: Log, robot: int, description: Robot) -> dict[str, Any]:
    """One robot of a log, as data.

    `time` [s], `contact` (bit i: foot i of `LEGS` is down) and `gait` have an entry a control step;
    `position` and `rotation` (w, x, y, z) of each of the `bodies`, `feet` and the corners of the
    `plane` through the last touches an entry every `EVERY` steps. `rows` are the charts.
    """
    alone = log.robots(slice(robot, robot + 1))
    frames = frames_of(alone, EVERY)
    shape = Shape(description)
    position, rotation = shape.poses(np.concatenate([frame.step.qpos for frame in frames]))
    place = alone.truth.base_position_w[:, 0, :2].astype(float)
    feet = np.concatenate([frame.step.truth.foot_position_w for frame in frames])
    feet[..., 2] += description.foot_radius
    planes = [_plane(frame.touch_w[0]) for frame in frames]
    bits = (alone.sensed.contact[:, 0] * (1 << np.arange(len(LEGS)))).sum(axis=1)
    return {
        "time": packed(log.time, "f4"),
        "period": period(log),
        "every": EVERY,
        "frames": len(frames),
        "contact": packed(bits, "u1"),
        "gait": packed(alone.gait[:, 0], "u1"),
        "gaits": [
            {"name": name, "title": title_of(name), "colour": colour}
            for name, colour in gait_colours(log.gaits).items()
        ],
        "shifts": shift_times(log, robot),
        "footRadius": description.foot_radius,
        "bodies": [
            {
                "name": body.name,
                "vertices": packed(body.mesh.vertices, "f4"),
                "faces": packed(body.mesh.faces, "u4"),
                "colours": packed(cast(Any, body.mesh).visual.vertex_colors[:, :3], "u1"),
            }
            for body in shape.bodies
        ],
        "position": packed(position.swapaxes(0, 1), "f4"),
        "rotation": packed(rotation.swapaxes(0, 1), "f4"),
        "feet": packed(feet, "f4"),
        "plane": packed(np.array(planes), "f4"),
        "ground": _ground(_around(ground_of(log), place)),
        "rows": _rows(log, robot),
    }


def title_of(gait: str) -> str:
    """Title of a gait."""
    return gaits.load(gait).title if gait in gaits.names() else gait


def _rows(log: Log, robot: int) -> list[dict[str, Any]]:
    """The charts from top to bottom; those of the condition only if there was one."""
    contacts = {"kind": "contacts", "title": "feet on the ground", "names": list(LEGS)}
    rows = [contacts]
    if has_condition(log, robot):
        heights = _since_touched(log, robot).T
        feet = zip(LEGS, heights, LEG_COLOURS, strict=True)
        rows += [
            lines(
                "height of the last touch of each foot [m]",
                [series(leg, height, colour) for leg, height, colour in feet],
                unit="m",
                digits=3,
            ),
            lines(
                "counter k and threshold β [counts]",
                [
                    series("k", log.k[:, robot], "ink"),
                    series("β", log.threshold[:, robot], "#d55e00"),
                ],
                digits=0,
                zero=True,
            ),
        ]
    asked = log.sensed.forward_speed_command
    speeds = [series("speed", log.truth.forward_speed[:, robot], "ink")]
    speeds += [] if asked is None else [series("command", asked[:, robot], "#0072b2")]
    base, below = log.truth.base_position_w[:, robot, 2], ground_below(log, robot)
    levels = [series("ground", below, GROUND, fill=True), series("base", base, "ink")]
    rows += [
        lines("forward speed [m/s]", speeds, unit="m/s", digits=2),
        lines("height of the base and of the ground below [m]", levels, unit="m", digits=2),
    ]
    return rows


def _since_touched(log: Log, robot: int) -> Float[np.ndarray, "T 4"]:
    """Heights of the last touches; NaN for a foot that has not touched yet."""
    return log.touch_height[:, robot]


def lines(
    title: str, series: list[dict[str, Any]], *, unit: str = "", digits: int, zero: bool = False
) -> dict[str, Any]:
    """A chart of some series over time; `zero`: its axis reaches down to 0."""
    return {
        "kind": "lines",
        "title": title,
        "series": series,
        "unit": unit,
        "digits": digits,
        "zero": zero,
        "least": 0.02 if unit == "m" else 0.1,
    }


def series(
    name: str, values: Shaped[np.ndarray, " T"], colour: str, *, fill: bool = False
) -> dict[str, Any]:
    """A line of a chart, with one entry per time."""
    return {"name": name, "values": packed(values, "f4"), "colour": colour, "fill": fill}


def _plane(touch_w: Float[np.ndarray, "4 3"]) -> Float[np.ndarray, "4 3"]:
    """Corners of the plane; NaN until all feet have touched."""
    return plane_corners(touch_w) if np.isfinite(touch_w).all() else np.full((4, 3), np.nan)


def _around(ground: Terrain, course: Float[np.ndarray, "T 2"]) -> Terrain:
    """The part of a ground around a course; level ground extends beyond its border."""
    low, high = course.min(axis=0) - _AROUND, course.max(axis=0) + _AROUND
    if ground.is_flat:
        return Terrain(
            height=np.full((2, 2), float(ground.height[0, 0])),
            size=(float(high[0] - low[0]), float(high[1] - low[1])),
            origin=(float(low[0]), float(low[1])),
            name=ground.name,
        )
    (dx, dy), (x0, y0) = ground.cell, ground.origin
    rows, columns = ground.height.shape
    i = np.clip(np.rint((np.array([low[1], high[1]]) - y0) / dy).astype(int), 0, rows - 1)
    j = np.clip(np.rint((np.array([low[0], high[0]]) - x0) / dx).astype(int), 0, columns - 1)
    if i[1] - i[0] < 1 or j[1] - j[0] < 1:
        return ground
    return Terrain(
        height=ground.height[i[0] : i[1] + 1, j[0] : j[1] + 1],
        size=(float((j[1] - j[0]) * dx), float((i[1] - i[0]) * dy)),
        origin=(float(x0 + j[0] * dx), float(y0 + i[0] * dy)),
        name=ground.name,
    )


def _ground(ground: Terrain) -> dict[str, Any]:
    x, y, height = ground_grid(ground)
    return {
        "rows": len(y),
        "columns": len(x),
        "x": [float(x[0]), float(x[1] - x[0])],
        "y": [float(y[0]), float(y[1] - y[0])],
        "height": packed(height, "f4"),
    }


def packed(values: np.ndarray, kind: str) -> dict[str, str]:
    """An array in the format of the player: f4, u4 or u1, little-endian, in base64."""
    array = np.ascontiguousarray(values, dtype=_TYPES[kind])
    return {"type": kind, "data": base64.b64encode(array.tobytes()).decode("ascii")}
