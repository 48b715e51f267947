"""Measures the state estimator on walking robots, and writes docs/results/estimator.md and its CSV.

Usage: python tools/estimator_evidence.py     (about ten minutes on two idle cores)
"""

import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

from gaitshift import table
from gaitshift.control import Driver, Estimator, policy
from gaitshift.lab.evaluation.evaluate import grounds_of, starts
from gaitshift.lab.evaluation.rollout import RolloutConfig, Walk
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.push import PushConfig
from gaitshift.sim.sensor_config import ANYMAL, CHEAP, PERFECT, SensorConfig
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import World

RESULTS = Path(__file__).parent.parent / "docs" / "results"
ROBOTS, SECONDS, SETTLED, SEED = 32, 10.0, 200, 21
"""The first `SETTLED` steps, in which robots set off, are left out. The noise figures of the
estimator were chosen with another seed."""
PUSH = 120.0
GAITS = ("trot", "pace", "bound", "walk", "gallop", "pronk")
GROUNDS = {
    "flat": ("flat", 0.0),
    "perlin:0.10": ("perlin:0.10", 0.0),
    "slope:10": ("slope:10", 0.0),
    "pushes": ("flat", PUSH),
}
"""Grounds and pushes [N] by name."""
ESTIMATORS = {
    "full": Estimator(robot=ANYMAL_B),
    "feet are points": Estimator(robot=replace(ANYMAL_B, foot_radius=1e-3)),
}
AXES = ("forward", "left", "up")

PAGE = """# Does a robot walk as well when it estimates its velocity?

{answer}

The [estimator](../design.md#the-velocity-of-the-base) sees what the
[sensors](../design.md#sensors-and-delay) of a preset give: inertial unit, encoders and contacts
with their errors. {robots} robots walk for {seconds:g} s in each row (seed {seed}); the first
{settled:g} s are left out.

{table}

- **bias**, **sd**: mean and standard deviation of estimate less truth, forward / left / up in the
  body frame [mm/s]. The policy sees the true velocity.
- **3σ**: share of the steps in which the error along every axis is within three of the estimator's
  own standard deviations.
- **perfect**, **true v**, **estimated v**: mean forward speed [m/s] with perfect sensors; with the
  preset and the true velocity; and with the preset and the estimate. The preset's contact errors
  reach the machines of the gaits too, and its delay the joints.
- **stay up**: share of the robots that do not fall, with the true velocity / with the estimate.
- **pushes**: flat ground, pushes up to {push:g} N for 0.2 s every 2 s.

Feet are spheres that roll. An estimator that takes them for points has a forward bias of {points}
mm/s in trot, pace and bound on flat ground with `anymal`, in place of {rolling} mm/s.

A step for one robot takes {one:.2f} ms, and for 128 robots {share:.2f} of the time of `World.step`.

`python tools/estimator_evidence.py` makes this page and [its table](estimator.csv).
"""


class Watcher:
    """An estimator beside a walk whose robots are given their velocity, and its errors."""

    def __init__(self, estimator: Estimator) -> None:
        self._estimator, self._state = estimator, estimator.begin(ROBOTS)
        self._errors: list[np.ndarray] = []
        self._deviations: list[np.ndarray] = []

    def see(self, world: World) -> None:
        """One step further."""
        sensed = replace(world.sensed, velocity_b=None)
        self._state, sensed = self._estimator.step(self._state, sensed)
        self._errors.append(sensed.velocity_b - world.truth.velocity_b)
        self._deviations.append(self._state.velocity_deviation)

    def figures(self, up: np.ndarray) -> dict[str, float]:
        """Figures of the robots that are still up."""
        errors = np.array(self._errors)[SETTLED:, up]
        deviations = np.array(self._deviations)[SETTLED:, up]
        within = (np.abs(errors) < 3.0 * deviations[..., None]).all(axis=-1).mean()
        figures = {"within_3_sigma": round(float(within), 4)}
        for i, axis in enumerate(AXES):
            figures[f"bias_{axis}"] = round(float(errors[..., i].mean()), 4)
            figures[f"sd_{axis}"] = round(float(errors[..., i].std()), 4)
        return figures


def walked(
    gait: str, ground: str, sensors: SensorConfig, watchers: tuple[Watcher, ...] = ()
) -> tuple[float, np.ndarray]:
    """The mean speed of the robots that stay up [m/s], and which these are."""
    terrain, push = GROUNDS[ground]
    rng = np.random.default_rng(SEED)
    driver = Driver({gait: policy.load(gait)}, ROBOTS, start=gait)
    speed = float(driver.repertoire.forward_speed.max())
    grounds = grounds_of(terrain, seed=SEED, speed=speed, seconds=SECONDS)
    world = World(ANYMAL_B, grounds, ROBOTS, gains=driver.gains, sensors=sensors, seed=SEED)
    config = RolloutConfig(seconds=SECONDS, push=PushConfig(force=push))
    run = Walk(world, driver, config, start_xy=starts(driver, rng), rng=rng)
    speeds: list[np.ndarray] = []
    for _ in range(config.steps):
        run.step()
        for watcher in watchers:
            watcher.see(world)
        speeds.append(world.truth.forward_speed)
    up = ~run.fallen
    return float(np.array(speeds)[SETTLED:, up].mean()), up


