"""Measures what each physics setting costs and changes, and writes docs/results/physics.md.

Usage: python tools/physics_evidence.py

The model of exact physics is changed in one setting a row. Times are medians of turns over those of
exact physics in the same run.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from statistics import median
from typing import Any
from unittest import mock

import mujoco
import numpy as np

from gaitshift import table
from gaitshift.control import policy
from gaitshift.lab.evaluation import EvaluationConfig, evaluate
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.description import ANYMAL_B
from gaitshift.sim.terrain import flat, from_spec
from gaitshift.sim.world import World
from gaitshift.sim.world import world as world_module
from gaitshift.sim.world.model import COARSE_TOLERANCE, build_model

PAGE = """# Which physics settings keep feet from sinking and creeping?

{answer}

Each row changes exact physics (2.5 ms, elliptic cones, noslip, contacts twice as stiff as MuJoCo's
default) as its name says.

{table}

- **time**: of bare physics over that of exact physics: 128 robots on level ground, random targets,
  medians of {turns} turns.
- **sinks**: deepest place of a foot below a height field of noise of 0.15 m, of {drops} robots that
  fall onto it at 2 to 4 m/s.
- **stuck**: feet of these robots that are more than 2 cm below the ground after 1.5 s.
- **creeps**: median speed of the feet of robots that stand still on level ground, after 1 s.
- **trot**, **bound**: what the shipped policies do there: the name by the contacts, clean or not,
  and the speed (16 robots, 8 s).

Shapes that are only drawn are left out of every model: 92 shapes become 17, with the same motion to
the last bit. Coarse physics is for training alone ([the stages](training-recipe.md)); all that is
judged walks in exact physics.

