"""Figures show what is in the log: bars, lines, marks, units."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex, to_rgb
from PIL import Image

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.robot.legs import LEGS
from gaitshift.show.plots import contact_diagram, demo_figure, gait_colours, training_curves
from gaitshift.show.plots.signals import smoothed
from gaitshift.show.plots.style import INK, LEG_COLOURS
from gaitshift.sim.terrain import from_spec
from synthetic import changed, log_of, turned

STANCES = {
    "FL": [(0.0, 0.3), (0.5, 0.8), (1.0, 1.9)],
    "FR": [(0.2, 0.4), (0.7, 1.3)],
    "BL": [(0.0, 2.0)],
    "BR": [(0.1, 0.2), (0.4, 0.6), (0.9, 1.1), (1.5, 2.0)],
}
"""Stance phases of robot 0 [s], each foot's in a number of its own."""

SHIFT = 0.95
"""When robot 0 shifts from trot to bound [s]."""

FALL = 1.5
"""When robot 1 falls [s]."""


def course(steps: int = 200) -> Log:
    """Two robots on a step of 10 cm at x = 2 m, 1 m/s; the second turned by 90° and falling."""
    time = 1.0 + np.arange(steps) / 100
    t = (time - 1.0)[:, None]
    contact = np.zeros((steps, 2, 4), dtype=bool)
    for leg, name in enumerate(LEGS):
        for begin, end in STANCES[name]:
            contact[round(100 * begin) : round(100 * end), 0, leg] = True
    ground = from_spec("step:0.1", seed=0, length=4.0, width=6.0)
    base, yaw = np.full((steps, 2, 3), 0.46), np.array([0.0, np.pi / 2])
    base[:, 0, :2] = np.column_stack([1.0 + t[:, 0], np.zeros(steps)])
    base[:, 1, :2] = np.column_stack([np.full(steps, 0.5), t[:, 0]])
    feet = np.zeros((steps, 2, 4, 3))
    feet[..., :2] = base[:, :, None, :2]
    feet[..., 2] = ground.height_at(feet[..., :2]) + 0.02
    below = np.zeros((steps, 1, 4, 3))
    below[..., 2] = -0.46 + 0.01 * np.arange(4) + 0.02 * t[..., None]
    shifted = time - 1.0 >= SHIFT
    return log_of(
        contact,
        time=time,
        base_position_w=base,
        quaternion=turned(yaw),
        velocity_b=[1.0, 0.2, 0.1],
        foot_position_w=feet,
        foot_position_b=below,
        clearance=0.02,
        k=np.where(shifted, 5.0, 40 * (time - 1.0) / SHIFT)[:, None],
        threshold=np.where(shifted, 15.0, 40.0)[:, None],
        gait=np.stack([shifted.astype(int), np.zeros(steps, dtype=int)], axis=1),
        stance_shown=True,
        fallen=np.stack([np.zeros(steps, dtype=bool), time - 1.0 >= FALL], axis=1),
        gaits=("trot", "bound"),
        terrain=ground,
    )


LOG = course()


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """The rows of robot 0's figure: gait, contacts, foot heights, counter, speed, ground."""
    return demo_figure(LOG, tmp_path_factory.mktemp("figures") / "demo.png").axes


def lines(axes):
    """The labelled lines of a row: their data by their labels."""
    return {line.get_label(): line.get_ydata() for line in axes.get_lines()}


def bars(axes, leg):
    """Begin and end [s] of each bar in a foot's lane."""
    paths = axes.collections[leg].get_paths()
    return [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in paths]


def marks(axes, kind):
    """Times [s] of the upright lines of a kind."""
    return [line.get_xdata()[0] for line in axes.get_lines() if line.get_gid() == kind]


@pytest.mark.parametrize("leg", range(4))
def test_each_stance_phase_is_one_bar_as_long_as_it_lasted(page, leg):
    expected = [(1.0 + begin, 1.0 + end) for begin, end in STANCES[LEGS[leg]]]
    assert np.allclose(bars(page[1], leg), expected)


