"""Videos show what is in the log; where nothing can be drawn they say so."""

import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import imageio_ffmpeg
import mujoco
import numpy as np
import pytest
from PIL import ImageColor

from gaitshift.errors import GaitshiftError
from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B
from gaitshift.show import opengl
from gaitshift.show.plots import gait_colours
from gaitshift.show.video import VideoUnavailable, render
from gaitshift.show.video.canvas import Ball, Camera, Canvas, follow
from gaitshift.show.video.render import FilmWriter
from gaitshift.show.video.scene import SUN, Paint, build_scene
from gaitshift.show.video.strip import Reading, Strip
from gaitshift.sim.terrain import flat, from_spec
from synthetic import changed, log_of, turned
from waiting import PATIENCE

AT_ZERO = np.zeros((2, 2))
"""The course of a robot that stands at x = y = 0."""

SMALL = {"width": 320, "height": 180, "fps": 25}


def slide(steps: int = 40, ground: str = "perlin:0.05") -> Log:
    """A robot in its stance, sliding along +x at 1 m/s, its feet touching in turn, as `pace`."""
    terrain = from_spec(ground, seed=1, length=8.0, width=6.0)
    time = np.arange(1, steps + 1) / 100
    base = np.zeros((steps, 1, 3))
    base[:, 0, 0] = 3.0 + time
    base[..., 2] = terrain.height_at(base[..., :2]) + ANYMAL_B.stance_height
    offset = np.array([[0.35, 0.2], [0.35, -0.2], [-0.35, 0.2], [-0.35, -0.2]])
    feet = np.zeros((steps, 1, 4, 3))
    feet[..., :2] = base[:, :, None, :2] + offset
    feet[..., 2] = terrain.height_at(feet[..., :2])
    return log_of(
        np.arange(steps)[:, None, None] // 10 % 4 == np.arange(4),
        base_position_w=base,
        velocity_b=[1.0, 0.0, 0.0],
        foot_position_w=feet,
        k=10.0 * time[:, None],
        threshold=20.0,
        stance_shown=True,
        gaits=("pace",),
        terrain=terrain,
    )


def read_film(path):
    """The pictures of a video, one after the other: rows from the top, red, green, blue."""
    ffmpeg = [imageio_ffmpeg.get_ffmpeg_exe(), "-v", "error", "-i", str(path)]
    command = [*ffmpeg, "-f", "image2pipe", "-c:v", "ppm", "-"]
    # imageio's own reader leaves its pipes open.
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        while process.stdout.readline() == b"P6\n":
            width, height = (int(word) for word in process.stdout.readline().split())
            process.stdout.readline()
            pixels = process.stdout.read(3 * width * height)
            yield np.frombuffer(pixels, dtype=np.uint8).reshape(height, width, 3)


@pytest.fixture(scope="module")
def gl():
    """Skips what needs OpenGL where there is none."""
    try:
        Canvas(mujoco.MjSpec().compile(), 64, 64).close()
    except VideoUnavailable as reason:
        pytest.skip(str(reason))


@pytest.fixture(scope="module")
def film(gl, tmp_path_factory):
    """A small video of the slide, its pictures, and what was reported on the way."""
    path = tmp_path_factory.mktemp("video") / "slide.mp4"
    reports: list[tuple[int, int]] = []
    render(slide(), path, report=lambda done, total: reports.append((done, total)), **SMALL)
    return path, np.array(list(read_film(path))).astype(int), reports


def test_video_has_a_picture_for_each_instant_and_tells_of_each(film):
    _, pictures, reports = film
    assert pictures.shape == (10, 180, 320, 3)  # from 0.01 to 0.40 s, one every 0.04 s
    assert reports == [(done, 10) for done in range(1, 11)]


def test_video_is_not_blank_and_moves(film):
    _, pictures, _ = film
    assert pictures.std(axis=(1, 2)).min() > 10
    assert np.abs(np.diff(pictures, axis=0)).mean(axis=(1, 2, 3)).min() > 0.5


