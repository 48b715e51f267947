"""Measures speed and memory, and writes docs/results/speed.md.

Usage: python tools/speed_evidence.py [--before CHECKOUT]

All figures are ratios from one run, or medians; nothing else should run on the machine. With the
checkout of an earlier version, an iteration of training is also compared with that version's.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Any

from gaitshift import table
from gaitshift.lab.benchmark.peers import OURS
from gaitshift.lab.benchmark.step import step_times
from gaitshift.learn.progress import read

RESULTS = Path(__file__).parent.parent / "docs" / "results"
GAITSHIFT = (sys.executable, "-m", "gaitshift")
TURNS = 3
"""Turns in which two versions, or two commands, are measured alternately."""
TRAINED = (128, 1024, 2048)
"""Numbers of robots whose training memory is measured."""

PAGE = """# How fast is it?

{answer}

The figures of a table come from one run of `python tools/speed_evidence.py` on {cores} cores.

## The environment beside bare physics

Bare physics is MuJoCo's own batch with the same model and the same joint targets (`gaitshift bench
speed --robots N --terrain GROUND`, seven turns, medians).

{environment}

## Growth

The same on flat ground with more robots and more threads (`gaitshift bench growth`).

{growth}

## Beside other vector environments

The same robot, the same targets, in turns (`gaitshift bench peers --robots 32`).
`mujoco.rollout` computes the motion alone: no observation, no reward, no reset. MJX is left out: it
needs the package `mujoco`, which writes into the folder of `mujoco-core`, on which this project
depends.

{peers}

## Training

{training}

## Memory

{memory}

## The start

{start}
"""


def as_text(rows: list[table.Row]) -> str:
    """Rows as a Markdown table."""
    return table.markdown(tuple(rows[0]), [tuple(map(str, row.values())) for row in rows])


def bench(what: str, *options: str) -> Any:
    """What `gaitshift bench` measures."""
    words = [*GAITSHIFT, "bench", what, *options, "--json"]
    done = subprocess.run(words, capture_output=True, text=True, encoding="utf-8", check=True)
    return json.loads(done.stdout)


def environment() -> list[table.Row]:
    """The environment over bare physics, on flat ground and on height fields."""
    rows: list[table.Row] = []
    for ground in ("flat", "perlin:0.10", "stairs:0.05"):
        found = bench("speed", "--terrain", ground)
        rows.append({"ground": ground, "robots": 128, "env over bare": f"{_ratio(found):.2f}"})
    return rows


def _ratio(found: dict[str, float]) -> float:
    return found["env_over_bare"]


def grown() -> list[table.Row]:
    """Steps per second with more robots and threads, over those of 128 robots."""
    found = bench("growth")
    usual = found["128 robots"]["env_steps_per_s"]
    return [
        {
            "case": case,
            "steps/s over 128 robots": f"{figures['env_steps_per_s'] / usual:.2f}",
            "env over bare": f"{_ratio(figures):.2f}",
        }
        for case, figures in found.items()
    ]


def beside() -> list[table.Row]:
    """The environment over each of its peers."""
    found = bench("peers", "--robots", "32")
    ours = found[OURS]
    return [
        {"peer": name, "gaitshift over it": f"{ours / rate:.2f}"}
        for name, rate in found.items()
        if name != OURS
    ]


def iteration_ms(source: Path | None) -> float:
    """Median time of an iteration of the default recipe [ms], by this or another checkout."""
    environment = dict(os.environ)
    if source is not None:
        environment["PYTHONPATH"] = str(source / "src")
    with tempfile.TemporaryDirectory() as place:
        words = ["train", "trot", "--iterations", "40", "--out", f"{place}/run"]
        subprocess.run(
            [*GAITSHIFT, *words],
            env=environment,
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=True,
        )
        wall = [float(row["wall_s"]) for row in read(Path(place) / "run" / "progress.csv")]
    return 1e3 * median(b - a for a, b in pairwise(wall))


def watched() -> float:
    """Time of 60 iterations with `--watch` over that without it, the median of the turns."""
    return median(_seconds(True) / _seconds(False) for _ in range(TURNS))


def _seconds(is_watched: bool) -> float:
    with tempfile.TemporaryDirectory() as place:
        words = ["train", "trot", "--iterations", "60", "--out", f"{place}/run"]
        watch = ["--watch", "--port", "8123"] if is_watched else []
        process = subprocess.Popen(
            [*GAITSHIFT, *words, *watch], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        process.wait()
        return float(read(Path(place) / "run" / "progress.csv")[-1]["wall_s"])


def training(before: Path | None) -> list[table.Row]:
    """An iteration over that of other recipes and versions."""
    found = bench("speed")
    rows: list[table.Row] = [
        {
            "what": "an iteration over one of the preset `three-stage`",
            "ratio": f"{found['iteration_over_three_stage']:.2f}",
        }
    ]
    if before is not None:
        turns = [(iteration_ms(None), iteration_ms(before)) for _ in range(TURNS)]
        ratio = median(now / then for now, then in turns)
        version = subprocess.run(
            ["git", "-C", str(before), "rev-parse", "--short", "HEAD"],
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=True,
        ).stdout.strip()
        rows.append(
            {"what": f"an iteration over one of version {version}", "ratio": f"{ratio:.2f}"}
        )
    rows.append(
        {"what": "training with `--watch` over training without", "ratio": f"{watched():.2f}"}
    )
    return rows


def memory() -> list[table.Row]:
    """Peak memory of trainings."""
    rows: list[table.Row] = []
    for robots in TRAINED:
        with tempfile.TemporaryDirectory() as place:
            words = ["train", "trot", "--robots", str(robots), "--iterations", "2"]
            peak = _measured([*words, "--out", f"{place}/run"])
        rows.append({"what": f"training with {robots} robots", "peak": f"{peak:.2f} GB"})
    return rows


def _measured(words: list[str]) -> float:
    """Peak memory of a command [GB]."""
    code = (
        "import resource, subprocess, sys; subprocess.run(sys.argv[1:], check=True, "
        "stdout=subprocess.DEVNULL); print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *GAITSHIFT, *words],
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    if done.returncode:
        raise SystemExit(f"{' '.join(words)} failed:\n{done.stderr}")
    return int(done.stdout.split()[-1]) / 1e6


def start() -> list[table.Row]:
    """Time to the first output of commands, medians of seven."""
    rows: list[table.Row] = []
    for words in (("gaits",), ("--help",)):
        seconds: list[float] = []
        for _ in range(7):
            begin = time.perf_counter()
            subprocess.run([*GAITSHIFT, *words], stdout=subprocess.DEVNULL, check=True)
            seconds.append(time.perf_counter() - begin)
        rows.append({"what": f"`gaitshift {words[0]}`", "seconds": f"{median(seconds):.2f}"})
    steps: list[float] = []
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "examples/runtime.py"],
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=True,
        )
        steps.append(float(done.stdout.rsplit(": ", 1)[1].split(" ms")[0]) / 1e3)
    rows.append({"what": "a step of `examples/runtime.py`", "seconds": f"{median(steps):.5f}"})
    step = step_times()["control_step"] / 1e3
    rows.append({"what": "a control step of `gaitshift deploy`", "seconds": f"{step:.5f}"})
    return rows


def main() -> None:
    """Measures everything, and writes the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path)
    asked = parser.parse_args()
    parts: dict[str, list[table.Row]] = {}
    for name, measure in (
        ("environment", environment),
        ("growth", grown),
        ("peers", beside),
        ("training", lambda: training(asked.before)),
        ("memory", memory),
        ("start", start),
    ):
        parts[name] = measure()
        print(as_text(parts[name]), flush=True)
    flat = parts["environment"][0]["env over bare"]
    answer = (
        f"`env.step` runs at {flat} of the speed of bare physics (128 robots, flat ground), and "
        f"an iteration of training takes {parts['training'][-2]['ratio']} of the time of "
        f"{parts['training'][-2]['what'].split(' over ')[1].replace('one', 'an iteration', 1)}."
    )
    text = PAGE.format(
        answer=answer,
        cores=os.cpu_count(),
        **{name: as_text(rows) for name, rows in parts.items()},
    )
    (RESULTS / "speed.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
