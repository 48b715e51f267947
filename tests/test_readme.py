"""What the README says in code is run, and what it says of the gaits is what was measured."""

import json
import re
from pathlib import Path

import pytest

from gaitshift.control import policy

README = Path(__file__).parent.parent / "README.md"


def test_the_readmes_code_runs_and_its_condition_counts_nothing_on_level_feet():
    (block,) = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), re.DOTALL)
    names = {}
    exec(block, names)
    assert names["state"].k.tolist() == [0.0]
    assert names["fire"].tolist() == [False]


def record(gait):
    return json.loads((policy.load(gait).path.with_suffix(".json")).read_text())["evaluation"]


@pytest.mark.parametrize("gait", policy.shipped())
def test_the_table_of_gaits_tells_what_the_records_of_the_policies_tell(gait):
    text, flat = README.read_text(encoding="utf-8"), record(gait)["flat"]
    (row,) = re.findall(rf"^\| {gait.replace('_', '-')} \| (.*) \|$", text, re.MULTILINE)
    named, speed, cycles, pattern, touchdowns, cost = row.split(" | ")
    assert named == f"{gait.replace('_', '-')}, clean"
    assert flat["verdict"]["gait"] == gait
    assert flat["verdict"]["clean"]
    told = [speed.removesuffix(" m/s"), cycles.removesuffix(" Hz"), pattern, cost]
    measured = [flat[n] for n in ("speed_mean", "cycles_per_s", "pattern_fraction")]
    measured += [flat["cost_of_transport"], *flat["touchdowns_per_cycle"]]
    assert [float(word) for word in (*told, *touchdowns.split())] == pytest.approx(
        measured, abs=0.0051
    )


def test_the_gaits_that_the_readme_says_went_through_all_trials_are_those_that_did():
    text = " ".join(README.read_text(encoding="utf-8").split())
    (names,) = re.findall(r"by their contacts \((.*?) `gaitshift evaluate GAIT --trials all`", text)
    thorough = {gait for gait in policy.shipped() if record(gait)["command"].endswith(" all")}
    assert set(re.split(", | and ", names.replace("-", "_"))) == thorough