def test_robot_stays_in_the_middle_of_the_picture(film):
    _, pictures, _ = film
    dark = pictures[:, :157].max(axis=-1) < 60  # above the strip only the robot is
    for picture in dark:
        y, x = np.nonzero(picture)
        assert x.size > 100
        assert abs(x.mean() - 160) < 40
        assert abs(y.mean() - 79) < 40


def test_a_foot_that_touches_glows(film):
    _, pictures, _ = film
    green = (pictures[..., 1] > pictures[..., 0] + 60) & (pictures[..., 1] > pictures[..., 2] + 20)
    assert green[:, :157].sum(axis=(1, 2)).min() >= 8  # pace is green


def test_half_a_minute_of_anything_stays_below_four_megabytes(tmp_path):
    rng = np.random.default_rng(0)
    with FilmWriter(tmp_path / "noise.mp4", 160, 160, 30) as film:
        for _ in range(15 * 30):
            film.add(rng.integers(0, 256, (160, 160, 3), dtype=np.uint8))
    assert 1e6 < (tmp_path / "noise.mp4").stat().st_size < 4e6 / 2


def test_flat_ground_fills_the_picture_to_the_horizon(gl, tmp_path):
    render(slide(8, "flat"), tmp_path / "flat.mp4", **SMALL)
    bottom = next(read_film(tmp_path / "flat.mp4")).astype(int)[120:150]
    assert (bottom[..., 2] < bottom[..., 0] + 8).mean() > 0.7  # stone, not sky


def test_what_is_painted_at_a_place_is_seen_at_that_place(gl):
    terrain = from_spec("perlin:0.05", seed=0, length=12.0, width=6.0)
    stage = build_scene(ANYMAL_B, terrain, np.array([[6.0, 0.0], [6.0, 0.0]]), 640, 480)
    paint, data = Paint(stage), mujoco.MjData(stage.model)
    mujoco.mj_forward(stage.model, data)
    place = np.array([3.0, 1.6])
    ball = Ball(
        position=np.array([*place, terrain.height_at(place)]), radius=0.1, rgba=(0, 1, 0, 1)
    )
    camera = Camera(target=(6.0, 0.0, 0.0), distance=4.0, azimuth=150.0, elevation=-40.0)
    canvas = Canvas(stage.model, 640, 480)
    try:
        bare = canvas.draw(data, camera).astype(int)
        seen = [canvas.draw(data, camera, [ball]).astype(int)]
        for _ in range(3):
            paint.add_footprint(place, "#ff00ff")
        canvas.upload_texture(stage.texture)
        seen.append(canvas.draw(data, camera).astype(int))
    finally:
        canvas.close()
    middles = [np.argwhere(np.abs(one - bare).sum(axis=2) > 30).mean(axis=0) for one in seen]
    assert np.allclose(*middles, atol=4)


def test_shadow_lies_where_the_sun_casts_it():
    stage = build_scene(ANYMAL_B, flat(8.0, 6.0), AT_ZERO, 64, 64)
    paint, data = Paint(stage), mujoco.MjData(stage.model)
    texture = stage.model.tex_data[stage.model.tex_adr[stage.texture] :]
    rows, columns = (
        int(shape[stage.texture]) for shape in (stage.model.tex_height, stage.model.tex_width)
    )
    ground = texture[: rows * columns * 3].reshape(rows, columns, 3)[::-1]
    bare = ground.astype(int)
    x0, x1, y0, y1 = stage.terrain.extent
    for height, xy in ((0.5, (1.0, -2.0)), (1.0, (-1.5, 0.5))):
        data.qpos[:3], data.qpos[3] = (*xy, height), 1.0
        data.qpos[7:] = ANYMAL_B.stance
        mujoco.mj_kinematics(stage.model, data)
        paint.move_shadow(stage.model, data)
        dark = (bare - ground).sum(axis=2)
        row, column = (dark[..., None] * np.indices(dark.shape).transpose(1, 2, 0)).sum(
            axis=(0, 1)
        ) / dark.sum()
        seen = x0 + (column + 0.5) / columns * (x1 - x0), y0 + (row + 0.5) / rows * (y1 - y0)
        trunk = height + 0.02  # middle of the robot's parts, between trunk and feet
        expected = np.array(xy) + np.array(SUN[:2]) / -SUN[2] * trunk
        assert np.allclose(seen, expected, atol=0.12)


