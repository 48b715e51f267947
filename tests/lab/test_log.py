"""Logs as files: they come back as they were; what no robot can have left is refused in a line."""

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from synthetic import TABLE, contacts, log_of

STEPS, ROBOTS = 50, 3
RECORDS = ("sensed", "truth")


def good():
    """A log of robots that trot, each foot at a height of its own."""
    contact = contacts(*TABLE["trot"], frequency=2.5, seconds=0.01 * STEPS, robots=ROBOTS)
    feet = np.random.default_rng(0).normal([0.0, 0.0, -0.5], 0.1, (STEPS, ROBOTS, 4, 3))
    return log_of(contact, foot_position_b=feet)


def arrays():
    """What the file of a good log holds."""
    log = good()
    values = {name: value for name, value in vars(log).items() if name not in RECORDS}
    for record in RECORDS:
        values |= {f"{record}.{name}": value for name, value in vars(getattr(log, record)).items()}
    values["format_version"] = 2
    return {name: np.asarray(value) for name, value in values.items() if value is not None}


def written(path, values):
    np.savez(path, **values)
    return path


def at(name, where, value):
    """Changes one number of an array."""

    def change(values):
        values[name][where] = value

    return change


def instead(name, value):
    return lambda values: values.__setitem__(name, value)


TIME = 0.01 * np.arange(1, STEPS + 1)


# There and back -----------------------------------------------------------------------------------


def test_a_log_comes_back_from_its_file_as_it_was_array_by_array(tmp_path):
    path = tmp_path / "log.npz"
    good().save(path)
    expected = arrays()
    with np.load(path) as file:
        assert set(file.files) == set(expected)
        for name, value in expected.items():
            assert np.array_equal(file[name], value), name
            assert file[name].dtype == value.dtype, name
    back = Log.load(path)
    back.save(tmp_path / "again.npz")
    with np.load(tmp_path / "again.npz") as again:
        assert all(np.array_equal(again[name], value) for name, value in expected.items())
    assert back.gaits == ("trot",)
    assert back.sensed.has_heading is True
    assert back.sensed.period == 0.01
    assert back.sensed.value is None, "nobody asked a critic"


def test_single_precision_stays_what_it_is(tmp_path):
    log = good()
    single = Log.stack([log[t].as_type(np.float32) for t in range(STEPS)])
    single.save(tmp_path / "log.npz")
    back = Log.load(tmp_path / "log.npz")
    assert back.sensed.foot_position_b.dtype == np.float32
    np.testing.assert_array_equal(back.sensed.foot_position_b, single.sensed.foot_position_b)
    np.testing.assert_allclose(back.time, TIME, rtol=1e-7)


def test_an_entry_some_entries_and_some_robots_are_cut_from_every_array():
    log = good()
    step, part, two = log[7], log[10:20], log.robots(np.array([2, 0]))
    assert float(step.sensed.time) == pytest.approx(0.08)
    np.testing.assert_array_equal(step.truth.base_position_w, log.truth.base_position_w[7])
    np.testing.assert_allclose(part.time, TIME[10:20])
    np.testing.assert_array_equal(part.sensed.contact, log.sensed.contact[10:20])
    np.testing.assert_array_equal(two.sensed.contact, log.sensed.contact[:, [2, 0]])
    np.testing.assert_allclose(two.time, TIME)
    assert (log.n, step.n, part.n, two.n) == (3, 3, 3, 2)
    np.testing.assert_array_equal(step.terrain_height, log.terrain_height)


def test_touch_heights_are_those_of_each_foots_last_step_on_the_ground():
    """The bodies are level: a foot is as high above the base as its z in the body frame says."""
    log = good()
    for robot in range(ROBOTS):
        for leg in range(4):
            last = np.nan
            for t in range(STEPS):
                if log.sensed.contact[t, robot, leg]:
                    last = log.sensed.foot_position_b[t, robot, leg, 2]
                assert log.touch_height[t, robot, leg] == pytest.approx(last, abs=1e-9, nan_ok=True)
    assert np.isnan(log.touch_height[0]).any()


def test_mujocos_positions_are_base_attitude_and_joints():
    log = good()
    np.testing.assert_array_equal(log.qpos[..., :3], log.truth.base_position_w)
    np.testing.assert_array_equal(log.qpos[..., 3:7], log.truth.base_quaternion_w)
    np.testing.assert_array_equal(log.qpos[..., 7:], log.sensed.joint_position)