def test_a_bar_has_the_colour_of_the_gait_it_began_in(page):
    colours = gait_colours(LOG.gaits)
    faces = [to_hex(face) for face in page[1].collections[3].get_facecolor()]
    assert faces == [colours["trot"]] * 3 + [colours["bound"]]


def test_feet_stand_in_the_one_order_from_the_top(page):
    assert tuple(label.get_text() for label in page[1].get_yticklabels()) == LEGS
    assert page[1].yaxis_inverted()


def test_counter_and_threshold_are_the_logs(page):
    assert np.array_equal(lines(page[3])["k"], LOG.k[:, 0])
    assert np.array_equal(lines(page[3])["β"], LOG.threshold[:, 0])
    assert [text.get_text() for text in page[3].texts] == ["β = 40", "β = 15"]


def test_foot_heights_are_the_logs_in_centimetres_from_the_first_touch_on(page):
    """Feet rise by 2 cm a second below the base, each from a height of its own, while they stand.

    In the air a foot keeps the height at which it stood last.
    """
    drawn, steps = lines(page[2]), np.arange(200) / 100
    for leg, name in enumerate(LEGS):
        begin, last = STANCES[name][0][0], np.full(200, np.nan)
        for down, up in STANCES[name]:
            stood = np.clip(steps, down, up - 0.01)
            last[steps >= down - 1e-9] = stood[steps >= down - 1e-9]
        expected = -46.0 + leg + 2.0 * last[round(100 * begin) :]
        assert np.allclose(drawn[name], expected)


def test_speed_is_drawn_with_its_command(page):
    assert np.allclose(lines(page[4])["smoothed"], 1.0)
    assert np.allclose(lines(page[4])["command"], 1.2)


def test_ground_is_the_terrain_below_the_base(page):
    x = LOG.truth.base_position_w[:, 0, 0]
    drawn = lines(page[5])
    assert np.allclose(drawn["ground"][x < 1.95], 0.0)
    assert np.allclose(drawn["ground"][x > 2.05], 0.1)
    assert np.array_equal(drawn["base"], LOG.truth.base_position_w[:, 0, 2])


def test_ground_of_a_robot_elsewhere_is_that_below_its_feet(tmp_path):
    elsewhere = changed(LOG, clearance=LOG.truth.clearance - 0.3)
    figure = demo_figure(elsewhere, tmp_path / "demo.png", robot=1)
    assert np.allclose(lines(figure.axes[5])["ground"], 0.3)


def test_a_shift_is_marked_through_all_rows_with_its_time(page):
    for axes in page[1:]:
        assert marks(axes, "shift") == [1.95]
    assert "1.95 s" in [text.get_text() for text in page[0].texts]


def test_gaits_are_named_in_their_band(page):
    assert {"trot", "bound"} <= {text.get_text() for text in page[0].texts}


def test_rows_share_one_time_axis(page):
    assert {axes.get_xlim() for axes in page} == {(0.99, 3.0)}


def test_a_fall_is_marked_in_every_row(tmp_path):
    figure = demo_figure(LOG, tmp_path / "demo.png", robot=1)
    for axes in figure.axes:
        assert marks(axes, "fall") == [2.5]
    assert "fell at 2.50 s" in [text.get_text() for text in figure.axes[0].texts]


def test_nothing_drawn_is_not_a_number(page):
    for axes in page:
        assert all(np.isfinite(line.get_ydata()).all() for line in axes.get_lines())
        assert np.isfinite([*axes.get_xlim(), *axes.get_ylim()]).all()


def test_axes_tell_their_units(page):
    labels = [axes.get_ylabel() for axes in page[2:]] + [page[-1].get_xlabel()]
    assert [re.findall(r"\[(.+)\]", label) for label in labels] == [
        ["cm"], ["counts"], ["m/s"], ["m"], ["s"],
    ]  # fmt: skip


def test_rows_of_a_condition_are_left_out_where_there_was_none(tmp_path):
    without = replace(LOG, k=0 * LOG.k, threshold=0 * LOG.threshold)
    assert len(demo_figure(without, tmp_path / "demo.png").axes) == 4


