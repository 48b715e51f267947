"""A robot of one's own: from its file to a first step, and what a wrong file is told."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.log import Log
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig
from gaitshift.robot.legs import LEGS
from gaitshift.robot.robot_file import from_dict, read_robot, to_dict
from gaitshift.show.geometry import Shape
from gaitshift.sim.terrain import flat
from gaitshift.sim.world import World

PONY = Path(__file__).parents[2] / "examples" / "robots" / "pony.toml"


def changed(tmp_path, *changes, file="pony.toml"):
    """The pony with some words of one of its files replaced."""
    for name in ("pony.toml", "pony.xml"):
        text = (PONY.parent / name).read_text()
        for old, new in changes if name == file else ():
            assert old in text
            text = text.replace(old, new)
        (tmp_path / name).write_text(text)
    return tmp_path / "pony.toml"


def test_the_height_of_the_stance_is_that_of_two_links_and_a_foot():
    """Links of 0.2 m, the thigh 0.8 rad forward of the vertical, the shank 0.7 rad behind it."""
    robot = read_robot(PONY)
    height = 0.2 * np.cos(0.8) + 0.2 * np.cos(0.7) + 0.02
    assert robot.stance_height == pytest.approx(height, abs=1e-6)
    assert robot.gains_of("default").kp == 40.0


def test_joints_may_go_as_far_as_their_stops_and_without_stops_a_turn(tmp_path):
    assert read_robot(PONY).joint_range[2] == (-2.6, -0.5)
    free = changed(
        tmp_path,
        ('<joint axis="0 1 0" range="-2.6 -0.5"/>', '<joint axis="0 1 0"/>'),
        file="pony.xml",
    )
    ranges = read_robot(free).joint_range
    assert ranges[1] == (-1.0, 2.6)
    assert ranges[2] == pytest.approx((-2 * np.pi, 2 * np.pi))
    assert from_dict(json.loads(json.dumps(to_dict(read_robot(free))))).joint_range == ranges


def test_it_stands_and_bears_its_weight_on_four_feet():
    robot = read_robot(PONY)
    world = World(robot, flat(10.0, 10.0), 2)
    for _ in range(200):
        world.step(np.tile(robot.stance_angles, (2, 1)))
    sensed, truth = world.sensed, world.truth
    weight = 9.81 * world.model.body_mass.sum()
    assert sensed.contact.all()
    assert not truth.body_contact.any()
    assert truth.foot_force.sum(axis=1) == pytest.approx(np.full(2, weight), rel=0.02)
    assert world.model.body_mass.sum() == robot.mass == pytest.approx(12.5, abs=0.1)


def test_turned_about_by_its_mirror_it_is_itself():
    """Left is right: the same fall from mirrored joints, as training's augmentation asks."""
    robot = read_robot(PONY)
    world = World(robot, flat(10.0, 10.0), 2)
    swung = robot.stance_angles.reshape(4, 3) + [[0.1, 0.1, 0.0], [0.0, 0.0, 0.1]] * 2
    mirrored = swung[[1, 0, 3, 2]] * [-1.0, 1.0, 1.0]
    target = np.stack([swung.ravel(), mirrored.ravel()])
    for _ in range(30):
        _, truth = world.step(target)
    feet = truth.foot_position_w
    np.testing.assert_allclose(feet[1][[1, 0, 3, 2]] * [1.0, -1.0, 1.0], feet[0], atol=2e-3)


def test_it_trains_is_told_apart_and_goes_on(tmp_path, capsys):
    robot = read_robot(PONY)
    recipe = replace(
        Recipe(), robots=4, steps=8, checkpoint_every=2, ppo=PpoConfig(epochs=1, mini_batches=1)
    ).with_iterations(4)
    config = RunConfig(
        machine=gaits.load("trot"), recipe=recipe, seed=1, command="test", robot=robot
    )
    run = Run.create(tmp_path / "run", config)
    path = run.train(lambda row: None)
    with pytest.raises(
        GaitshiftError,
        match="of the robot 'pony', not of 'anymal_b'; give its file as --robot-file",
    ):
        policy.load(path)
    (tmp_path / "run" / "checkpoints" / "000004.pt").unlink()
    again = Run.resume(tmp_path / "run")
    assert again.learner.env.robot == robot
    again.train()
    with (tmp_path / "run" / "progress.csv").open() as file:
        assert [int(row["iteration"]) for row in csv.DictReader(file)] == [1, 2, 3, 4]
    log = tmp_path / "walk.npz"
    given = ["--robot-file", str(PONY), "--episodes", "2", "--seconds", "4"]
    main(["evaluate", str(path), *given, "--log", str(log), "--json"])
    assert json.loads(capsys.readouterr().out)["gait"] == "trot"
    assert Log.load(log).robot == "pony"
    assert Log.load(log).sensed.mass == pytest.approx(12.5, abs=0.1)
    main(["report", str(log), "--robot-file", str(PONY)])
    assert "<td>pony</td>" in (tmp_path / "walk.html").read_text()


