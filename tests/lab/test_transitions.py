"""Shifts: what is measured of them on logs made by hand, and the command end to end."""

import csv
import json

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.studies import Pair, run_pair
from gaitshift.lab.studies.transitions import COLUMNS, measure_shifts, running_mean
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.show.plots.studies import transition_map
from gaitshift.table import read_typed
from synthetic import changed

TROT, BOUND = policy.load("trot"), policy.load("bound")


@pytest.fixture(scope="module")
def walk():
    """A log of two robots that trot for 8 s."""
    config = DemoConfig(gaits=("trot", "bound"), at=(7.9,), episodes=2, every=0.2)
    return run_demo(config)[0]


def shifted(log, at=200, **changes):
    """Outcomes where functions of copies replace arrays: `contact`, or any of the log or truth."""
    arrays = {"contact": log.sensed.contact, **vars(log.truth), **vars(log)}
    log = changed(log, **{name: change(arrays[name].copy()) for name, change in changes.items()})
    return measure_shifts(log, np.full(2, at), TROT, BOUND)


def test_a_gait_is_reached_when_the_first_stride_that_shows_it_for_good_is_over(walk):
    """Shown from 1 s after the shift on by robot 0, never by robot 1."""
    stride = round(1.0 / (BOUND.info.stride_frequency * CONTROL_PERIOD))

    def shown(stance):
        stance[:] = False
        stance[301:, 0] = True
        return stance

    outcomes = shifted(walk, stance_shown=shown)
    # Half of a stride's steps are enough: it is over half a stride after the second.
    assert outcomes.settle[0] == pytest.approx(1.0 + stride / 2 * CONTROL_PERIOD, abs=0.011)
    assert np.isnan(outcomes.settle[1])
    assert outcomes.success.tolist() == [True, False]


def test_a_gait_that_is_lost_again_is_not_reached(walk):
    def shown(stance):
        stance[:] = True
        stance[650:, 0] = False
        return stance

    assert np.isnan(shifted(walk, stance_shown=shown).settle[0])
    assert shifted(walk, stance_shown=np.ones_like).settle[0] == pytest.approx(
        round(1.0 / (BOUND.info.stride_frequency * CONTROL_PERIOD)) * CONTROL_PERIOD
    )


def test_a_fall_within_five_seconds_is_a_failure_and_one_after_is_not(walk):
    def falls(at):
        def change(fallen):
            fallen[at:, 0] = True
            return fallen

        return shifted(walk, stance_shown=np.ones_like, fallen=change).success[0]

    assert not falls(201)
    assert not falls(699)
    assert falls(702)


def test_tilt_and_dip_are_those_of_the_motion(walk):
    roll = 0.4

    def lies(quaternion):
        quaternion[:] = [1.0, 0.0, 0.0, 0.0]
        quaternion[300] = [np.cos(roll / 2), np.sin(roll / 2), 0.0, 0.0]
        return quaternion

    def slows(velocity):
        velocity[..., :2] = [1.0, 0.0]
        velocity[400:460, 0, 0] = 0.3
        return velocity

    outcomes = shifted(walk, base_quaternion_w=lies, velocity_b=slows)
    assert outcomes.tilt == pytest.approx(roll, abs=1e-3)
    slower = min(TROT.info.forward_speed, BOUND.info.forward_speed)
    assert outcomes.dip == pytest.approx([slower - 0.3, slower - 1.0])


def test_the_phase_is_the_part_of_a_stride_since_the_front_left_foot_came_down(walk):
    def lands(contact):
        contact[..., 0] = False
        contact[190:200, 0, 0] = True
        contact[170:180, 1, 0] = True
        return contact

    stride = 1.0 / (TROT.info.stride_frequency * CONTROL_PERIOD)
    assert shifted(walk, contact=lands).phase == pytest.approx([10 / stride, 30 / stride])


def test_running_means_are_numpys():
    values = np.random.default_rng(0).normal(size=(50, 3))
    for window in (1, 7, 50):
        expected = np.stack(
            [np.convolve(values[:, i], np.ones(window) / window, "valid") for i in range(3)], axis=1
        )
        np.testing.assert_allclose(running_mean(values, window), expected, atol=1e-12)