def test_file_is_as_wide_as_promised_and_small_and_the_same_again(tmp_path):
    one, two = tmp_path / "one.png", tmp_path / "two.png"
    demo_figure(LOG, one)
    demo_figure(LOG, two)
    with Image.open(one) as image:
        assert image.width == 1600
    assert one.stat().st_size < 300_000
    assert one.read_bytes() == two.read_bytes()


def test_contact_diagram_shows_the_window_alone(tmp_path):
    axes = contact_diagram(LOG, tmp_path / "contacts.png", t0=1.25, t1=1.995).axes[0]
    assert np.allclose(bars(axes, 0), [(1.25, 1.3), (1.5, 1.8)])
    assert np.allclose(bars(axes, 2), [(1.25, 2.0)])
    assert axes.get_xlabel() == "time [s]"
    texts = [text.get_text() for text in axes.texts]
    assert texts[:2] == ["trot", "bound"]
    assert texts[2:6] == ["47 %", "60 %", "100 %", "40 %"]  # of 75 steps: 35, 45, 75, 30


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda folder: demo_figure(LOG, folder / "a.png", robot=2), "got 2"),
        (lambda folder: demo_figure(LOG, folder / "a.gif"), "must end in .png"),
        (lambda folder: demo_figure(LOG, folder / "no" / "a.png"), "no folder"),
        (lambda folder: demo_figure(first_entries(1), folder / "a.png"), "got 1"),
        (lambda folder: contact_diagram(LOG, folder / "a.png", t0=9.0), "within 1 to 2.99 s"),
    ],
)
def test_what_cannot_be_drawn_is_said_in_one_line(tmp_path, call, words):
    with pytest.raises(GaitshiftError, match=words) as caught:
        call(tmp_path)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def first_entries(count):
    return LOG[:count]


def test_two_entries_are_enough(tmp_path):
    demo_figure(first_entries(2), tmp_path / "demo.png")


@pytest.mark.parametrize("robot", [0, 1])
def test_forward_speed_is_along_the_robots_own_nose(robot, tmp_path):
    """Both walk at 1 m/s the way they look, the second along +y, and drift to their left."""
    speed = lines(demo_figure(LOG, tmp_path / "demo.png", robot=robot).axes[4])["each step"]
    way = LOG.truth.base_position_w[:, robot, robot]
    assert np.allclose(speed, 1.0)
    assert np.allclose(np.diff(way), 0.01)


def test_smoothing_keeps_straight_lines_and_stills_trembling():
    t = np.arange(300) / 100
    line = 3.0 - 2.0 * t
    assert np.allclose(smoothed(line, 0.01, 0.5), line)
    trembling = smoothed(np.sin(2 * np.pi * 5 * t), 0.01, 0.3)
    assert np.abs(trembling[90:-90]).max() < 1e-3
    assert np.abs(trembling).max() < 0.25, "its ends are not tied to the last step"


def test_smoothing_is_a_weighted_line_through_each_window():
    t, rng = np.arange(120) / 100, np.random.default_rng(0)
    values = rng.normal(size=120)
    for i, value in enumerate(smoothed(values, 0.01, 0.25)):
        weights = np.exp(-0.5 * ((t - t[i]) / 0.25) ** 2) * (np.abs(t - t[i]) < 0.7501)
        _, expected = np.polyfit(t - t[i], values, 1, w=np.sqrt(weights))
        assert value == pytest.approx(expected, abs=1e-9)


@pytest.fixture
def progress(tmp_path):
    """A `progress.csv` of 40 iterations, 25 of them on flat ground."""
    path = tmp_path / "progress.csv"
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        names = ("iteration", "stage", "steps", "wall_s", "reward", "speed", "survival")
        table.writerow([*names, "changes_per_s"])
        for i in range(1, 41):
            stage = "flat" if i <= 25 else "rough"
            table.writerow([i, stage, 50_000 * i, 3 * i, i - 10, i / 40, 1 - i / 100, 0.1 * i])
    return path