def test_a_robot_beside_the_ground_casts_no_shadow_and_leaves_no_print():
    stage = build_scene(
        ANYMAL_B, from_spec("step:0.1", seed=0, length=4.0, width=4.0), AT_ZERO, 64, 64
    )
    paint, data = Paint(stage), mujoco.MjData(stage.model)
    bare = stage.model.tex_data.copy()
    data.qpos[:4] = (50.0, -50.0, 0.5, 1.0)
    mujoco.mj_kinematics(stage.model, data)
    paint.move_shadow(stage.model, data)
    paint.add_footprint(np.array([-9.0, 0.0]), "#ff00ff")
    assert np.array_equal(stage.model.tex_data, bare)


def test_camera_does_not_bob_with_the_body_and_goes_as_fast():
    log = slide(300, "flat")
    base = log.truth.base_position_w.copy()
    base[:, 0, 2] += 0.03 * np.sin(2 * np.pi * 4 * log.time)
    cameras = follow(changed(log, base_position_w=base), 0)
    target = np.array([camera.target for camera in cameras])
    assert np.abs(np.diff(target[:, 2])).max() < 1e-4  # the body: 0.75 m/s, the camera: 1 cm/s
    assert np.allclose(target[:, 0], base[:, 0, 0])


def test_camera_turns_with_the_robot():
    log = slide(300, "flat")
    left = changed(log, quaternion=turned(np.pi / 2))
    azimuth = [follow(one, 0)[100].azimuth for one in (log, left)]
    assert azimuth[1] - azimuth[0] == pytest.approx(90.0)


def reading(**changes):
    """A reading of a bound with k at a quarter of its threshold."""
    colour = gait_colours(["bound"])["bound"]
    usual = {"gait": "bound", "colour": colour, "k": 5.0, "threshold": 20.0, "speed": 1.2}
    return Reading(**{**usual, "time": 3.0, "fallen": False, **changes})


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0, 3.0])
def test_bar_is_as_full_as_the_counter(share):
    strip = Strip(1280, 720)
    row = strip.draw(reading(k=20.0 * share))[62].astype(int)
    bar = row[330:891]
    assert (bar.min(axis=1) > 200).mean() == pytest.approx(min(share, 1.0), abs=0.01)


def test_strip_shows_the_gaits_colour_until_the_robot_has_fallen():
    strip = Strip(1280, 720)
    colour = ImageColor.getrgb(gait_colours(["bound"])["bound"])
    assert tuple(strip.draw(reading())[45, 40]) == colour
    assert tuple(strip.draw(reading(fallen=True))[45, 40]) != colour


def test_strip_without_a_condition_has_no_bar():
    strip = Strip(1280, 720).draw(reading(k=0.0, threshold=0.0))
    assert np.ptp(strip[:, 330:891].reshape(-1, 3), axis=0).max() == 0


def colours(*shades):
    """Pictures of one grey each."""
    return [np.full((90, 160, 3), shade, dtype=np.uint8) for shade in shades]


def test_a_film_keeps_its_pictures_in_order(tmp_path):
    with FilmWriter(tmp_path / "film.mp4", 160, 90, 10) as film:
        for picture in colours(20, 120, 220):
            film.add(picture)
    middles = [picture[45, 80, 0] for picture in read_film(tmp_path / "film.mp4")]
    assert middles == pytest.approx([20, 120, 220], abs=4)


def test_a_video_is_written_whole_or_not_at_all(tmp_path):
    def give_up():
        with FilmWriter(tmp_path / "film.mp4", 160, 90, 10) as film:
            film.add(colours(20)[0])
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        give_up()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda folder: render(slide(), folder / "a.avi"), "must end in .mp4"),
        (lambda folder: render(slide(), folder / "no" / "a.mp4"), "no folder"),
        (lambda folder: render(slide(), folder / "a.mp4", robot=1), "got 1"),
        (lambda folder: render(slide(), folder / "a.mp4", t0=5.0), "got 5"),
        (
            lambda folder: render(slide(), folder / "a.mp4", width=321),
            "width and height must be even",
        ),
        (lambda folder: render(slide(), folder / "a.mp4", fps=0), "1 to 120"),
        (
            lambda folder: render(replace(slide(), robot="dog"), folder / "a.mp4"),
            "of the robot 'dog'",
        ),
        (lambda folder: render(elsewhere(), folder / "a.mp4"), "robot must be 0"),
    ],
)
def test_what_cannot_be_filmed_is_said_in_one_line(tmp_path, call, words):
    with pytest.raises(GaitshiftError, match=words) as caught:
        call(tmp_path)
    assert "\n" not in str(caught.value)