# Other formats ------------------------------------------------------------------------------------


def refused(path):
    """The one line with which a file is refused."""
    with pytest.raises(GaitshiftError) as caught:
        Log.load(path)
    line = str(caught.value)
    assert str(path) in line
    assert "\n" not in line
    return line


def test_a_log_of_the_format_before_is_refused_with_what_to_do(tmp_path):
    old = {"time": TIME, "qpos": np.zeros((STEPS, ROBOTS, 19)), "gaits": np.array(["trot"])}
    line = refused(written(tmp_path / "log.npz", old))
    assert "gaitshift 0.1" in line
    assert "write it anew" in line


def test_a_log_of_a_later_format_is_refused_with_both_versions(tmp_path):
    line = refused(written(tmp_path / "log.npz", arrays() | {"format_version": np.array(3)}))
    assert "format 3" in line
    assert "reads format 2" in line


@pytest.mark.parametrize(
    "name", ["sensed.contact", "sensed.orientation", "truth.clearance", "fallen", "terrain_size"]
)
def test_an_array_that_is_missing_is_named(tmp_path, name):
    values = arrays()
    del values[name]
    assert f"lacks '{name}'" in refused(written(tmp_path / "log.npz", values))


def test_what_a_robot_need_not_have_may_be_missing(tmp_path):
    values = arrays()
    for name in ("joint_torque", "velocity_b", "stride_frequency_command"):
        del values[f"sensed.{name}"]
    log = Log.load(written(tmp_path / "log.npz", values))
    assert log.sensed.joint_torque is None
    with pytest.raises(GaitshiftError, match="'power' needs 'joint_torque'"):
        _ = log.sensed.power


# What no robot left -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            at("truth.base_position_w", (7, 2, 0), np.nan),
            "'truth.base_position_w' must be finite, got NaN or infinity at entry 7 of robot 2",
        ),
        (
            at("sensed.joint_velocity", (0, 1, 5), np.inf),
            "'sensed.joint_velocity' must be finite, got NaN or infinity at entry 0 of robot 1",
        ),
        (
            at("truth.foot_position_w", (3, 0, 2, 2), np.nan),
            "'truth.foot_position_w' must be finite, got NaN or infinity at entry 3 of robot 0",
        ),
        (at("terrain_height", (1, 1), np.nan), "'terrain_height' must be finite"),
        (
            at("sensed.time", 4, np.nan),
            "'sensed.time' must be finite, got NaN or infinity at entry 4",
        ),
        (
            at("truth.base_quaternion_w", (9, 1), 0.0),
            "'truth.base_quaternion_w' must have length 1, got 0 at entry 9 of robot 1",
        ),
        (
            at("sensed.orientation", (8, 0), 2.0),
            "'sensed.orientation' must have length 1, got 4 at entry 8 of robot 0",
        ),
        (
            instead("sensed.contact", np.ones((STEPS, ROBOTS, 3), dtype=bool)),
            "'sensed.contact' must have the shape (T, N, 4), got (50, 3, 3)",
        ),
        (
            instead("sensed.joint_torque", np.zeros((STEPS, 2, 12))),
            "'sensed.joint_torque' must have the shape (50, 3, 12), got (50, 2, 12)",
        ),
        (
            instead("sensed.time", TIME[:-1]),
            "'sensed.time' must have the shape (50,), got (49,)",
        ),
        (
            instead("sensed.value", np.zeros(STEPS)),
            "'sensed.value' must have the shape (50, 3), got (50,)",
        ),
        (instead("k", np.zeros((STEPS, 1))), "'k' must have the shape (50, 3), got (50, 1)"),
        (
            instead("sensed.contact", np.ones((STEPS, ROBOTS, 4))),
            "'sensed.contact' must hold true and false, got float64",
        ),
        (at("gait", (5, 0), 1), "'gait' must be 0 to 0, an index into 'gaits', got 0 to 1"),
        (instead("sensed.time", TIME[::-1]), "'sensed.time' must rise"),
        (
            at("sensed.time", 9, 0.09),
            "'sensed.time' must rise from entry to entry, got 0.09 s after 0.09 s at entry 9",
        ),
        (instead("sensed.time", np.zeros(STEPS)), "'sensed.time' must rise"),
        (
            instead("sensed.time", 1000 * TIME),
            "entries of 'sensed.time' must be 0.0005 to 0.5 s apart, got 10",
        ),
        (at("sensed.time", 49, 0.6), "equally spaced, got 0.01 s at first and 0.11 s at entry 49"),
        (
            instead("sensed.mass", np.array(-1.0)),
            "'mass' must be 0.1 to 1000 kg, got -1",
        ),
        (
            instead("sensed.period", np.array(0.02)),
            "'sensed.period' must be the time between two entries, 0.01 s, got 0.02",
        ),
        (instead("sensed.period", np.array([0.01, 0.01])), "'sensed.period' must be one value"),
        (instead("sensed.has_heading", np.array([])), "'sensed.has_heading' must be one value"),
    ],
)
def test_a_log_that_no_robot_left_is_named_with_its_array(tmp_path, change, message):
    values = arrays()
    change(values)
    assert message in refused(written(tmp_path / "log.npz", values))


