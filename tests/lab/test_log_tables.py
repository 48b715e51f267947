"""Logs of other robots: what a CSV or Parquet file becomes, and what is said of a faulty one."""

import csv

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from gaitshift import table
from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification import log_files, passages
from gaitshift.robot.legs import JOINTS, LEGS

FEET = np.array(
    [[0.34, 0.21, -0.5], [0.35, -0.22, -0.5], [-0.33, 0.23, -0.5], [-0.36, -0.24, -0.5]]
)
ROWS = 60
ROLL, PITCH = 0.2, -0.1


def columns():
    """A robot that slides forward at 1 m/s over feet that stand: rough in rows 20 to 39."""
    at = np.arange(ROWS)
    data = {"time": 5.0 + 0.01 * at, "roll": np.full(ROWS, ROLL), "pitch": np.full(ROWS, PITCH)}
    heading = np.array([np.cos(PITCH), 0.0, np.sin(PITCH)])  # level and forward, in the body frame
    for leg, name in enumerate(LEGS):
        data[f"contact_{name}"] = np.full(ROWS, 1)
        for axis in range(3):
            data[f"foot_{name}_{'xyz'[axis]}"] = FEET[leg, axis] - 0.01 * at * heading[axis]
    data["rough"] = ((at >= 20) & (at < 40)).astype(int)
    data["velocity_x"], data["velocity_y"], data["velocity_z"] = 100.0 + at, 0.0 * at, 0.0 * at
    data["value"] = 10.0 + at
    data["temperature"] = [f"{t} degrees" for t in at]
    return data


