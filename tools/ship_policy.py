"""Ships a trained policy: the network, its curve and its figures go into the package.

Usage: python tools/ship_policy.py [--trials all|short|quick|none] RUN|GAIT...
       python tools/ship_policy.py --deployable RUN...

A gait by its name is one that is shipped already: its figures are made anew, with "none" those of
its commands alone. `make policies` trains and ships all. With --deployable a policy for real
sensors goes into policies/deployable; `tools/deployable_evidence.py` makes its figures.
"""

import argparse
import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import onnx
from gait_results import PAGE, page

from gaitshift import table
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation import SIZES, follow_commands, run_trials
from gaitshift.learn.presets import PRESETS
from gaitshift.learn.run_config import RunConfig
from gaitshift.show.plots import hildebrand_diagram, training_curves

POLICIES = Path(policy.__file__).parent / "policies"
CURVES = Path(__file__).parent.parent / "docs" / "results" / "training"
DIAGRAMS = Path(__file__).parent.parent / "docs" / "results" / "gaits"
COLUMNS = ("iteration", "stage", "steps", "wall_s", "reward", "speed", "survival", "changes_per_s")
EVERY = 10


def ship(run: Path, trials: str) -> None:
    """Copies the policy of `run`, thins its curve, and puts it through the standard trials."""
    loaded = policy.load(run / "policy.onnx")
    name = loaded.gait
    evaluation = judged(loaded, trials)
    shutil.copyfile(run / "policy.onnx", POLICIES / f"{name}.onnx")
    write_record(name, {**loaded.info.training, "evaluation": evaluation})
    rows = [row for row in table.read(run / "progress.csv") if int(row["iteration"]) % EVERY == 0]
    table.write(
        POLICIES / f"{name}.csv", [{column: row[column] for column in COLUMNS} for row in rows]
    )
    CURVES.mkdir(parents=True, exist_ok=True)
    training_curves(run / "progress.csv", CURVES / f"{name}.png")


def ship_deployable(run: Path) -> None:
    """Copies the policy of `run` and its record, which names no folder of this machine.

    Raises:
        GaitshiftError: no preset has the recipe of the run now.
    """
    folder = POLICIES / "deployable"
    loaded = policy.load(run / "policy.onnx")
    config = RunConfig.read(run)
    threads = {
        "threads": config.recipe.threads,
        "physics_threads": config.recipe.physics_threads,
    }
    same = [name for name in PRESETS if config.recipe == replace(PRESETS[name](), **threads)]
    if not same:
        raise GaitshiftError(f"{run} has another recipe than the presets")
    (preset,) = same
    command = f"gaitshift train {loaded.gait} --preset {preset} --seed {config.seed} --threads 1"
    training = {**loaded.info.training, "command": command}
    model = onnx.load(run / "policy.onnx")
    for entry in model.metadata_props:
        if entry.key == "gaitshift.training":
            entry.value = json.dumps(training)
    folder.mkdir(exist_ok=True)
    onnx.save(model, folder / f"{loaded.gait}.onnx")
    text = json.dumps({**training, "preset": preset}, indent=1) + "\n"
    (folder / f"{loaded.gait}.json").write_text(text, encoding="utf-8")


def judge_again(name: str, trials: str) -> None:
    """Puts a shipped policy through the standard trials, or lets it follow commands alone."""
    loaded = policy.load(name)
    if trials == "none":
        record = json.loads(policy.record_file(name).read_text(encoding="utf-8"))
        record["evaluation"]["commands"] = [asdict(row) for row in follow_commands(loaded)]
        write_record(name, record)
        return
    write_record(name, {**loaded.info.training, "evaluation": judged(loaded, trials)})


def judged(loaded: policy.Policy, trials: str) -> dict[str, Any]:
    """What comes of the standard trials and of commands; draws the diagram of its contacts."""
    rows, figures, log = run_trials(loaded, SIZES[trials])
    print(loaded.gait, json.dumps([row.to_dict() for row in rows]))
    DIAGRAMS.mkdir(parents=True, exist_ok=True)
    hildebrand_diagram(log, figures, loaded.machine, DIAGRAMS / f"{loaded.gait}.png")
    return {
        "command": f"gaitshift evaluate {loaded.gait} --trials {trials}",
        "trials": [row.to_dict() for row in rows],
        "commands": [asdict(row) for row in follow_commands(loaded)],
        "flat": figures,
    }


def write_record(name: str, record: dict[str, Any]) -> None:
    """Writes down where a shipped policy comes from and what it does."""
    (POLICIES / f"{name}.json").write_text(
        json.dumps(_rounded(record), indent=1) + "\n", encoding="utf-8"
    )


def _rounded(value: object) -> object:
    if isinstance(value, dict):
        return {key: _rounded(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_rounded(item) for item in value]
    return round(value, 4) if isinstance(value, float) else value


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", choices=(*SIZES, "none"), default="all")
    parser.add_argument("--deployable", action="store_true")
    parser.add_argument("runs", nargs="+", metavar="RUN|GAIT")
    options = parser.parse_args()
    for run in options.runs:
        if options.deployable:
            ship_deployable(Path(run))
        elif run in policy.shipped():
            judge_again(run, options.trials)
        elif options.trials == "none":
            parser.error(f"--trials none is for shipped gaits, got '{run}'")
        else:
            ship(Path(run), options.trials)
    if not options.deployable:
        PAGE.write_text(page(), encoding="utf-8")
