"""The page of a training: what its files hold, and nothing that they do not."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from test_report import unpacked

from gaitshift.cli import main
from gaitshift.gait import gaits
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig

ITERATIONS = 4


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A training that learns nothing, with checkpoints at 0, 2 and 4, and a verdict at each."""
    recipe = replace(
        Recipe(), robots=4, steps=8, checkpoint_every=2, ppo=PpoConfig(epochs=1, mini_batches=1)
    ).with_iterations(ITERATIONS)
    folder = tmp_path_factory.mktemp("training") / "run"
    machine = gaits.load("trot")
    config = RunConfig(machine=machine, recipe=recipe, seed=3, command="train <trot>")
    training = Run.create(folder, config)
    training.train(judge=lambda path: {"gait": "none", "speed_mean": 0.25})
    return folder


@pytest.fixture(scope="module")
def page(run):
    main(["report", str(run)])
    return (run / "report.html").read_text()


def scripts(page, mark):
    return [json.loads(part.split("</script>")[0]) for part in page.split(mark)[1:]]


def test_the_course_is_that_of_the_progress_file(run, page):
    (course,) = scripts(page, 'id="progress">')
    rows = list(csv.DictReader((run / "progress.csv").read_text().splitlines()))
    assert course["axis"] == "iteration"
    assert unpacked(course["time"]).tolist() == [1, 2, 3, 4]
    stages = [row["stage"] for row in rows]
    assert course["shifts"] == [float(i + 1) for i in range(3) if stages[i] != stages[i + 1]]
    for chart in course["rows"]:
        assert "[" in chart["title"], "a unit"
        (one,) = chart["series"]
        factor = 100.0 if one["name"] == "survival" else 1.0
        expected = [factor * float(row[one["name"]]) for row in rows]
        np.testing.assert_allclose(unpacked(one["values"]), expected, rtol=1e-5)


def test_walks_of_the_checkpoints_and_of_the_end_are_there_to_choose_from(page):
    walks = scripts(page, "data-walk>")
    assert len(walks) == 2
    assert page.index(">at the end</option>") < page.index(">iteration 2</option>")
    assert "iteration 0<" not in page, "nothing was learned there"
    first, last = (unpacked(walk["position"]) for walk in walks)
    assert len(first) != len(last) or (first != last).any(), "policies of their own"


def test_verdicts_and_the_command_are_told(page):
    told = page.split("Verdicts at checkpoints")[1].split("</table>")[0]
    assert told.count("<td>none</td>") == 2
    assert told.count("<td>0.25</td>") == 2
    assert "train &lt;trot&gt;" in page
    assert "<h1>Training of Trot</h1>" in page


def test_the_run_is_as_it_was(run, page):
    assert Run.resume(run).iteration == ITERATIONS


@pytest.mark.parametrize(
    ("file", "content", "message"),
    [
        ("policy.onnx", None, "without policy.onnx"),
        ("progress.csv", None, "progress.csv cannot be read"),
        ("progress.csv", "a,b\n1,2\n3,4\n", "it lacks 'iteration'"),
        ("config.json", "{", "config.json"),
    ],
)
def test_a_damaged_run_is_named(run, tmp_path, capsys, file, content, message):
    folder = tmp_path / "run"
    folder.mkdir()
    for path in run.iterdir():
        if path.is_file():
            (folder / path.name).write_bytes(path.read_bytes())
    (folder / "report.html").unlink(missing_ok=True)
    if content is None:
        (folder / file).unlink()
    else:
        (folder / file).write_text(content)
    with pytest.raises(SystemExit) as end:
        main(["report", str(folder)])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert not Path(folder / "report.html").exists()
