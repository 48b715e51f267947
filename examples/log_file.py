"""A shift condition on a log of your own robot: where it would have shifted.

Writes a small CSV log as any robot could keep it, and replays a condition over it, step by step.
`gaitshift identify walk.csv --out report` then finds the numbers for you.

Usage: python examples/log_file.py [FILE.csv]
"""

import csv
import sys
from pathlib import Path

import numpy as np

from gaitshift.lab.identification import passages
from gaitshift.robot.legs import LEGS
from gaitshift.shift import load_graph, tuned


def write_example(path: Path) -> None:
    """Ten seconds of a robot that trots; after five the ground is uneven by 8 cm."""
    rng = np.random.default_rng(0)
    time = 0.01 * np.arange(1, 1001)
    rough = time > 5.0
    columns = {"time": time, "rough": rough.astype(int), "roll": 0.0 * time, "pitch": 0.0 * time}
    for leg, name in enumerate(LEGS):
        phase = (2.0 * time + (0.5 if leg in (1, 2) else 0.0)) % 1.0
        stride = np.cumsum(np.diff(phase, prepend=1.0) < 0.0)
        ground = 0.08 * rng.random(stride[-1] + 1)[stride] * rough
        columns[f"contact_{name}"] = (phase < 0.5).astype(int)
        sweep = 0.3 * np.abs(2.0 * phase - 1.0) - 0.15  # back while it stands, forth in the air
        columns[f"foot_{name}_x"] = (0.35 if leg < 2 else -0.35) + sweep
        columns[f"foot_{name}_y"] = (0.2 if leg % 2 == 0 else -0.2) + 0.0 * time
        columns[f"foot_{name}_z"] = -0.5 + np.where(phase < 0.5, ground, 0.1)
    with path.open("w", newline="", encoding="utf-8") as file:
        rows = csv.writer(file)
        rows.writerow(columns)
        rows.writerows(zip(*(values.round(4).tolist() for values in columns.values()), strict=True))


def main(path: Path) -> None:
    """Says where the condition fires."""
    graph = tuned(load_graph("height_difference"), beta=100.0)
    for passage in passages(path):
        state, fired = graph.begin(1), None
        for sensed in passage:
            state, decision = graph.step(state, sensed)
            if decision.fired[0] and fired is None:
                fired = sensed.time
        begins = passage.time[passage.rough[:, 0].argmax()] if passage.rough.any() else None
        print(f"{passage.name}: rough from {begins} s, shift at {fired} s")


if __name__ == "__main__":
    given = Path(sys.argv[1]) if len(sys.argv) > 1 else Path("walk.csv")
    if len(sys.argv) < 2:
        write_example(given)
    main(given)