def elsewhere():
    """A log whose robot walked 0.2 m below the ground that the log keeps."""
    log = slide()
    return changed(log, clearance=log.truth.clearance + 0.2)


def in_a_fresh_interpreter(**changes):
    """Draws one picture where the environment says how; what was printed."""
    program = """
import warnings
import mujoco
from gaitshift.show.video import VideoUnavailable
from gaitshift.show.video.canvas import Canvas, Camera
warnings.simplefilter("error")
try:
    canvas = Canvas(mujoco.MjSpec().compile(), 64, 64)
except VideoUnavailable as error:
    print("unavailable:", error)
else:
    camera = Camera(target=(0.0, 0.0, 0.0), distance=1.0, azimuth=0.0, elevation=0.0)
    model = mujoco.MjSpec().compile()
    print("drawn", canvas.draw(mujoco.MjData(model), camera).shape)
    canvas.close()
"""
    away = ("MUJOCO_GL", "PYOPENGL_PLATFORM", "DISPLAY", "WAYLAND_DISPLAY")
    environment = {k: v for k, v in os.environ.items() if k not in away} | changes
    done = subprocess.run(
        [sys.executable, "-c", program],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=True,
        env=environment,
    )
    return done.stdout.strip()


@pytest.mark.parametrize(
    "environment", [{"MUJOCO_GL": "disable"}, {"PYOPENGL_PLATFORM": "glx"}], ids=["off", "broken"]
)
def test_without_opengl_one_line_says_what_to_install(environment):
    said = in_a_fresh_interpreter(**environment)
    assert said.startswith("unavailable: videos need OpenGL (")
    assert said.endswith("apt-get install libegl1 libgl1")
    assert "\n" not in said


@pytest.mark.skipif(sys.platform != "linux", reason="the backends are those of Linux")
def test_a_backend_that_does_not_exist_is_named_with_those_that_do(monkeypatch):
    """MuJoCo itself cannot be imported with such a value, so that it sees another."""
    monkeypatch.delenv(opengl.CHOICE, raising=False)
    monkeypatch.setenv("MUJOCO_GL", "nonsense")
    with opengl.postponed():
        assert os.environ["MUJOCO_GL"] == "disable"
        with pytest.raises(RuntimeError) as error:
            opengl.open_context(64, 64)
    assert "egl, glfw, osmesa, disable, got 'nonsense'" in str(error.value)
    assert os.environ["MUJOCO_GL"] == "nonsense"
    assert opengl.CHOICE not in os.environ


@pytest.mark.skipif(sys.platform != "linux", reason="EGL draws without a screen on Linux alone")
def test_without_a_display_nothing_has_to_be_set(gl):
    assert in_a_fresh_interpreter() == "drawn (64, 64, 3)"


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # of its pipe
def test_a_film_whose_ffmpeg_ends_early_is_refused_and_the_one_before_it_stays(tmp_path):
    path, picture = tmp_path / "film.mp4", np.zeros((90, 160, 3), np.uint8)
    path.write_bytes(b"before")
    others = children()  # a browser for the tests of pages, for one

    def film_cut_short():
        with FilmWriter(path, 160, 90, 10) as film:
            for _ in range(5):
                film.add(picture)
            for child in children() - others:
                os.kill(child, signal.SIGKILL)

    with pytest.raises(GaitshiftError, match=r"film.mp4 cannot be written: ffmpeg kept \d of 5"):
        film_cut_short()
    assert path.read_bytes() == b"before"
    assert list(tmp_path.iterdir()) == [path]


def children():
    """The processes that this one started."""
    return set(map(int, Path("/proc/thread-self/children").read_text().split()))