@pytest.mark.parametrize(
    "name", [name for name, array in arrays().items() if array.ndim > 1 and array.dtype.kind == "f"]
)
def test_every_array_of_numbers_is_refused_in_another_shape_or_with_words(tmp_path, name):
    path = tmp_path / "log.npz"
    longer = np.zeros((*arrays()[name].shape, 2))
    words = np.full(arrays()[name].shape, "much")
    assert f"'{name}' must have the shape" in refused(written(path, arrays() | {name: longer}))
    assert f"'{name}' must hold numbers" in refused(written(path, arrays() | {name: words}))


@pytest.mark.parametrize("none_of", ["steps", "robots"])
def test_a_log_of_nothing_is_refused(tmp_path, none_of):
    apart = ("gaits", "robot", "terrain")
    values = {
        name: array
        if array.ndim == 0
        or name.startswith(apart)
        or (none_of == "robots" and name == "sensed.time")
        else (array[:0] if none_of == "steps" else array[:, :0])
        for name, array in arrays().items()
    }
    line = refused(written(tmp_path / "log.npz", values))
    assert "'sensed.contact' must not be empty" in line


def test_what_a_condition_or_critic_made_of_a_robot_that_lies_may_be_anything(tmp_path):
    values = arrays() | {"sensed.value": np.zeros((STEPS, ROBOTS))}
    for name in ("sensed.value", "k", "threshold"):
        values[name][:5] = np.nan
        values[name][-5:, 1] = np.inf
    values["fallen"][-5:, 1] = True
    values["a_note"] = np.array("of mine")
    values["sensed.time"] = np.arange(STEPS)  # whole numbers are numbers
    with pytest.raises(GaitshiftError, match="apart, got 1;"):
        Log.load(written(tmp_path / "log.npz", values))
    values["sensed.time"] = TIME.astype(np.float32)
    assert np.isnan(Log.load(written(tmp_path / "log.npz", values)).k[:5]).all()


def test_heights_of_feet_that_never_touched_are_unknown(tmp_path):
    values = arrays()
    values["sensed.contact"][:5] = False
    log = Log.load(written(tmp_path / "log.npz", values))
    assert np.isnan(log.touch_height[:5]).all()
    assert np.isfinite(log.touch_height[-1]).all()


def test_files_that_are_no_npz_are_named(tmp_path):
    path = tmp_path / "log.npz"
    path.touch()
    with pytest.raises(GaitshiftError, match=r"log\.npz is not a complete npz file"):
        Log.load(path)
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(GaitshiftError, match=r"log\.npz is not a complete npz file"):
        Log.load(path)
    written(path, arrays())
    whole = path.read_bytes()
    for size in (len(whole) // 2, len(whole) - 30):
        path.write_bytes(whole[:size])
        with pytest.raises(GaitshiftError, match=r"log\.npz is not a complete npz file"):
            Log.load(path)


def test_a_log_without_a_touch_is_shown_but_not_identified_by(tmp_path, capsys):
    """A robot that has just been let go touches nothing: that is no fault of its log."""
    nowhere = {"sensed.contact": np.zeros((STEPS, ROBOTS, 4), bool)}
    path = written(tmp_path / "log.npz", arrays() | nowhere)
    assert not Log.load(path).sensed.contact.any()
    with pytest.raises(SystemExit) as end:
        main(["identify", str(path), "--out", str(tmp_path / "report")])
    assert end.value.code == 2
    assert (
        f"{path}: 'contact' must be true where a foot is down"
        in capsys.readouterr().err.splitlines()[-1]
    )
