"""Logs as files: what is no log, or one that no robot can have left, is refused in one line."""

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from synthetic import TABLE, contacts, log_of

STEPS, ROBOTS = 50, 3


def arrays():
    """What the file of a good log holds."""
    log = log_of(contacts(*TABLE["trot"], frequency=2.5, seconds=0.01 * STEPS, robots=ROBOTS))
    return {name: np.asarray(value) for name, value in vars(log).items() if value is not None}


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


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            at("qpos", (7, 2, 0), np.nan),
            "'qpos' must be finite, got NaN or infinity at entry 7 of robot 2",
        ),
        (
            at("qvel", (0, 1, 5), np.inf),
            "'qvel' must be finite, got NaN or infinity at entry 0 of robot 1",
        ),
        (at("foot_position_w", (3, 0, 2, 2), np.nan), "'foot_position_w' must be finite"),
        (at("terrain_height", (1, 1), np.nan), "'terrain_height' must be finite"),
        (at("time", 4, np.nan), "'time' must be finite, got NaN or infinity at entry 4"),
        (at("qpos", (9, 1, slice(3, 7)), 0.0), "length 1, got 0 at entry 9 of robot 1"),
        (
            instead("contact", np.ones((STEPS, ROBOTS, 3), dtype=bool)),
            "'contact' must have the shape (50, 3, 4), got (50, 3, 3)",
        ),
        (instead("torque", np.zeros((STEPS, 2, 12))), "(50, 3, 12), got (50, 2, 12)"),
        (instead("time", TIME[:-1]), "'time' must have the shape (50,), got (49,)"),
        (instead("value", np.zeros(STEPS)), "'value' must have the shape (50, 3), got (50,)"),
        (
            instead("contact", np.ones((STEPS, ROBOTS, 4))),
            "'contact' must hold true and false, got float64",
        ),
        (at("gait", (5, 0), 1), "'gait' must be 0 to 0, an index into 'gaits', got 0 to 1"),
        (instead("time", TIME[::-1]), "'time' must rise"),
        (
            at("time", 9, 0.09),
            "'time' must rise from entry to entry, got 0.09 s after 0.09 s at entry 9",
        ),
        (instead("time", np.zeros(STEPS)), "'time' must rise"),
        (instead("time", 1000 * TIME), "entries of 'time' must be 0.0005 to 0.5 s apart, got 10"),
        (at("time", 49, 0.6), "equally spaced, got 0.01 s at first and 0.11 s at entry 49"),
    ],
)
def test_a_log_that_no_robot_left_is_named_with_its_array(tmp_path, change, message):
    values = arrays()
    change(values)
    path = written(tmp_path / "log.npz", values)
    with pytest.raises(GaitshiftError) as caught:
        Log.load(path)
    line = str(caught.value)
    assert str(path) in line
    assert message in line
    assert "\n" not in line


@pytest.mark.parametrize("none_of", ["steps", "robots"])
def test_a_log_of_nothing_is_refused(tmp_path, none_of):
    of_steps = {name for name in arrays() if not name.startswith(("gaits", "robot", "terrain"))}
    values = {
        name: array
        if name not in of_steps or (none_of == "robots" and name == "time")
        else (array[:0] if none_of == "steps" else array[:, :0])
        for name, array in arrays().items()
    }
    with pytest.raises(GaitshiftError, match="'qpos' must not be empty"):
        Log.load(written(tmp_path / "log.npz", values))


def test_heights_of_feet_that_never_touched_may_be_unknown(tmp_path):
    values = arrays()
    for name in ("foot_height", "clearance", "k", "threshold"):
        values[name][:5] = np.nan
        values[name][-5:, 1] = np.inf
    values["fallen"][-5:, 1] = True
    values["a_note"] = np.array("of mine")
    values["time"] = np.arange(STEPS)  # whole numbers are numbers
    with pytest.raises(GaitshiftError, match="apart, got 1;"):
        Log.load(written(tmp_path / "log.npz", values))
    values["time"] = TIME.astype(np.float32)
    assert np.isnan(Log.load(written(tmp_path / "log.npz", values)).foot_height[:5]).all()


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
    path = written(tmp_path / "log.npz", arrays() | {"contact": np.zeros((STEPS, ROBOTS, 4), bool)})
    assert not Log.load(path).contact.any()
    with pytest.raises(SystemExit) as end:
        main(["identify", str(path), "--out", str(tmp_path / "report")])
    assert end.value.code == 2
    assert (
        f"{path}: 'contact' must be true where a foot is down"
        in capsys.readouterr().err.splitlines()[-1]
    )
