"""Robots that trot over smooth and rough ground, of which the right answer is known by hand."""

import csv

import numpy as np

from gaitshift.lab.identification import LabelledRun
from gaitshift.robot.legs import LEGS
from gaitshift.robot.state import Proprioception
from synthetic import turned

PERIOD = 0.01
FEET = np.array(
    [[0.34, 0.21, -0.5], [0.34, -0.21, -0.5], [-0.34, 0.21, -0.5], [-0.34, -0.21, -0.5]]
)


def march(name, *, noise, seconds=12.0, smooth=4.0, seed=0, robots=3, period=PERIOD):
    """Robots that trot at 1 m/s; from 4 s on the ground under each touch is off by ± noise [m].

    On smooth ground by ± 1 mm, so that no two touches are level.
    """
    rng = np.random.default_rng(seed)
    steps = round(seconds / period)
    time = period * np.arange(1, steps + 1)
    rough = np.broadcast_to((time > smooth)[:, None], (steps, robots))
    if noise == 0.0:
        rough = np.zeros_like(rough)
    contact = np.empty((steps, robots, 4), dtype=bool)
    feet = np.empty((steps, robots, 4, 3))
    for robot in range(robots):
        for leg in range(4):
            phase = (time / 0.5 + (0.5 if leg in (1, 2) else 0.0) + 0.1 * robot) % 1.0
            down = phase < 0.5
            stride = np.cumsum(np.diff(down.astype(int), prepend=0) == 1)
            level = rng.choice((-1.0, 1.0), stride[-1] + 1)
            size = np.where(rough[:, robot], noise, 0.001)
            contact[:, robot, leg] = down
            feet[:, robot, leg] = FEET[leg]
            feet[:, robot, leg, 0] += np.where(down, 0.25 - phase * 0.5, 0.0)
            feet[:, robot, leg, 2] += np.where(down, level[stride] * size, 0.1)
    sensed = Proprioception(
        contact=contact,
        foot_position_b=feet,
        orientation=turned(np.zeros((steps, robots))),
        has_heading=False,
        time=time,
        period=period,
    )
    return LabelledRun(
        name=name,
        sensed=sensed,
        rough=rough.copy(),
        alive=np.ones((steps, robots), dtype=bool),
        distance=np.tile(time[:, None], (1, robots)),
    )


def walk(seed=0):
    """One robot that comes from smooth onto rough ground, in a log at 50 Hz."""
    return march("into", noise=0.04, robots=1, seed=seed, period=0.02)


def table(path, recording):
    """Robot 0 of a recording as a CSV file."""
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        head = ["time", "rough", "roll", "pitch", *(f"contact_{leg}" for leg in LEGS)]
        rows.writerow([*head, *(f"foot_{leg}_{axis}" for leg in LEGS for axis in "xyz")])
        for t in range(len(recording.time)):
            rows.writerow(
                [
                    f"{recording.time[t]:.2f}",
                    int(recording.rough[t, 0]),
                    0.0,
                    0.0,
                    *recording.sensed.contact[t, 0].astype(int),
                    *recording.sensed.foot_position_b[t, 0].ravel(),
                ]
            )
    return path
