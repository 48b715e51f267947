"""Measures the state estimator on walking robots, and writes docs/results/estimator.md and its CSV.

Usage: python tools/estimator_evidence.py

Noise is added to what the simulator knows, and the estimate is compared with the truth. The noise
figures of the estimator were chosen with another seed.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from gaitshift import table
from gaitshift.control import Driver, Estimator, EstimatorState, policy
from gaitshift.lab.evaluation.evaluate import grounds_of, starts
from gaitshift.lab.evaluation.rollout import RolloutConfig, Walk
from gaitshift.robot import legs
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.state import (
    GRAVITY,
    Privileged,
    Proprioception,
    orientation_of,
    rotation_of,
)
from gaitshift.sim.push import PushConfig
from gaitshift.sim.terrain import Terrain, flat
from gaitshift.sim.world import World

RESULTS = Path(__file__).parent.parent / "docs" / "results"
ROBOTS, SECONDS, SETTLED, SEED = 32, 10.0, 200, 21
"""The first `SETTLED` steps, in which robots set off, are left out."""
PUSH = 120.0
TURNS = 10
GAITS = ("trot", "pace", "bound", "walk", "gallop", "pronk")
GROUNDS = {
    "flat": ("flat", 0.0),
    "perlin:0.10": ("perlin:0.10", 0.0),
    "slope:10": ("slope:10", 0.0),
    "pushes": ("flat", PUSH),
}
"""Grounds and pushes [N] by name."""

PAGE = """# Does a robot walk as well when it estimates its velocity?

{answer}

