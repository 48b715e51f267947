"""Results of instant shifts from one gait to another, at every phase of the stride."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
from jaxtyping import Bool, Float, Int

from gaitshift.control import Controller, Driver
from gaitshift.control.policy import Policy
from gaitshift.control.switcher import uncounted
from gaitshift.lab.evaluation.evaluate import grounds_of, starts
from gaitshift.lab.evaluation.rollout import RolloutConfig, in_batches, rollout
from gaitshift.lab.identification import wilson
from gaitshift.lab.log import Log
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.robot.state import Privileged, Proprioception, rotation_of
from gaitshift.shift import Decision
from gaitshift.sim.sensor_config import PERFECT, SensorConfig
from gaitshift.sim.world import World
from gaitshift.table import Row, markdown

GROUNDS = ("flat", "perlin:0.10")
"""Specs of the grounds on which shifts are tested."""

WARM_UP = 2.0
"""Seconds in the old gait before the earliest shift; ours: it has settled by then."""

WATCHED = 5.0
"""Seconds within which a shift must succeed."""

REACHED = 0.5
"""The new gait is reached when this share of the steps of a stride, and of every later stride,
shows a stance of its machine; ours: below the limit of a clean gait on flat ground, since noise
lowers it."""

BATCH = 512
"""Robots at a time: their log takes 130 MB."""


@dataclass(frozen=True)
class Pair:
    """A shift."""

    old: str
    new: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Outcomes:
    """Results of N shifts."""

    phase: Float[np.ndarray, " N"]
    """Time since the last touchdown of FL at the shift [stride of the old gait]."""
    fell: Bool[np.ndarray, " N"]
    """Whether the robot fell within `WATCHED` seconds."""
    settle: Float[np.ndarray, " N"]
    """Time until the new gait is reached and held [s]; NaN where it never is."""
    dip: Float[np.ndarray, " N"]
    """Largest drop of a stride's mean speed below the slower of the two commands [m/s]."""
    tilt: Float[np.ndarray, " N"]
    """Largest angle of the body from upright after the shift [rad]."""

    @property
    def success(self) -> Bool[np.ndarray, " N"]:
        """No fall, and the new gait reached."""
        return ~self.fell & ~np.isnan(self.settle)


def run_pair(
    policies: Mapping[str, Policy],
    pair: Pair,
    *,
    ground: str,
    switches: int,
    seed: int,
    sensors: SensorConfig = PERFECT,
    report: Callable[[int, int], None] = lambda done, total: None,
) -> Outcomes:
    """Shifts robots from one gait to the other, each at its own phase of the stride."""
    return in_batches(
        lambda n, seed: _run_batch(policies, pair, ground, n, sensors=sensors, seed=seed),
        switches,
        most=BATCH,
        seed=seed,
        report=report,
    )


@dataclass(frozen=True, eq=False)
class _AtSteps:
    """Changes each robot's gait once, at its own step."""

    step_of: Int[np.ndarray, " N"]
    gait: str

    def step(
        self, sensed: Proprioception, controller: Controller, truth: Privileged | None = None
    ) -> Decision:
        """Changes the gaits that are due in the control step that ends now."""
        due = self.step_of == round(float(sensed.time) / CONTROL_PERIOD)
        controller.switch(np.flatnonzero(due), self.gait, sensed)
        return uncounted(due)


def _run_batch(
    policies: Mapping[str, Policy],
    pair: Pair,
    ground: str,
    n: int,
    *,
    sensors: SensorConfig,
    seed: int,
) -> Outcomes:
    rng = np.random.default_rng(seed)
    old, new = policies[pair.old], policies[pair.new]
    stride = round(1.0 / (old.info.stride_frequency * CONTROL_PERIOD))
    at = round(WARM_UP / CONTROL_PERIOD) + rng.integers(0, stride, n)
    seconds = WARM_UP + WATCHED + stride * CONTROL_PERIOD
    fastest = max(old.info.forward_speed, new.info.forward_speed)
    grounds = grounds_of(ground, seed=seed, speed=fastest, seconds=seconds)
    driver = Driver({pair.old: old, pair.new: new}, n, start=pair.old)
    world = World(driver.robot, grounds, n, gains=driver.gains, sensors=sensors, seed=seed)
    log = rollout(
        world,
        driver,
        RolloutConfig(seconds=seconds),
        start_xy=starts(driver, rng),
        rng=rng,
        switcher=_AtSteps(at, pair.new),
    )
    return measure_shifts(log, at - 1, old, new)