def measured() -> list[table.Row]:
    """All rows of the CSV file."""
    rows: list[table.Row] = []
    for gait in GAITS:
        for ground in GROUNDS:
            perfect, _ = walked(gait, ground, PERFECT)
            for sensors in (ANYMAL, CHEAP) if ground == "flat" else (ANYMAL,):
                watchers = {name: Watcher(estimator) for name, estimator in ESTIMATORS.items()}
                given = replace(sensors, measures_velocity=True)
                true, stood = walked(gait, ground, given, tuple(watchers.values()))
                estimated, up = walked(gait, ground, sensors)
                for name, watcher in watchers.items():
                    row: table.Row = {"gait": gait, "ground": ground, "sensors": sensors.name}
                    row |= {"estimator": name, **watcher.figures(stood)}
                    row |= {
                        "speed_perfect_sensors": round(perfect, 4),
                        "speed_true_velocity": round(true, 4),
                        "speed_estimated_velocity": round(estimated, 4),
                        "up_true_velocity": float(stood.mean()),
                        "up_estimated_velocity": float(up.mean()),
                    }
                    rows.append(row)
                    print(row, flush=True)
    return rows


def cost(robots: int, turns: int = 200) -> tuple[float, float]:
    """Median time of a step of estimator and world for this many robots [ms].

    Without the rotation matrices, which every policy needs as well.
    """
    world = World(ANYMAL_B, flat(20.0, 20.0), robots, sensors=ANYMAL)
    estimator, times = Estimator(robot=ANYMAL_B), np.zeros((turns, 2))
    state = estimator.begin(robots)
    for turn in range(turns):
        begun = time.perf_counter()
        sensed, _ = world.step(np.tile(ANYMAL_B.stance_angles, (robots, 1)))
        assert sensed.rotation.any()
        between = time.perf_counter()
        state, _ = estimator.step(state, sensed)
        times[turn] = between - begun, time.perf_counter() - between
    stepped, estimated = (1e3 * median(column) for column in times.T)
    return estimated, stepped


def page(rows: list[table.Row]) -> str:
    """The text of the page."""
    full = [row for row in rows if row["estimator"] == "full"]
    lines = [
        (
            *(row["gait"], row["ground"], row["sensors"]),
            *(_per_axis(row, name) for name in ("bias", "sd")),
            f"{row['within_3_sigma']:.3f}",
            *(f"{row[f'speed_{of}']:.3f}" for of in _SPEEDS),
            f"{row['up_true_velocity']:.2f} / {row['up_estimated_velocity']:.2f}",
        )
        for row in full
    ]
    head = ("gait", "ground", "sensors", "bias", "sd", "3σ", *_HEADS, "stay up")
    of_anymal = [row for row in full if row["sensors"] == ANYMAL.name]
    first = [row for row in of_anymal if row["gait"] in GAITS[:3] and row["ground"] == "flat"]
    answer = (
        "Yes: beside robots that see their true velocity with the same sensors (`anymal`), six "
        f"gaits keep their speed within {_off(of_anymal):.3f} m/s on flat ground, on noise of "
        f"10 cm, up a slope of 10° and under pushes; trot, pace and bound on flat ground within "
        f"{_off(first):.3f} m/s."
    )
    biases = {
        name: " / ".join(
            f"{1000 * row['bias_forward']:.0f}"
            for row in rows
            if row["estimator"] == name
            and (row["ground"], row["sensors"]) == ("flat", ANYMAL.name)
            and row["gait"] in GAITS[:3]
        )
        for name in ESTIMATORS
    }
    (one, _), (many, stepped) = cost(1), cost(128)
    return PAGE.format(
        answer=answer,
        robots=ROBOTS,
        seconds=SECONDS,
        seed=SEED,
        settled=SETTLED / 100,
        push=PUSH,
        table=table.markdown(head, lines),
        points=biases["feet are points"],
        rolling=biases["full"],
        one=one,
        share=many / stepped,
    )


_SPEEDS = ("perfect_sensors", "true_velocity", "estimated_velocity")
_HEADS = ("perfect", "true v", "estimated v")


def _off(rows: list[table.Row]) -> float:
    """Largest difference of the speeds with the estimate and with the true velocity [m/s]."""
    return max(abs(row["speed_estimated_velocity"] - row["speed_true_velocity"]) for row in rows)


def _per_axis(row: table.Row, name: str) -> str:
    return " / ".join(f"{1000 * row[f'{name}_{axis}']:.0f}" for axis in AXES)


def main() -> None:
    """Measures, and writes page and table."""
    rows = measured()
    table.write(RESULTS / "estimator.csv", rows)
    (RESULTS / "estimator.md").write_text(page(rows), encoding="utf-8")


if __name__ == "__main__":
    main()
