"""Contact sequences with known answers, and logs around them."""

import numpy as np

from gaitshift.lab.log import Log

TABLE = {
    # gait: (touchdowns of each foot in one cycle [cycle], share of the cycle each is down)
    "trot": (((0.0,), (0.5,), (0.5,), (0.0,)), (0.50, 0.50, 0.50, 0.50)),
    "pace": (((0.0,), (0.5,), (0.0,), (0.5,)), (0.50, 0.50, 0.50, 0.50)),
    "bound": (((0.0,), (0.0,), (0.5,), (0.5,)), (0.50, 0.50, 0.50, 0.50)),
    "pronk": (((0.0,), (0.0,), (0.0,), (0.0,)), (0.50, 0.50, 0.50, 0.50)),
    "walk": (((0.0,), (0.5,), (0.75,), (0.25,)), (0.75, 0.75, 0.75, 0.75)),
    "three_one": (((0.0,), (0.5,), (0.0, 0.5), (0.0, 0.5)), (0.50, 0.50, 0.66, 0.66)),
    "half_bound": (((0.0, 0.5), (0.0, 0.5), (0.75,), (0.25,)), (0.50, 0.50, 0.25, 0.25)),
    "gallop": (((0.0,), (0.8,), (0.5,), (0.3,)), (0.25, 0.25, 0.25, 0.25)),
}
"""Written by hand from what each gait is: feet FL, FR, BL, BR."""


def contacts(
    touchdowns,
    duty,
    *,
    frequency,
    seconds=10.0,
    robots=4,
    jitter=0.0,
    seed=0,
):
    """Contacts (T, N, 4) at 100 Hz of feet that come down at these fractions of each cycle.

    Every robot starts at a phase of its own, and every touchdown and liftoff comes early or late by
    up to `jitter` [s].
    """
    rng = np.random.default_rng(seed)
    steps = round(100 * seconds)
    contact = np.zeros((steps, robots, 4), dtype=bool)
    clock = np.arange(steps) / 100
    for robot in range(robots):
        offset = rng.uniform()
        for leg in range(4):
            stance = duty[leg] / len(touchdowns[leg])
            for cycle in range(-2, round(frequency * seconds) + 3):
                for at in touchdowns[leg]:
                    down, up = rng.uniform(-jitter, jitter, 2)
                    begin = (cycle + at - offset) / frequency + down
                    end = (cycle + at + stance - offset) / frequency + up
                    contact[(clock >= begin) & (clock < end), robot, leg] = True
    return contact


def log_of(contact, *, gaits=("trot",), machine_state=None, stance_shown=None, **changes):
    """A log at 100 Hz of robots that only have contacts; other entries are zero unless given."""
    steps, n, _ = contact.shape
    qpos = np.zeros((steps, n, 19))
    qpos[..., 2], qpos[..., 3] = 0.45, 1.0
    zeros = np.zeros((steps, n))
    command = np.zeros((steps, n, 3))
    command[..., 0], command[..., 2] = 1.2, 2.5
    values = {
        "time": np.arange(1, steps + 1) / 100,
        "qpos": qpos,
        "qvel": np.zeros((steps, n, 18)),
        "torque": np.zeros((steps, n, 12)),
        "contact": contact,
        "foot_position_w": np.zeros((steps, n, 4, 3)),
        "clearance": np.zeros((steps, n, 4)),
        "foot_height": np.zeros((steps, n, 4)),
        "k": zeros,
        "threshold": zeros,
        "gait": np.zeros((steps, n), dtype=np.int64),
        "machine_state": np.zeros((steps, n), dtype=np.int64)
        if machine_state is None
        else machine_state,
        "stance_shown": np.zeros((steps, n), dtype=bool) if stance_shown is None else stance_shown,
        "fallen": np.zeros((steps, n), dtype=bool),
        "command": command,
        "gaits": gaits,
        "robot": "anymal_b",
        "terrain": "flat",
        "terrain_height": np.zeros((2, 2)),
        "terrain_size": np.ones(2),
        "terrain_origin": np.zeros(2),
    }
    return Log(**(values | changes))
