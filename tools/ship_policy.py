"""Ships a trained policy: the network, its curve and its figures go into the package.

Usage: python tools/ship_policy.py [--trials all|short|quick] RUN...     (`make policies` trains and
ships all)
"""

import argparse
import csv
import json
import shutil
from dataclasses import asdict
from pathlib import Path

from gait_results import PAGE, page

from gaitshift import policy
from gaitshift.evaluation import SIZES, follow_commands, run_trials
from gaitshift.plots import hildebrand_diagram, training_curves

POLICIES = Path(policy.__file__).parent / "policies"
CURVES = Path(__file__).parent.parent / "docs" / "results" / "training"
DIAGRAMS = Path(__file__).parent.parent / "docs" / "results" / "gaits"
COLUMNS = ("iteration", "stage", "steps", "wall_s", "reward", "speed", "survival", "changes_per_s")
EVERY = 10


def ship(run: Path, trials: str) -> None:
    """Copies the policy of `run`, thins its curve, and puts it through the standard trials."""
    loaded = policy.load(run / "policy.onnx")
    name = loaded.gait
    rows, figures, log = run_trials(loaded, SIZES[trials])
    print(name, json.dumps([row.to_dict() for row in rows]))
    DIAGRAMS.mkdir(parents=True, exist_ok=True)
    hildebrand_diagram(log, figures, loaded.machine, DIAGRAMS / f"{name}.png")
    shutil.copyfile(run / "policy.onnx", POLICIES / f"{name}.onnx")
    record = {
        **loaded.info.training,
        "evaluation": {
            "command": f"gaitshift evaluate {name} --trials {trials}",
            "trials": [row.to_dict() for row in rows],
            "commands": [asdict(row) for row in follow_commands(loaded)],
            "flat": figures,
        },
    }
    (POLICIES / f"{name}.json").write_text(json.dumps(_rounded(record), indent=1) + "\n")
    with (run / "progress.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if int(row["iteration"]) % EVERY == 0]
    with (POLICIES / f"{name}.csv").open("w", newline="") as file:
        lines = csv.DictWriter(file, COLUMNS, extrasaction="ignore", lineterminator="\n")
        lines.writeheader()
        lines.writerows(rows)
    CURVES.mkdir(parents=True, exist_ok=True)
    training_curves(run / "progress.csv", CURVES / f"{name}.png")


def _rounded(value: object) -> object:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return round(value, 4) if isinstance(value, float) else value


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", choices=tuple(SIZES), default="all")
    parser.add_argument("runs", nargs="+", type=Path)
    options = parser.parse_args()
    for folder in options.runs:
        ship(folder, options.trials)
    PAGE.write_text(page())