This page is made by `python tools/physics_evidence.py`.
"""

TURNS, DROPS, STUCK = 5, 60, -0.02

Change = Callable[[mujoco.MjModel], None]


def _exact(model: mujoco.MjModel) -> None:
    pass


def _pyramidal(model: mujoco.MjModel) -> None:
    model.opt.cone = mujoco.mjtCone.mjCONE_PYRAMIDAL


def _without_noslip(model: mujoco.MjModel) -> None:
    model.opt.noslip_iterations = 0


def _steps(count: int) -> Change:
    """As many steps to a control step."""

    def change(model: mujoco.MjModel) -> None:
        model.opt.timestep = CONTROL_PERIOD / count

    return change


def _loose(model: mujoco.MjModel) -> None:
    model.opt.tolerance = COARSE_TOLERANCE


def _conjugate_gradients(model: mujoco.MjModel) -> None:
    model.opt.solver = mujoco.mjtSolver.mjSOL_CG


def _cold(model: mujoco.MjModel) -> None:
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_WARMSTART


def _usual_contacts(model: mujoco.MjModel) -> None:
    model.geom_solref[:] = (0.02, 1.0)
    model.geom_solimp[:] = (0.9, 0.95, 0.001, 0.5, 2.0)


def _all(*changes: Change) -> Change:
    def change(model: mujoco.MjModel) -> None:
        for one in changes:
            one(model)

    return change


CHANGES: dict[str, Change] = {
    "exact": _exact,
    "pyramidal cones": _pyramidal,
    "no noslip": _without_noslip,
    "tolerance 1e-4": _loose,
    "conjugate gradients": _conjugate_gradients,
    "no warm start": _cold,
    "3.3 ms": _steps(3),
    "3.3 ms, pyramidal": _all(_steps(3), _pyramidal),
    "coarse: 3.3 ms, pyramidal, tolerance 1e-4": _all(_steps(3), _pyramidal, _loose),
    "5 ms": _steps(2),
    "5 ms, pyramidal, no noslip": _all(_steps(2), _pyramidal, _without_noslip),
    "5 ms and MuJoCo's defaults": _all(_steps(2), _pyramidal, _without_noslip, _usual_contacts),
}
COARSE = "coarse: 3.3 ms, pyramidal, tolerance 1e-4"


@contextmanager
def changed(change: Change) -> Iterator[None]:
    """Every world that is built meanwhile has this change of exact physics."""

    def build(*arguments: Any) -> mujoco.MjModel:
        model = build_model(*arguments)
        change(model)
        return model

    with mock.patch.object(world_module, "build_model", build):
        yield


def times() -> dict[str, float]:
    """Time of each over that of exact physics."""
    worlds: dict[str, World] = {}
    for name, change in CHANGES.items():
        with changed(change):
            worlds[name] = World(ANYMAL_B, flat(20.0, 20.0), 128)
    targets = np.random.default_rng(0).normal(ANYMAL_B.stance_angles, 0.15, (60, 128, 12))
    taken: dict[str, list[float]] = {name: [] for name in worlds}
    for _ in range(TURNS + 1):
        for name, world in worlds.items():
            start = time.perf_counter()
            for target in targets:
                world.step(target)
            taken[name].append(time.perf_counter() - start)
    return {name: median(taken[name][1:]) / median(taken["exact"][1:]) for name in worlds}


def dropped() -> tuple[float, int]:
    """Depth to which feet sink [m], and the number of feet that are stuck."""
    rng = np.random.default_rng(0)
    ground = from_spec("perlin:0.15", seed=0, length=20.0, width=20.0)
    world = World(ANYMAL_B, ground, DROPS)
    down = np.zeros((DROPS, 3))
    down[:, 2] = -rng.uniform(2.0, 4.0, DROPS)
    low, size = np.array(ground.origin), np.array(ground.size)
    xy, yaw = low + rng.uniform(0.2, 0.8, (DROPS, 2)) * size, rng.uniform(-3.0, 3.0, DROPS)
    world.place(np.arange(DROPS), xy=xy, yaw=yaw, base_velocity_w=down)
    stance = np.tile(ANYMAL_B.stance_angles, (DROPS, 1))
    deepest = 0.0
    for _ in range(round(1.5 / CONTROL_PERIOD)):
        world.step(stance)
        deepest = min(deepest, float(world.truth.clearance.min()))
    return -deepest, int((world.truth.clearance < STUCK).sum())


def crept() -> float:
    """Median speed of standing feet over the ground [mm/s]."""
    world = World(ANYMAL_B, flat(20.0, 20.0), 8)
    yaw = np.linspace(0.0, 3.0, 8)
    world.place(np.arange(8), xy=np.zeros((8, 2)), yaw=yaw)
    stance = np.tile(ANYMAL_B.stance_angles, (8, 1))
    for _ in range(round(1.0 / CONTROL_PERIOD)):
        world.step(stance)
    before = world.truth.foot_position_w.copy()
    for _ in range(round(4.0 / CONTROL_PERIOD)):
        world.step(stance)
    moved = np.linalg.norm((world.truth.foot_position_w - before)[..., :2], axis=-1)
    return float(np.median(moved)) / 4.0 * 1e3


def walked(gait: str) -> str:
    """What a shipped policy does."""
    figures, _ = evaluate(policy.load(gait), EvaluationConfig(episodes=16, seconds=8.0))
    verdict = figures["verdict"]
    clean = "clean" if verdict["clean"] else "not clean"
    return f"{verdict['gait']}, {clean}, {figures['speed_mean']:.2f} m/s"


def main() -> None:
    """Measures all, and writes the page."""
    cost = times()
    rows: list[tuple[str, ...]] = []
    for name, change in CHANGES.items():
        with changed(change):
            sinks, stuck = dropped()
            row = (name, f"{cost[name]:.2f}", f"{100 * sinks:.1f} cm", str(stuck))
            rows.append((*row, f"{crept():.1f} mm/s", walked("trot"), walked("bound")))
        print(rows[-1], flush=True)
    head = ("setting", "time", "sinks", "stuck", "creeps", "trot", "bound")
    by_name = {row[0]: row for row in rows}
    exact, coarse = rows[0], by_name[COARSE]
    answer = (
        f"Exact physics: a foot that falls onto noise sinks at most {exact[2]}, and standing feet "
        f"creep by {exact[4]}. Coarse physics takes {coarse[1]} of its time, feet sink {coarse[2]} "
        f"and creep by {coarse[4]}."
    )
    text = PAGE.format(answer=answer, table=table.markdown(head, rows), turns=TURNS, drops=DROPS)
    path = Path(__file__).parent.parent / "docs" / "results" / "physics.md"
    path.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
