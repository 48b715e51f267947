"""Runs of a reproduction: trained once, broken down or broken off, and the command."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
import torch
from rsl_rl.algorithms import PPO

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.reproduction.learning_curve import LearningCurve
from gaitshift.lab.reproduction.plan import ABLATIONS, Plan
from gaitshift.lab.reproduction.results import Results
from gaitshift.lab.reproduction.training import FAILED, is_over, train, train_all
from gaitshift.learn.learner import DivergedError
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig
from waiting import PATIENCE, wait_until


def tiny_jobs(*names):
    return [job for job in Plan.tiny().jobs if job.setting.name in names]


def test_a_run_of_other_numbers_is_not_taken_for_this_one(tmp_path):
    (job,) = tiny_jobs("blind")
    train(job, tmp_path)
    assert is_over(job, tmp_path)
    other = replace(job, recipe=replace(job.recipe, robots=7))
    with pytest.raises(GaitshiftError, match="with another recipe; give another --runs"):
        is_over(other, tmp_path)
    with pytest.raises(GaitshiftError, match="with another seed"):
        is_over(replace(job, seed=1), tmp_path)


def spoil_update(monkeypatch, iteration, spoil):
    """Lets `spoil` meet the learner before the update of an iteration, counted from 1."""
    update, count = PPO.update, iter(range(1, 100))

    def spoiled(self):
        if next(count) == iteration:
            spoil(self)
        return update(self)

    monkeypatch.setattr(PPO, "update", spoiled)


def no_number(part):
    """Makes one of the actor's parameters, or what was seen, not a number."""

    def spoil(ppo):
        with torch.no_grad():
            if part == "returns":
                ppo.storage.returns[0, 0] = torch.nan
            else:
                dict(ppo.actor.named_parameters())[part].flatten()[0] = torch.nan

    return spoil


@pytest.mark.parametrize("part", ["mlp.0.weight", "distribution.std_param", "returns"])
def test_a_run_that_breaks_down_in_its_numbers_is_a_finding(part, tmp_path, monkeypatch):
    (job,) = tiny_jobs("multiply")
    spoil_update(monkeypatch, 2, no_number(part))
    train(job, tmp_path / job.name)
    assert is_over(job, tmp_path / job.name)
    text = (tmp_path / job.name / FAILED).read_text()
    assert text.startswith("training diverged: ")
    assert text.count("\n") == 1
    results = Results.read(Plan.tiny(), tmp_path)
    assert results.seeds["multiply", "trot"].broken == (True,)
    assert len(results.seeds["multiply", "trot"].curves[0]) == 1
    assert results.seeds["multiply", "trot"].walking == 0


def test_weights_that_are_no_numbers_are_told_before_anybody_acts_on_them(tmp_path):
    (job,) = tiny_jobs("multiply")
    config = RunConfig(machine=job.machine, recipe=job.recipe, seed=0, command="test")
    run = Run.create(tmp_path / "run", config)
    with torch.no_grad():
        run.learner.ppo.actor.mlp[0].weight[3, 1] = torch.nan
    with pytest.raises(DivergedError, match="training diverged: an action is not a number"):
        run.iterate()
    with torch.no_grad():
        run.learner.ppo.actor.distribution.std_param[2] = torch.nan
    with pytest.raises(
        DivergedError, match=r"training diverged: distribution\.std_param of the actor"
    ):
        run.iterate()


@pytest.mark.parametrize(
    "error", [OSError(28, "No space left on device"), RuntimeError("not enough memory")]
)
def test_what_else_ends_a_run_is_raised_and_the_same_call_goes_on(error, tmp_path, monkeypatch):
    (job,) = tiny_jobs("multiply")

    def spoil(ppo):
        raise error

    with monkeypatch.context() as context:
        spoil_update(context, 3, spoil)
        with pytest.raises(type(error)):
            train(job, tmp_path / job.name)
    assert not (tmp_path / job.name / FAILED).exists()
    assert not is_over(job, tmp_path / job.name)
    train(job, tmp_path / job.name)
    assert is_over(job, tmp_path / job.name)
    assert len(LearningCurve.read(tmp_path / job.name / "progress.csv")) == job.recipe.iterations