def test_training_curves_are_the_columns(progress, tmp_path):
    page = training_curves(progress, tmp_path / "training.png").axes
    i = np.arange(1, 41)
    for axes, column in zip(page, (i - 10, i / 40, 100 - i, 0.1 * i), strict=False):
        assert np.allclose(lines(axes)["each iteration"], column)
        assert np.allclose(lines(axes)["average"], column)  # straight lines stay straight
        assert np.allclose(axes.get_lines()[0].get_xdata(), 0.05 * i)
    assert (tmp_path / "training.png").stat().st_size < 200_000


def test_training_curves_tell_stages_units_and_wall_time(progress, tmp_path):
    page = training_curves(progress, tmp_path / "training.png").axes
    assert [text.get_text() for text in page[0].texts] == ["flat", "rough"]
    (band,) = page[0].patches
    assert (band.get_x(), band.get_width()) == pytest.approx((1.25, 0.75))
    assert all(re.search(r"\[.+\]", axes.get_ylabel()) for axes in page[:4])
    assert page[3].get_xlabel() == "control steps [millions]"
    (scale,) = page[3].child_axes
    assert scale.get_xlabel() == "wall time [min]"
    assert scale.get_xlim() == pytest.approx((0.0, 2.0))  # 40 iterations of 3 s


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "2 iterations or more to draw, got 0"),
        ("iteration,stage\n1,flat\n2,flat\n", "lacks 'steps'"),
        (
            "iteration,stage,steps,wall_s,reward,speed,survival,changes_per_s\n" * 3,
            "'steps' must hold numbers",
        ),
    ],
)
def test_a_file_that_is_no_progress_is_refused(tmp_path, text, words):
    path = tmp_path / "progress.csv"
    path.write_text(text)
    with pytest.raises(GaitshiftError, match=words):
        training_curves(path, tmp_path / "training.png")


def test_a_missing_progress_is_refused(tmp_path):
    with pytest.raises(GaitshiftError, match="cannot be read"):
        training_curves(tmp_path / "no.csv", tmp_path / "training.png")


def test_a_gait_keeps_its_colour_in_any_company():
    assert gait_colours(["pronk"])["pronk"] == gait_colours(["trot", "pronk", "bound"])["pronk"]


def test_gaits_of_one_log_have_colours_of_their_own():
    names = ("trot", "pace", "bound", "pronk", "walk", "gallop", "three-one", "half-bound")
    assert len(set(gait_colours(names).values())) == len(names)


# Machado, Oliveira & Fernandes 2009, severity 1.0, on linear RGB.
COLOUR_VISIONS = {
    "protan": (
        (0.152286, 1.052583, -0.204868),
        (0.114503, 0.786281, 0.099216),
        (-0.003882, -0.048116, 1.051998),
    ),
    "deutan": (
        (0.367322, 0.860646, -0.227968),
        (0.280085, 0.672501, 0.047413),
        (-0.011820, 0.042940, 0.968881),
    ),
    "tritan": (
        (1.255528, -0.076749, -0.178779),
        (-0.078411, 0.930809, 0.147602),
        (0.004733, 0.691367, 0.303900),
    ),
}


def lab(colour, vision):
    """CIE L*a*b* (D65) of a colour as a kind of colour vision sees it."""
    rgb = np.array(to_rgb(colour))
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    linear = np.clip(np.array(vision) @ linear, 0, 1)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = np.array(to_xyz) @ linear / [0.9505, 1.0, 1.089]
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("vision", COLOUR_VISIONS)
@pytest.mark.parametrize(
    "colours",
    [tuple(gait_colours(["trot", "pace", "bound"]).values()), LEG_COLOURS, (INK, LEG_COLOURS[2])],
    ids=["gaits", "legs", "ink"],
)
def test_colours_are_told_apart_by_every_kind_of_colour_vision(colours, vision):
    seen = [lab(colour, COLOUR_VISIONS[vision]) for colour in colours]
    distances = [np.linalg.norm(a - b) for i, a in enumerate(seen) for b in seen[:i]]
    assert min(distances) > 15