def test_robots_shift_at_all_phases_and_come_into_the_new_gait():
    outcomes = run_pair(
        {"trot": TROT, "bound": BOUND}, Pair("trot", "bound"), ground="flat", switches=24, seed=3
    )
    assert outcomes.success.all()
    assert np.ptp(outcomes.phase) > 0.6
    assert (outcomes.settle < 3.0).all()
    assert (outcomes.tilt < 0.6).all()


def test_the_command_goes_on_where_it_was_broken_off(tmp_path, capsys):
    out = tmp_path / "shifts"
    command = ["transitions", "trot", "pace", "--switches", "8", "--grounds", "flat"]
    command += ["--out", str(out), "--json"]
    main(command)
    rows = json.loads(capsys.readouterr().out)["transitions"]
    assert [(row["old"], row["new"]) for row in rows] == [("trot", "pace"), ("pace", "trot")]
    assert (out / "flat.png").stat().st_size < 300_000
    assert "of 16 shifts succeeded" in (out / "README.md").read_text()
    table = out / "transitions.csv"
    whole = table.read_text()
    table.write_text("".join(whole.splitlines(keepends=True)[:2]))  # killed after the first pair
    main(command)
    said = capsys.readouterr()
    assert "trot to pace on flat exists" in said.err
    assert "pace to trot" not in said.err
    assert table.read_text() == whole
    with pytest.raises(SystemExit) as end:  # or the totals would be of two measurements
        main([part if part != "8" else "9" for part in command])
    assert end.value.code == 2
    said = capsys.readouterr().err.splitlines()[-1]
    assert f"switches must be 8 to add to {table}, got 9" in said
    assert table.read_text() == whole


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["trot"], "two gaits"),
        (["trot", "canter"], "canter"),
        (["trot", "pace", "--switches", "0"], "switches must be 1 to 1000000, got 0"),
        (["trot", "trot"], "two gaits"),
        (["trot", "pace", "--grounds", "flat", "lava"], "lava"),
    ],
)
def test_bad_input_is_one_line_and_code_2(tmp_path, capsys, arguments, message):
    with pytest.raises(SystemExit) as end:
        main(["transitions", *arguments, "--out", str(tmp_path / "out")])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


def test_a_table_that_is_none_is_refused(tmp_path, capsys):
    table = tmp_path / "transitions.csv"
    table.write_text("a,b\n1,2\n")
    with pytest.raises(SystemExit) as end:
        main(["transitions", "trot", "pace", "--out", str(tmp_path)])
    assert end.value.code == 2
    assert "is not a table of shifts" in capsys.readouterr().err


def test_the_map_shades_failures_and_counts_them(tmp_path):
    common = {"ground": "flat", "switches": 100}
    rows = [
        common | {"old": "trot", "new": "bound", "successes": 90},
        common | {"old": "bound", "new": "trot", "successes": 100},
    ]
    figure = transition_map(rows, tmp_path / "map.png")
    axes = figure.axes[0]
    assert sorted(text.get_text() for text in axes.texts) == ["0", "10"]
    shades = axes.images[0].get_array()
    assert shades[0, 1] == pytest.approx(0.1)
    assert np.isnan(np.ma.filled(shades, np.nan)[0, 0])


def test_read_typed_gives_what_was_written(tmp_path):
    assert read_typed(tmp_path / "none.csv", COLUMNS, "shifts") == []
    path = tmp_path / "transitions.csv"
    with path.open("w", newline="") as file:
        lines = csv.writer(file)
        lines.writerow(COLUMNS)
        lines.writerow(
            ["a", "b", "flat", "cheap", 0, 8, 0, 0.0, 0.3, 8, "", "", 0.4, 80.0, "0 to 0.1", 0.0]
        )
    (row,) = read_typed(path, COLUMNS, "shifts")
    assert row["switches"] == 8
    assert row["settle_s"] == ""