def test_nothing_is_done_twice(tmp_path):
    (job,) = tiny_jobs("gains", "paper-gains")
    train(job, tmp_path / job.name)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*") if path.is_file()}
    train_all([job], tmp_path, 2)
    assert {path: path.stat().st_mtime_ns for path in before} == before


def living(group):
    """Processes of a group that are not over."""
    table = subprocess.run(["ps", "-eo", "pgid=,stat="], capture_output=True, text=True, check=True)
    rows = [line.split() for line in table.stdout.splitlines()]
    return [stat for pgid, stat in rows if int(pgid) == group and not stat.startswith("Z")]


@pytest.mark.slow
def test_quick_from_ctrl_c_to_the_report(tmp_path, capsys):
    """Interrupted at its first run: one line, 130, no process left; then it goes on to the end."""
    runs, out = tmp_path / "runs", tmp_path / "results"
    arguments = ["reproduce", "--quick", "--runs", str(runs), "--out", str(out)]
    process = subprocess.Popen(
        [sys.executable, "-m", "gaitshift", *arguments, "--jobs", "1"],
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    wait_until(lambda: any(runs.glob("*/policy.onnx")) or process.poll() is not None, pause=0.02)
    assert process.poll() is None, process.stderr.read()
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does: to every process of the command
    said = process.communicate(timeout=PATIENCE)[1]
    assert process.returncode == 130
    assert said.strip() == "gaitshift: interrupted"
    wait_until(lambda: not living(process.pid))
    assert not out.exists()
    first = {path: path.stat().st_mtime_ns for path in runs.glob("*/policy.onnx")}
    assert 1 <= len(first) < len(Plan.tiny().jobs)

    main([*arguments, "--json"])
    told = json.loads(capsys.readouterr().out)
    assert {path: path.stat().st_mtime_ns for path in first} == first, "done once is done"
    assert {path.name for path in out.iterdir()} == set(told["files"])
    assert {"README.md", "reward.png", "ablations.png", "contacts-pace.png"} <= set(told["files"])
    assert len(told["findings"]) == 10
    assert [row["setting"] for row in told["ablations"]] == ["paper", *(s.name for s in ABLATIONS)]
    assert all(f["measured"] in (out / "README.md").read_text() for f in told["findings"])
    for job in Plan.tiny().jobs:
        with (runs / job.name / "progress.csv").open(newline="") as file:
            iterations = [int(row["iteration"]) for row in csv.DictReader(file)]
        assert iterations == list(range(1, job.recipe.iterations + 1))

    # Folders that are gone, and one run that the report does not tell of.
    for job in Plan.tiny().jobs:
        shutil.rmtree(runs / job.name)
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    lines = (out / "runs.csv").read_text().splitlines(keepends=True)
    (out / "runs.csv").write_text("".join(line for line in lines if "curriculum" not in line))
    main([*arguments, "--add", "--json"])
    assert json.loads(capsys.readouterr().out) == told
    assert [path.name for path in runs.iterdir()] == ["curriculum-trot-0"]
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--only", "canter"], "got 'canter'"),
        (["--jobs", "0"], "jobs must be 1 to 1024, got 0"),
        (["--seed", "-1"], "seed must be 0 or larger, got -1"),
        (["--out", "file"], "must be a folder, got the file file"),
        (["--out", "file/x/y"], "must be a folder, got the file file"),
        (["--runs", "file/x"], "must be a folder, got the file file"),
    ],
)
def test_a_fault_of_the_user_is_one_line(arguments, says, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("file").touch()
    with pytest.raises(SystemExit) as end:
        main(["reproduce", *arguments])
    assert end.value.code == 2
    assert says in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_without_torch_one_line_says_what_is_missing():
    program = """
import sys
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] == "torch":
            raise ModuleNotFoundError("No module named 'torch'", name="torch")
sys.meta_path.insert(0, Missing())
from gaitshift.cli import main
main(["reproduce", "--quick"])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.strip() == (
        "gaitshift: training needs the package 'torch'; install gaitshift[train]"
    )