The [estimator](../design.md#the-velocity-of-the-base) sees the inertial unit, the encoders and the
contacts, with the noise "fair" below. {robots} robots walk for {seconds:g} s in each row; the
first {settled:g} s are left out.

{table}

- **bias**, **sd**: mean and standard deviation of estimate less truth, forward / left / up in the
  body frame [mm/s]. The policy sees the true velocity.
- **3σ**: share of the steps in which the error along every axis is within three of the estimator's
  own standard deviations.
- **perfect**, **true v**, **estimated v**: mean forward speed [m/s] with perfect sensors, with
  noise and the true velocity, and with the same noise and the estimate. Two contacts of a hundred
  are wrong, and the machines of the gaits see them too: that is what slows the bound.
- **stay up**: share of the robots that do not fall with this noise, with the true velocity / with
  the estimate.
- **pushes**: flat ground, pushes up to {push:g} N for 0.2 s every 2 s.

The noise, as standard deviations; the tilt of the attitude filter wanders with a time constant of
1 s, and a share of all contacts is wrong:

{noises}

On flat ground, trot, pace and bound:

{variants}

A step for one robot takes {one:.2f} ms, and for 128 robots {share:.2f} of `World.step` (least of
many turns).

The bias that noise does not explain is the motion of feet that count as standing: they bounce as
they land, and slide. Up the slope, the feet of the pace slide back while they push. Feet are taken
to roll about the vertical also there, not about the ground's normal, which adds some 10 mm/s down.

`python tools/estimator_evidence.py` makes this page and [its table](estimator.csv), which has all
noises.
"""


@dataclass(frozen=True, kw_only=True)
class Noise:
    """Standard deviations of what is sensed."""

    gyro: float = 0.0
    gyro_bias: float = 0.0
    accelerometer: float = 0.0
    accelerometer_bias: float = 0.0
    encoder: float = 0.0
    tilt: float = 0.0
    contact: float = 0.0


NOISES = {
    "none": Noise(),
    "good": Noise(
        gyro=0.005,
        gyro_bias=0.001,
        accelerometer=0.05,
        accelerometer_bias=0.02,
        encoder=0.001,
        tilt=0.002,
        contact=0.01,
    ),
    "fair": Noise(
        gyro=0.03,
        gyro_bias=0.003,
        accelerometer=0.15,
        accelerometer_bias=0.05,
        encoder=0.003,
        tilt=0.005,
        contact=0.02,
    ),
    "poor": Noise(
        gyro=0.1,
        gyro_bias=0.01,
        accelerometer=0.3,
        accelerometer_bias=0.1,
        encoder=0.01,
        tilt=0.01,
        contact=0.05,
    ),
}
CLOSED = tuple(
    f"{what}_{which}_velocity" for which in ("true", "estimated") for what in ("speed", "up")
)
SPEEDS = ("perfect_sensors", "true_velocity", "estimated_velocity")
UNITS = {
    "gyro": "rad/s",
    "gyro_bias": "rad/s",
    "accelerometer": "m/s²",
    "accelerometer_bias": "m/s²",
    "encoder": "rad",
    "tilt": "rad",
    "contact": "",
}


def foot_centres(angles: np.ndarray) -> np.ndarray:
    """Centres of ANYmal B's feet (N, 4, 3) at these joint angles (N, 12), body frame [m]."""
    abduction, flexion, knee = np.moveaxis(angles.reshape(-1, 4, 3), -1, 0)
    shank, ahead = flexion + knee, legs.FORE * legs.SHANK_X
    x = legs.FORE * legs.THIGH_X - legs.THIGH * np.sin(flexion) - legs.SHANK_Z * np.sin(shank)
    z = -legs.THIGH * np.cos(flexion) - legs.SHANK_Z * np.cos(shank) - ahead * np.sin(shank)
    x, side = x + ahead * np.cos(shank), legs.SIDE * legs.LEG_Y
    y = np.cos(abduction) * side - np.sin(abduction) * z
    z = np.sin(abduction) * side + np.cos(abduction) * z
    return np.stack((legs.FORE * legs.HIP_X + x, legs.SIDE * legs.HIP_Y + y, z), axis=-1)


class Sensors:
    """Noisy proprioception of N robots without a velocity, from perfect proprioception."""

    def __init__(self, noise: Noise, n: int, seed: int) -> None:
        self._noise, self._rng = noise, np.random.default_rng(seed)
        self._gyro_bias, self._force_bias = (
            self._draw(bias, n, 3) for bias in (noise.gyro_bias, noise.accelerometer_bias)
        )
        self._tilt = self._draw(noise.tilt, n, 3)

    def __call__(self, ideal: Proprioception, force_b: np.ndarray) -> Proprioception:
        """What is sensed a step later, of the true specific force [m/s²]."""
        noise, n, kept = self._noise, len(force_b), np.exp(-ideal.period)
        self._tilt = kept * self._tilt + self._draw(np.sqrt(1 - kept**2) * noise.tilt, n, 3)
        gravity = ideal.gravity_b + np.cross(self._tilt, ideal.gravity_b)
        gravity /= np.linalg.norm(gravity, axis=1, keepdims=True)
        joints = ideal.joint_position
        read = joints + self._draw(noise.encoder, n, 12)
        feet = ideal.foot_position_b + foot_centres(read) - foot_centres(joints)
        rate = ideal.angular_velocity_b + self._gyro_bias + self._draw(noise.gyro, n, 3)
        return replace(
            ideal,
            velocity_b=None,
            specific_force_b=force_b + self._force_bias + self._draw(noise.accelerometer, n, 3),
            angular_velocity_b=rate,
            orientation=orientation_of(gravity, ideal.yaw),
            joint_position=read,
            foot_position_b=feet,
            contact=ideal.contact ^ (self._rng.random((n, 4)) < noise.contact),
        )

    def _draw(self, deviation: float, *shape: int) -> np.ndarray:
        return deviation * self._rng.standard_normal(shape)


class Accelerometer:
    """The mean specific force of N bases over each step, from how their velocity changes."""

    def __init__(self, truth: Privileged) -> None:
        self._before = self._motion(truth)

    def __call__(self, truth: Privileged) -> np.ndarray:
        """The mean over the step that ended here, body frame [m/s²]."""
        rotation, velocity = self._before
        self._before = self._motion(truth)
        force_w = (self._before[1] - velocity) / CONTROL_PERIOD + np.array([0.0, 0.0, GRAVITY])
        middle = 0.5 * (rotation + self._before[0])
        return np.einsum("nij,ni->nj", middle, force_w)

    @staticmethod
    def _motion(truth: Privileged) -> tuple[np.ndarray, np.ndarray]:
        rotation = rotation_of(truth.base_quaternion_w)
        return rotation, np.einsum("nij,nj->ni", rotation, truth.velocity_b)


class NoisyWorld(World):
    """A world whose robots sense with noise, and their velocity only if it is `given`."""

    def __init__(
        self, grounds: list[Terrain], n: int, gains: str, noise: Noise, *, given: bool
    ) -> None:
        self._noise, self._given = noise, given
        super().__init__(ANYMAL_B, grounds, n, gains=gains)

    def place(self, ids: np.ndarray, **where: np.ndarray) -> None:
        """Sets robots down; the errors of all begin anew."""
        super().place(ids, **where)
        self._errors = Sensors(self._noise, self.n, SEED)
        self._accelerometer = Accelerometer(self.truth)
        self._sense(self.sensed)

    def step(self, target: np.ndarray) -> tuple[Proprioception, Privileged]:
        """A control step."""
        self._sense(super().step(target)[0])
        return self.sensed, self.truth

    def _sense(self, ideal: Proprioception) -> None:
        sensed = self._errors(ideal, self._accelerometer(self.truth))
        velocity_b = self.truth.velocity_b if self._given else None
        self.sensed = replace(sensed, velocity_b=velocity_b)


class Watcher:
    """An estimator beside a walk, and its errors."""

    def __init__(self, estimator: Estimator, n: int, *, forgets: bool = False) -> None:
        self._estimator, self._state = estimator, estimator.begin(n)
        self._forgets = forgets
        self._errors: list[np.ndarray] = []
        self._deviations: list[np.ndarray] = []

    def see(self, sensed: Proprioception, velocity_b: np.ndarray) -> None:
        """One step further."""
        self._state, sensed = self._estimator.step(self._state, sensed)
        self._errors.append(sensed.velocity_b - velocity_b)
        self._deviations.append(self._state.velocity_deviation)
        if self._forgets:
            self._state = self._without_memory(self._state, sensed)

    @staticmethod
    def _without_memory(state: EstimatorState, sensed: Proprioception) -> EstimatorState:
        """Feet begin anew where they are measured: only the difference of a step counts."""
        covariance = np.zeros_like(state.covariance)
        covariance[:, 0, 0] = state.covariance[:, 0, 0]
        covariance[:, range(1, 5), range(1, 5)] = Estimator(robot=ANYMAL_B).config.foot ** 2
        return replace(state, foot_b=sensed.foot_position_b, covariance=covariance)

    def figures(self, up: np.ndarray) -> dict[str, float]:
        """Figures of the robots that are still up."""
        errors = np.array(self._errors)[SETTLED:, up]
        deviations = np.array(self._deviations)[SETTLED:, up]
        within = (np.abs(errors) < 3.0 * deviations[..., None]).all(axis=-1).mean()
        figures = {"within_3_sigma": round(float(within), 4)}
        for i, axis in enumerate(("forward", "left", "up")):
            figures[f"bias_{axis}"] = round(float(errors[..., i].mean()), 4)
            figures[f"sd_{axis}"] = round(float(errors[..., i].std()), 4)
        return figures


def walk(gait: str, ground: str, noise: Noise | None = None, *, given: bool = True) -> Walk:
    """Robots about to walk, with perfect sensors or with noise."""
    terrain, push = GROUNDS[ground]
    rng = np.random.default_rng(SEED)
    driver = Driver({gait: policy.load(gait)}, ROBOTS, start=gait)
    speed = float(driver.repertoire.forward_speed.max())
    grounds = grounds_of(terrain, seed=SEED, speed=speed, seconds=SECONDS)
    world = (
        World(ANYMAL_B, grounds, ROBOTS, gains=driver.gains)
        if noise is None
        else NoisyWorld(grounds, ROBOTS, driver.gains, noise, given=given)
    )
    config = RolloutConfig(seconds=SECONDS, push=PushConfig(force=push))
    return Walk(world, driver, config, start_xy=starts(driver, rng), rng=rng)


def walked(run: Walk) -> Iterator[World]:
    """The world after each step."""
    for _ in range(run.config.steps):
        run.step()
        yield run.world


def in_open_loop(gait: str, ground: str) -> tuple[list[table.Row], float]:
    """Errors beside robots that see their true velocity, and the speed of these."""
    run = walk(gait, ground)
    full, point = (Estimator(robot=replace(ANYMAL_B, foot_radius=r)) for r in (0.031, 0.001))
    watched = {(noise, "full"): Watcher(full, ROBOTS) for noise in NOISES}
    watched["fair", "feet are points"] = Watcher(point, ROBOTS)
    watched["fair", "feet by differences"] = Watcher(full, ROBOTS, forgets=True)
    accelerometer = Accelerometer(run.world.truth)
    sensors = {name: Sensors(noise, ROBOTS, SEED) for name, noise in NOISES.items()}
    speeds: list[np.ndarray] = []
    for world in walked(run):
        force, truth = accelerometer(world.truth), world.truth.velocity_b
        sensed = {name: sense(world.sensed, force) for name, sense in sensors.items()}
        for (noise, _), watcher in watched.items():
            watcher.see(sensed[noise], truth)
        speeds.append(truth[:, 0])
    up = ~run.fallen
    rows = [
        {"gait": gait, "ground": ground, "noise": noise, "estimator": kind, **watcher.figures(up)}
        for (noise, kind), watcher in watched.items()
    ]
    return rows, float(np.array(speeds)[SETTLED:, up].mean())


def in_closed_loop(gait: str, ground: str, noise: str) -> table.Row:
    """Speeds and survival of robots with noise that see the true velocity, and the estimate."""
    row: table.Row = {}
    for name, given in (("true", True), ("estimated", False)):
        run = walk(gait, ground, NOISES[noise], given=given)
        speeds = [world.truth.velocity_b[:, 0] for world in walked(run)]
        up = ~run.fallen
        row[f"speed_{name}_velocity"] = round(float(np.array(speeds)[SETTLED:, up].mean()), 4)
        row[f"up_{name}_velocity"] = float(up.mean())
    return row


def measured() -> list[table.Row]:
    """All rows of the CSV file."""
    rows: list[table.Row] = []
    for gait in GAITS:
        for ground in GROUNDS:
            opened, perfect = in_open_loop(gait, ground)
            closed = ("fair", "poor") if ground == "flat" else ("fair",)
            for row in opened:
                row |= {"speed_perfect_sensors": round(perfect, 4), **dict.fromkeys(CLOSED, "")}
                if row["estimator"] == "full" and row["noise"] in closed:
                    row |= in_closed_loop(gait, ground, row["noise"])
                print(row, flush=True)
            rows += opened
    return rows


def cost() -> tuple[float, float]:
    """Least time of a step for one robot [ms], and for 128 robots over that of the world.

    Without the rotation matrices, which every policy needs as well.
    """
    world = World(ANYMAL_B, flat(20.0, 20.0), 128)
    accelerometer, estimator = Accelerometer(world.truth), Estimator(robot=ANYMAL_B)
    states = estimator.begin(1), estimator.begin(128)
    taken: list[tuple[float, ...]] = []
    for target in np.random.default_rng(0).normal(ANYMAL_B.stance_angles, 0.15, (300, 128, 12)):
        times = [time.perf_counter()]
        ideal, truth = world.step(target)
        times.append(time.perf_counter())
        everyone = replace(ideal, velocity_b=None, specific_force_b=accelerometer(truth))
        for state, sensed in zip(states, (everyone.robots(np.arange(1)), everyone), strict=True):
            assert sensed.rotation.any()
            start = time.perf_counter()
            for _ in range(TURNS):
                estimator.step(state, sensed)
            times.append(start + (time.perf_counter() - start) / TURNS)
            times.append(start)
        taken.append((times[1] - times[0], times[2] - times[3], times[4] - times[5]))
    world_time, one, many = (min(column) for column in zip(*taken, strict=True))
    return 1e3 * one, many / world_time


def _error(row: table.Row) -> tuple[str, str]:
    bias, spread = (
        " / ".join(f"{1000 * row[f'{name}_{axis}']:.0f}" for axis in ("forward", "left", "up"))
        for name in ("bias", "sd")
    )
    return bias, spread


def page(rows: list[table.Row], one: float, share: float) -> str:
    """The text of the page."""
    shown = [row for row in rows if row["noise"] == "fair" and row["estimator"] == "full"]
    lines = [
        (
            *(row["gait"], row["ground"], *_error(row), f"{row['within_3_sigma']:.3f}"),
            *(f"{row[f'speed_{of}']:.3f}" for of in SPEEDS),
            f"{row['up_true_velocity']:.2f} / {row['up_estimated_velocity']:.2f}",
        )
        for row in shown
    ]
    head = ("gait", "ground", "bias", "sd", "3σ", "perfect", "true v", "estimated v", "stay up")
    noises = [
        (name, *(f"{getattr(noise, field):g} {unit}".strip() for field, unit in UNITS.items()))
        for name, noise in NOISES.items()
    ]
    off = [
        max(abs(row["speed_estimated_velocity"] - row["speed_true_velocity"]) for row in of)
        for of in (shown, [r for r in shown if r["gait"] in GAITS[:3] and r["ground"] == "flat"])
    ]
    answer = (
        "Yes: beside robots that see their true velocity through the same noise, six gaits keep "
        f"their speed within {off[0]:.3f} m/s on flat ground, on noise of 10 cm, up a slope of 10° "
        f"and under pushes; trot, pace and bound on flat ground within {off[1]:.3f} m/s."
    )
    return PAGE.format(
        answer=answer,
        robots=ROBOTS,
        seconds=SECONDS,
        settled=SETTLED / 100,
        push=PUSH,
        table=table.markdown(head, lines),
        noises=table.markdown(("", *(name.replace("_", " ") for name in UNITS)), noises),
        variants="\n".join(_variants(rows)),
        one=one,
        share=share,
    )


def _variants(rows: list[table.Row]) -> Iterator[str]:
    """What noise and the parts of the estimator change, a line each."""
    flat_rows = [row for row in rows if row["ground"] == "flat" and row["gait"] in GAITS[:3]]
    kinds = dict.fromkeys((row["noise"], row["estimator"]) for row in flat_rows)
    for noise, kind in kinds:
        chosen = [r for r in flat_rows if (r["noise"], r["estimator"]) == (noise, kind)]
        bias = 1000 * np.mean([row["bias_forward"] for row in chosen])
        spread = 1000 * np.mean([row["sd_forward"] for row in chosen])
        what = "" if kind == "full" else f", {kind}"
        yield f"- noise {noise}{what}: forward bias {bias:.0f} mm/s, sd {spread:.0f} mm/s"


def main() -> None:
    """Measures all, and writes the page and the table."""
    one, share = cost()
    rows = measured()
    table.write(RESULTS / "estimator.csv", rows)
    (RESULTS / "estimator.md").write_text(page(rows, one, share), encoding="utf-8")


if __name__ == "__main__":
    main()