def test_all_of_it_is_drawn():
    bodies = Shape(read_robot(PONY)).bodies
    assert len(bodies) == 1 + 4 * 3
    assert bodies[0].mesh.bounds == pytest.approx(
        np.array([[-0.133, -0.07, -0.05]] * 2) * [[1], [-1]]
    )


def test_a_run_whose_model_is_gone_says_so(tmp_path):
    robot = read_robot(changed(tmp_path))
    kept = json.loads(json.dumps(to_dict(robot)))
    assert from_dict(kept) == robot
    robot.model_file.unlink()
    with pytest.raises(GaitshiftError, match="robot 'pony': no model file"):
        from_dict(kept)


@pytest.mark.parametrize(
    ("file", "old", "new", "says"),
    [
        ("pony.toml", 'name = "pony"', 'name = "anymal_b"', "got 'anymal_b'"),
        ("pony.toml", 'name = "pony"', "nam = 1", "unknown key 'nam'; did you mean 'name'?"),
        (
            "pony.toml",
            "foot_radius = 0.02 ",
            "foot_radius = 0 ",
            "foot_radius must be 0.001 to 1, got 0",
        ),
        ("pony.toml", "    0.0, 0.8, -1.5,\n]", "]", "'stance' must be 12 angles"),
        (
            "pony.toml",
            "0.8, -1.5,\n]",
            "0.8, -2.5,\n]",
            "stance must put the feet at one height, got heights 18 cm",
        ),
        (
            "pony.toml",
            "kp = 40.0",
            "kp = 0.0",
            "gains.default: kp must be above 0 and kd 0 or more, both at most 100000, got 0",
        ),
        (
            "pony.toml",
            "torque_limit = 33.5 ",
            "torque_limit = -1 ",
            "motor: torque_limit must be 0.01 to 10000, got -1",
        ),
        (
            "pony.toml",
            "torque_limit = 33.5 ",
            "torque_limit = 33.5\nstall_torque = 20 ",
            "motor: stall_torque must be at least torque_limit (33.5 N·m), got 20",
        ),
        ("pony.toml", "no_load_speed", "velocity_limit", "motor: unknown key 'velocity_limit'"),
        ("pony.toml", "[motor]", "effort_limit = 33.5\n[motor]", "unknown key 'effort_limit'"),
        ("pony.toml", "[gains.default]", "[gains.soft]", "must have a preset 'default'"),
        ("pony.toml", "pony.xml", "horse.xml", "horse.xml: no such file"),
        ("pony.xml", "</mujoco>", "", "the model must be XML: no element found: line 126"),
        ("pony.xml", '<freejoint name="base"/>', "", "first joint must be the free joint"),
        ("pony.xml", '"FL_HFE"', '"LF_HFE"', "number 2 must be FL_HFE, got LF_HFE"),
        (
            "pony.xml",
            '<touch name="body_touch" site="body"/>',
            "",
            "number 13 must be body_touch, got nothing",
        ),
        ("pony.xml", 'timestep="0.0025"', 'timestep="0.003"', "timestep must divide 0.01 s"),
        ("pony.xml", 'rgba="0.16 0.2 0.26 1"', 'group="3"', "base must have a geom in group 0"),
        ("pony.xml", 'conaffinity="1"', 'conaffinity="2"', "site FL_foot on a body"),
    ],
)
def test_a_wrong_file_is_told_what_would_be_right(file, old, new, says, tmp_path, capsys):
    path = changed(tmp_path, (old, new), file=file)
    with pytest.raises(SystemExit) as end:
        main(["train", "trot", "--robot-file", str(path), "--out", str(tmp_path / "run")])
    assert end.value.code == 2
    line = capsys.readouterr().err.splitlines()[-1]
    assert line.startswith(f"gaitshift: {path}: ")
    assert says in line
    assert not (tmp_path / "run").exists()


def test_actuators_in_another_order_are_refused(tmp_path):
    lines = [f'    <general name="{leg}_KFE" joint="{leg}_KFE"/>\n' for leg in LEGS[:2]]
    path = changed(tmp_path, (lines[0], lines[1][:4] + "<!-- -->\n"), file="pony.xml")
    with pytest.raises(GaitshiftError, match="number 3 must be FL_KFE, got FR_HAA"):
        read_robot(path)