def measure_shifts(log: Log, at: Int[np.ndarray, " N"], old: Policy, new: Policy) -> Outcomes:
    """Outcomes of a log in which each robot changed its gait in entry `at`."""
    n = log.n
    watched = round(WATCHED / CONTROL_PERIOD)
    # (watched, N); a log may end early, when all have fallen
    entries: np.ndarray = np.minimum(at + 1 + np.arange(watched)[:, None], len(log.time) - 1)
    robots = cast(Any, np.arange(n))
    fallen: np.ndarray = log.fallen[entries, robots]
    stride = round(1.0 / (new.info.stride_frequency * CONTROL_PERIOD))
    shown = running_mean(log.stance_shown[entries, robots].astype(float), stride)
    forward = log.truth.forward_speed[entries, robots].astype(float)
    upright = rotation_of(log.truth.base_quaternion_w[entries, robots].astype(float))[..., 2, 2]
    slower = min(old.info.forward_speed, new.info.forward_speed)
    return Outcomes(
        phase=_phase(log.sensed.contact[..., 0], at, old),
        fell=fallen[-1],
        settle=_settled(shown >= REACHED, stride),
        dip=np.maximum(slower - running_mean(forward, stride).min(axis=0), 0.0),
        tilt=np.arccos(np.clip(upright, -1.0, 1.0)).max(axis=0),
    )


def running_mean(values: Float[np.ndarray, "T N"], window: int) -> Float[np.ndarray, "S N"]:
    """Means over `window` consecutive entries; entry s is the mean over s to s + window − 1."""
    total = np.concatenate([np.zeros((1, values.shape[1])), values.cumsum(axis=0)])
    return (total[window:] - total[:-window]) / window


def _settled(reached: Bool[np.ndarray, "S N"], stride: int) -> Float[np.ndarray, " N"]:
    """End of the first stride from which on the gait is always reached [s]; NaN if never."""
    lost = ~reached
    last = len(reached) - lost[::-1].argmax(axis=0)  # the entry after the last that is not reached
    first = np.where(lost.any(axis=0), last, 0)
    return np.where(first < len(reached), (first + stride) * CONTROL_PERIOD, np.nan)


def _phase(
    contact: Bool[np.ndarray, "T N"], at: Int[np.ndarray, " N"], old: Policy
) -> Float[np.ndarray, " N"]:
    """Time since the last touchdown of FL before `at` [stride]."""
    lands = contact & ~np.concatenate([contact[:1], contact[:-1]])
    steps = np.where(lands, np.arange(len(contact))[:, None], -1)
    last = np.maximum.accumulate(steps, axis=0)[at, np.arange(len(at))]
    stride = 1.0 / (old.info.stride_frequency * CONTROL_PERIOD)
    return ((at - last) / stride) % 1.0


PHASES = 10
"""Number of equal parts of the stride."""

COLUMNS: dict[str, type] = {
    "old": str,
    "new": str,
    "ground": str,
    "sensors": str,
    "seed": int,
    "switches": int,
    "successes": int,
    "low": float,
    "high": float,
    "fell": int,
    "settle_s": float,
    "settle_s_p95": float,
    "dip_m_s": float,
    "tilt_deg_p95": float,
    "worst_phase": str,
    "worst_phase_success": float,
}
"""Columns of the CSV file; `low` and `high` are the interval of the success rate (95 %)."""

TITLE = "Does a gait shift at a random phase succeed?"

