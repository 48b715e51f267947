"""The command `bench`: what it refuses, and its other measurements."""

import json
import sys
from functools import partial

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.gait import gaits
from gaitshift.lab.benchmark import peers, speed
from gaitshift.lab.benchmark.step import step_times
from gaitshift.sim.env import GaitEnv
from gaitshift.sim.terrain import flat

TROT = gaits.load("trot")


def refusal(capsys, *arguments):
    """The one line with which the command refuses."""
    with pytest.raises(SystemExit) as exit_:
        main(["bench", *arguments])
    said = capsys.readouterr()
    assert (exit_.value.code, said.out) == (2, "")
    (line,) = said.err.strip().splitlines()
    return line


def test_without_the_baselines_library_one_line_says_so(capsys, monkeypatch):
    for module in ("baseline", "vec_env"):
        monkeypatch.delitem(sys.modules, f"gaitshift.lab.benchmark.{module}", raising=False)
    loaded = [name for name in sys.modules if name.startswith("stable_baselines3.")]
    for module in ("stable_baselines3", *loaded):
        monkeypatch.setitem(sys.modules, module, None)
    line = refusal(capsys, "time-to-gait", "--quick")
    assert "stable_baselines3" in line
    assert "--baseline-budget" in line


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["time-to-gait", "--seeds", "0"], "seeds must be 1 to 100, got 0"),
        (["time-to-gait", "--first-seed", "-1"], "first_seed must be 0 or larger, got -1"),
        (["time-to-gait", "--gaits", "trott"], "trott"),
        (["time-to-gait", "--gaits"], "gaits must name at least one gait"),
        (
            ["time-to-gait", "--baseline-budget", "-1"],
            "baseline_budget must be 0 to 86400 s, got -1.0",
        ),
        (["time-to-walk"], "time-to-gait"),
        (["--seed", "-1"], "seed must be 0 or larger, got -1"),
    ],
)
def test_what_cannot_be_measured_is_refused(arguments, says, capsys):
    assert says in refusal(capsys, *arguments)


def test_an_output_folder_with_other_content_is_left_alone(capsys, tmp_path):
    (tmp_path / "thesis.tex").write_text("years of work")
    line = refusal(capsys, "time-to-gait", "--quick", "--out", str(tmp_path))
    assert "--overwrite" in line
    assert [file.name for file in tmp_path.iterdir()] == ["thesis.tex"]


def test_the_plain_bench_measures_the_speed_and_does_without_torch(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "torch", None)
    main(["bench", "--robots", "3", "--steps", "2", "--json"])
    said = capsys.readouterr()
    figures = json.loads(said.out)
    assert set(figures) == {"bare_steps_per_s", "env_steps_per_s", "env_over_bare"}
    assert figures["bare_steps_per_s"] > figures["env_steps_per_s"] > 0
    assert "'torch' is missing" in said.err


def test_the_help_tells_the_measurements_apart(capsys):
    with pytest.raises(SystemExit):
        main(["bench", "--help"])
    told = capsys.readouterr().out
    words = (
        "{speed,growth,peers,time-to-gait,page,step,replay}",
        "--baseline-budget",
        "--robots",
        "--page-seconds",
    )
    assert all(word in told for word in words)


def test_the_replay_is_measured_with_and_without_a_leak(capsys, monkeypatch):
    monkeypatch.setattr(speed, "EPISODES", 3)
    main(["bench", "replay", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["no_leak_s", "leak_s"]
    assert all(0.0 < seconds < 60.0 for seconds in found.values())


def test_the_step_of_one_robot_takes_longer_than_its_parts(capsys, monkeypatch):
    monkeypatch.setattr("gaitshift.cli.bench.step_times", partial(step_times, 50))
    main(["bench", "step", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["control_step", "physics", "estimator", "policy", "condition"]
    for part in ("estimator", "policy", "condition"):
        assert 0.0 < found[part] < found["control_step"]


def test_a_table_of_trainings_with_a_wrong_cell_is_named(capsys, tmp_path):
    table = tmp_path / "time_to_gait.csv"
    header = "gait,learner,seed,reached,seconds,steps,survival,speed,pattern_fraction,recipe"
    table.write_text(f"{header}\ntrot,gaitshift,0,True,10.0,100,1.0,1.2,0.7,0123456789ab\n")
    table.write_text(table.read_text().replace("True", "yes"))
    line = refusal(capsys, "time-to-gait", "--quick", "--out", str(tmp_path))
    assert str(table) in line
    assert "must be True or False, got 'yes'" in line


def test_growth_is_measured_over_robots_and_threads(capsys, monkeypatch):
    monkeypatch.setattr(speed, "GROWTH", (2, 5))
    main(["bench", "growth", "--robots", "3", "--steps", "2", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert {"2 robots", "5 robots", "1 threads"} <= set(found)
    assert all(rate > 0 for one in found.values() for rate in one.values())


def test_a_peer_moves_as_our_physics_does():
    """All are given the same joint targets, so that what they are timed at is the same work."""
    env = GaitEnv(TROT, flat(20.0, 20.0), 2)
    env.reset(seed=0)
    targets = np.random.default_rng(0).normal(env.robot.stance_angles, 0.1, (5, 2, 12))
    robots = [make() for make in peers.makers(env)]
    for robot in robots:
        robot.reset()
    for target in targets:
        env.world.step(target)
        seen = [robot.step(one)[0] for robot, one in zip(robots, target, strict=True)]
    np.testing.assert_allclose(seen, np.hstack(env.world.state()), atol=1e-9)


@pytest.mark.slow
def test_peers_are_measured_beside_ours(capsys):
    main(["bench", "peers", "--robots", "2", "--steps", "2", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["gaitshift", *peers.PEERS]
    assert min(found.values()) > 0