def written(folder, data, ending="csv"):
    path = folder / f"walk.{ending}"
    if ending == "parquet":
        pq.write_table(pa.table(data), path)
        return path
    with path.open("w", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(data)
        rows.writerows(zip(*data.values(), strict=True))
    return path


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("batch", [7, 20, 1000])  # rows, or hundreds of bytes
def test_a_table_becomes_passages_of_smooth_ground_and_the_rough_behind_it(
    tmp_path, monkeypatch, ending, batch
):
    monkeypatch.setattr(table, "BATCH", batch)
    monkeypatch.setattr(table, "BLOCK", 300 * batch)
    read = list(passages(written(tmp_path, columns(), ending)))
    assert [len(one.time) for one in read] == [40, 20]
    assert read[0].rough[:, 0].tolist() == [False] * 20 + [True] * 20
    assert not read[1].rough.any()
    speed = np.concatenate([one.sensed.forward_speed[:, 0] for one in read])
    np.testing.assert_allclose(speed, 100.0 + np.arange(ROWS))
    value = np.concatenate([one.sensed.value[:, 0] for one in read])
    np.testing.assert_allclose(value, 10.0 + np.arange(ROWS))
    assert not read[0].sensed.has_heading
    assert read[0].sensed.joint_torque is None
    assert read[0].period == pytest.approx(0.01)


def test_heading_joints_and_commands_are_read_from_columns_of_their_names(tmp_path):
    """Power is the sum of |torque · velocity| of the joints: 2 N·m at 0 to 11 rad/s."""
    data, joints = columns(), [f"{leg}_{joint}" for leg in LEGS for joint in JOINTS]
    for index, joint in enumerate(joints):
        data[f"joint_torque_{joint}"] = np.full(ROWS, -2.0)
        data[f"joint_velocity_{joint}"] = np.full(ROWS, float(index))
    data["yaw"], data["mass"] = 0.01 * np.arange(ROWS), np.full(ROWS, 12.5)
    data["speed_command"], data["stride_frequency"] = np.full(ROWS, 0.8), np.full(ROWS, 2.5)
    (first, _) = passages(written(tmp_path, data))
    np.testing.assert_allclose(first.sensed.power, 2.0 * sum(range(12)))
    np.testing.assert_allclose(first.sensed.joint_velocity[3, 0], np.arange(12.0))
    assert first.sensed.mass == 12.5
    assert first.sensed.has_heading
    np.testing.assert_allclose(first.sensed.yaw[:, 0], data["yaw"][:40], atol=1e-9)
    assert (first.sensed.forward_speed_command == 0.8).all()
    assert (first.sensed.stride_frequency_command == 2.5).all()


def test_roll_and_pitch_are_the_direction_of_gravity(tmp_path):
    """Nose down by 0.1 rad and rolled to the right by 0.2: seen by turning the axes in turn."""
    (first, _) = passages(written(tmp_path, columns()))
    (cr, sr), (cp, sp) = [(np.cos(a), np.sin(a)) for a in (ROLL, PITCH)]
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    expected = np.array([0.0, 0.0, -1.0]) @ about_y @ about_x
    np.testing.assert_allclose(first.sensed.gravity_b[7, 0], expected)


def test_gravity_may_be_given_at_any_length(tmp_path):
    data = columns()
    del data["roll"], data["pitch"]
    for axis, value in zip("xyz", (0.0, 3.0, -4.0), strict=True):
        data[f"gravity_{axis}"] = np.full(ROWS, 9.81 / 5 * value)
    (first, _) = passages(written(tmp_path, data))
    np.testing.assert_allclose(first.sensed.gravity_b[3, 0], [0.0, 0.6, -0.8], atol=1e-9)


def test_the_way_is_that_of_leg_odometry(tmp_path):
    (first, _) = passages(written(tmp_path, columns()))
    assert first.distance[-1, 0] == pytest.approx(0.39, abs=0.02)


def test_a_stretch_that_is_too_long_is_cut(tmp_path, monkeypatch):
    monkeypatch.setattr(log_files, "LONGEST", 15)
    lengths = [len(one.time) for one in passages(written(tmp_path, columns()))]
    assert lengths == [15, 15, 10, 15, 5]


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@pytest.mark.parametrize("batch", [7, 20, 1000])
def test_for_the_way_to_flat_ground_a_table_is_cut_where_rough_ground_begins(
    tmp_path, monkeypatch, ending, batch
):
    monkeypatch.setattr(table, "BATCH", batch)
    monkeypatch.setattr(table, "BLOCK", 300 * batch)
    read = list(passages(written(tmp_path, columns(), ending), "flat"))
    assert [len(one.time) for one in read] == [20, 40]
    assert not read[0].rough.any()
    assert read[1].rough[:, 0].tolist() == [True] * 20 + [False] * 20


def test_a_single_row_at_a_border_is_no_passage(tmp_path):
    data = columns()
    data["rough"][:20] = np.arange(20) == 0
    lengths = [len(one.time) for one in passages(written(tmp_path, data))]
    assert lengths == [39, 20], "rough in the first row alone"


def test_whole_numbers_are_numbers(tmp_path):
    """Nanoseconds since 1970 pass 2^53, and are no seconds: that is what is said of them."""
    data = columns() | {"value": 2**60 + np.arange(ROWS)}
    (first, _) = passages(written(tmp_path, data, "parquet"))
    assert first.sensed.value[0, 0] == 2.0**60
    data["time"] = 1_700_000_000_000_000_000 + 10_000_000 * np.arange(ROWS)
    with pytest.raises(GaitshiftError, match=r"apart in 'time', got 1e\+07; the unit is seconds"):
        list(passages(written(tmp_path, data, "parquet")))


def test_contacts_and_labels_may_be_true_and_false(tmp_path):
    data = columns()
    for name in (*log_files.CONTACTS, "rough"):
        data[name] = [str(bool(value)).lower() for value in data[name]]
    (plain, _), (words, _) = (passages(written(tmp_path, d)) for d in (columns(), data))
    np.testing.assert_array_equal(words.sensed.contact, plain.sensed.contact)
    np.testing.assert_array_equal(words.rough, plain.rough)


def test_a_parquet_column_of_words_is_named(tmp_path):
    data = columns() | {"value": [f"{t} points" for t in range(ROWS)]}
    with pytest.raises(GaitshiftError, match="column 'value' must hold numbers"):
        list(passages(written(tmp_path, data, "parquet")))


def test_what_stands_in_other_columns_does_not_matter(tmp_path):
    data = columns()
    del data["temperature"]
    (plain, _), (other, _) = (passages(written(tmp_path, d)) for d in (data, columns()))
    np.testing.assert_array_equal(plain.sensed.foot_position_b, other.sensed.foot_position_b)


def without(name):
    return lambda data: data.pop(name)


def at_row(name, row, value):
    def change(data):
        data[name] = [*data[name][:row], value, *data[name][row + 1 :]]

    return change


def gravity(*vector, until=ROWS):
    """Gravity instead of the angles: this vector, and (0, 0, -1) from a row on."""

    def change(data):
        del data["roll"], data["pitch"]
        for axis, value, level in zip("xyz", vector, (0.0, 0.0, -1.0), strict=True):
            data[f"gravity_{axis}"] = np.where(np.arange(ROWS) < until, value, level)

    return change


def all_of(names, value):
    def change(data):
        for name in names:
            data[name] = np.full(ROWS, value)

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (without("contact_BL"), "lacks the column 'contact_BL'; a table needs time, rough"),
        (without("rough"), "lacks the column 'rough'"),
        (
            without("pitch"),
            "lacks the attitude; a table needs gravity_x, _y, _z, or roll and pitch",
        ),
        (at_row("foot_FR_y", 33, np.nan), "row 34, 'foot_FR_y' must be a finite number"),
        (at_row("value", 5, "much"), "cannot be read as csv"),
        (at_row("time", 30, 5.29), "row 31, 'time' must rise"),
        (at_row("time", 30, 5.1), "row 31, 'time' must rise"),
        (
            at_row("time", 59, 5.7),
            "equally spaced in 'time', got 0.01 s at first and 0.12 s before row 60",
        ),
        (all_of([f"contact_{leg}" for leg in LEGS], 0), "contact columns must be 1"),
        (gravity(0.0, 0.0, 0.0, until=2), "row 1, gravity_x, _y, _z must be a direction"),
        (gravity(0.3, 0.1, 9.7), "gravity_x, gravity_y, gravity_z must point gravity down"),
        (all_of(["roll"], 3.1), "roll, pitch must point gravity down"),
        (all_of(["mass"], 12_500.0), "'mass' must be 0.1 to 1000 kg, got 1.25e+04"),
        (lambda data: data.update(time=10 * np.arange(ROWS)), "apart in 'time', got 10;"),
        (
            lambda data: data.update(time=1e-5 * np.arange(ROWS)),
            "rows must be 0.0005 to 0.5 s apart",
        ),
    ],
)
def test_a_faulty_table_is_named_with_its_row_or_column(tmp_path, change, message):
    data = columns()
    change(data)
    path = written(tmp_path, data)
    with pytest.raises(GaitshiftError) as caught:
        list(passages(path))
    line = str(caught.value)
    assert str(path) in line
    assert message in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("empty.csv", b"", "cannot be read as csv"),
        (
            "head.csv",
            ("time," + ",".join(log_files.REQUIRED[1:]) + ",roll,pitch\n").encode(),
            "must have two rows or more, .*got 0",
        ),
        ("noise.parquet", b"\x00\x01 this is none", "cannot be read as parquet"),
    ],
)
def test_a_file_that_is_none_is_named(tmp_path, name, content, message):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(GaitshiftError, match=message):
        list(passages(path))


def test_a_table_of_one_row_is_refused(tmp_path):
    data = {name: values[:1] for name, values in columns().items()}
    with pytest.raises(GaitshiftError, match=r"walk\.csv: must have two rows or more, .*got 1"):
        list(passages(written(tmp_path, data)))


def test_a_table_in_another_encoding_is_named(tmp_path):
    path = written(tmp_path, columns() | {"größe": np.arange(ROWS)})
    path.write_bytes(path.read_text(encoding="utf-8").encode("latin-1"))
    with pytest.raises(GaitshiftError, match=r"walk\.csv must be in UTF-8") as caught:
        list(passages(path))
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_opened_is_named(tmp_path, monkeypatch):
    def refused(*args, **options):
        raise PermissionError("not for you")

    path = written(tmp_path, columns())
    monkeypatch.setattr("pyarrow.csv.open_csv", refused)
    with pytest.raises(GaitshiftError, match=r"walk\.csv cannot be read as csv: not for you"):
        list(passages(path))


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(GaitshiftError, match=r"no log file .*away\.csv"):
        list(passages(tmp_path / "away.csv"))