_INTRODUCTION = """Policy and reward machine are swapped at a random phase of the old gait's
stride. A shift succeeds if the robot does not fall within 5 s and, from some stride on, the
contacts match the new gait in at least half of the steps of every stride. Settle time ends with
the first such stride. Dip is the largest drop of the mean speed of a stride below the slower of
the two commands. Intervals are 95 % Wilson intervals."""

HEAD = (
    "from",
    "to",
    "succeeded",
    "interval",
    "fell",
    "settled, 95 % within [s]",
    "dip [m/s]",
    "tilt, 95 % within [°]",
    "worst phase",
)
"""Head of the table of `row_cells`."""


def row_of(
    pair: Pair, ground: str, seed: int, outcomes: Outcomes, sensors: SensorConfig = PERFECT
) -> Row:
    """The results of the shifts of a pair, as a row."""
    n, good = len(outcomes.success), int(outcomes.success.sum())
    low, high = wilson(np.array([float(good)]), np.array([float(n)]))
    settled = outcomes.settle[outcomes.success]
    parts = np.minimum((outcomes.phase * PHASES).astype(int), PHASES - 1)
    shares = [
        float(outcomes.success[parts == part].mean()) if (parts == part).any() else 1.0
        for part in range(PHASES)
    ]
    worst = int(np.argmin(shares))
    return {
        "old": pair.old,
        "new": pair.new,
        "ground": ground,
        "sensors": sensors.name,
        "seed": seed,
        "switches": n,
        "successes": good,
        "low": round(float(low[0]), 5),
        "high": round(float(high[0]), 5),
        "fell": int(outcomes.fell.sum()),
        "settle_s": round(float(np.median(settled)), 2) if good else "",
        "settle_s_p95": round(float(np.quantile(settled, 0.95)), 2) if good else "",
        "dip_m_s": round(float(outcomes.dip.mean()), 3),
        "tilt_deg_p95": round(float(np.degrees(np.quantile(outcomes.tilt, 0.95))), 1),
        "worst_phase": f"{worst / PHASES:g} to {(worst + 1) / PHASES:g}",
        "worst_phase_success": round(shares[worst], 4),
    }


def page(rows: Sequence[Row], command: str) -> str:
    """The whole page; `command` made the last of the rows."""
    parts = [f"# {TITLE}", answer(rows), _INTRODUCTION]
    parts.append(f"Made by `{command}`. The same as an [interactive page](page.html).")
    for ground in dict.fromkeys(row["ground"] for row in rows):
        of = [row for row in rows if row["ground"] == ground]
        parts += [
            f"## {ground}",
            f"{succeeded(of)} shifts succeeded.",
            f"![Failed shifts on {ground}]({picture_of(ground)})",
            markdown(HEAD, [row_cells(row) for row in of]),
        ]
    return "\n\n".join(parts) + "\n"


def answer(rows: Sequence[Row]) -> str:
    """How many shifts succeeded on each ground, in one sentence."""
    grounds = dict.fromkeys(row["ground"] for row in rows)
    counts = ((ground, [row for row in rows if row["ground"] == ground]) for ground in grounds)
    parts = [f"on `{ground}` {succeeded(of)} shifts succeed" for ground, of in counts]
    text = ", and ".join(parts)
    return f"{text[0].upper()}{text[1:]}."


def succeeded(rows: Sequence[Row]) -> str:
    """Number of shifts that succeeded, of all, as text."""
    good, total = (sum(row[name] for row in rows) for name in ("successes", "switches"))
    return f"{good} of {total}"


def picture_of(ground: str) -> str:
    """File name of the map of a ground."""
    return f"{ground.replace(':', '-')}.png"


def row_cells(row: Row) -> tuple[str, ...]:
    """A row of the table of shifts as text."""
    return (
        row["old"],
        row["new"],
        f"{row['successes']} of {row['switches']}",
        f"{row['low']:.4f} to {row['high']:.4f}",
        str(row["fell"]),
        str(row["settle_s_p95"]),
        f"{row['dip_m_s']:.2f}",
        f"{row['tilt_deg_p95']:.0f}",
        f"{row['worst_phase']}: {row['worst_phase_success']:.3f}",
    )
