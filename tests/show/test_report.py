"""Reports: one page of a run that opens from disk, and tells what the log does."""

import base64
import hashlib
import json
import re
import time
from pathlib import Path

import numpy as np
import pytest

import browsing
from gaitshift.cli import main
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.robot.description import ANYMAL_B
from gaitshift.show.geometry import Shape
from gaitshift.show.report import write_report
from gaitshift.show.report.data import EVERY, run_data
from gaitshift.sim.terrain import from_spec

ROOT = Path(__file__).parents[2]
TRACK = "flat@4,perlin:0.12@4,flat@3"


@pytest.fixture(scope="module")
def log():
    """Two robots that shift to bound on noise."""
    config = DemoConfig(track=TRACK, episodes=2, beta=60.0)
    return run_demo(config)[0]


@pytest.fixture(scope="module")
def data(log):
    return run_data(log, 1, ANYMAL_B)


@pytest.fixture(scope="module")
def page(log, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "index.html"
    write_report(log, path, robot=1, facts={"command": "gaitshift demo </script>"})
    return path


def unpacked(entry):
    kinds = {"f4": "<f4", "u4": "<u4", "u1": "u1"}
    return np.frombuffer(base64.b64decode(entry["data"]), dtype=kinds[entry["type"]])


def test_the_page_is_fed_with_the_logs_own_robot(log, data):
    steps, frames = len(log.time), data["frames"]
    assert frames == -(-steps // EVERY)
    np.testing.assert_allclose(unpacked(data["time"]), log.time, rtol=1e-6)
    bits = unpacked(data["contact"])
    feet = (bits[:, None] >> np.arange(4)) & 1
    np.testing.assert_array_equal(feet, log.sensed.contact[:, 1])
    base = [body["name"] for body in data["bodies"]].index("base")
    position = unpacked(data["position"]).reshape(frames, -1, 3)
    rotation = unpacked(data["rotation"]).reshape(frames, -1, 4)
    np.testing.assert_allclose(position[:, base], log.truth.base_position_w[::EVERY, 1], atol=1e-5)
    quaternion = log.truth.base_quaternion_w[::EVERY, 1]
    aligned = np.abs((rotation[:, base] * quaternion).sum(axis=1))
    np.testing.assert_allclose(aligned, 1.0, atol=1e-5)
    feet = log.truth.foot_position_w[::EVERY, 1]
    centre = unpacked(data["feet"]).reshape(frames, 4, 3) - feet
    np.testing.assert_allclose(
        centre, np.broadcast_to([0, 0, ANYMAL_B.foot_radius], centre.shape), atol=1e-5
    )


def test_bodies_arrive_as_they_are(data):
    for body, sent in zip(Shape(ANYMAL_B).bodies, data["bodies"], strict=True):
        vertices, faces = unpacked(sent["vertices"]).reshape(-1, 3), unpacked(sent["faces"])
        np.testing.assert_allclose(vertices, body.mesh.vertices, atol=1e-6)
        assert faces.max() < len(vertices)
        assert len(unpacked(sent["colours"])) == 3 * len(vertices)


def test_the_ground_on_the_page_is_the_one_that_was_walked_on(log):
    ground = from_spec(f"{TRACK},flat@8", seed=0, length=1.0, width=8.0)
    sent = run_data(log, 0, ANYMAL_B)["ground"]
    x = sent["x"][0] + sent["x"][1] * np.arange(sent["columns"])
    y = sent["y"][0] + sent["y"][1] * np.arange(sent["rows"])
    height = unpacked(sent["height"]).reshape(len(y), len(x))
    expected = ground.height_at(np.stack(np.meshgrid(x, y), axis=-1))
    np.testing.assert_allclose(height, expected, atol=1e-5)
    walked = log.truth.base_position_w[:, 0, 0]
    assert x[0] <= walked.min()
    assert walked.max() <= x[-1]


def test_rows_hold_the_signals_and_no_height_of_a_foot_that_has_not_touched(log, data):
    rows = {row["title"]: row for row in data["rows"]}
    assert all("[" in title for title, row in rows.items() if row["kind"] == "lines"), "units"
    (counter,) = (row for title, row in rows.items() if title.startswith("counter"))
    k, beta = (unpacked(series["values"]) for series in counter["series"])
    np.testing.assert_allclose(k, log.k[:, 1], rtol=1e-6)
    np.testing.assert_allclose(beta, log.threshold[:, 1], rtol=1e-6)
    (heights,) = (
        row for title, row in rows.items() if title.startswith("height of the last touch")
    )
    for leg, series in enumerate(heights["series"]):
        first = log.sensed.contact[:, 1, leg].argmax()
        values = unpacked(series["values"])
        assert np.isnan(values[:first]).all()
        np.testing.assert_allclose(values[first:], log.touch_height[first:, 1, leg], rtol=1e-6)


def test_a_minute_of_walking_stays_below_15_megabytes(log, page, data):
    fixed = len((ROOT / "src/gaitshift/show/report/player.js").read_bytes())
    fixed += len(json.dumps(data["bodies"]))
    moving = page.stat().st_size - fixed
    assert fixed + moving * 60.0 / float(log.time[-1]) < 15e6 - 6e6, "beside the largest film"


def test_the_page_asks_for_nothing_and_tells_what_happened(page):
    text = page.read_text()
    assert not re.findall(r'(?:src|href)=["\']?(?!data:)[^"\'\s>]+', text.split("<script")[0])
    assert "<h1>Trot → Bound → Trot</h1>" in text or "<h1>Trot → Bound</h1>" in text
    assert "robot 2 of 2" in text
    assert "gaitshift demo &lt;/script&gt;" in text
    raw = text.split("data-walk>")[1].split("</script>")[0]
    assert len(json.loads(raw)["shifts"]) >= 1


def test_a_film_stands_on_the_page_under_a_heading_as_all_sections_do(log, tmp_path):
    (tmp_path / "film.mp4").write_bytes(b"a film")
    write_report(log, tmp_path / "page.html", video=tmp_path / "film.mp4")
    text = (tmp_path / "page.html").read_text()
    assert re.findall("<h2>(.*?)</h2>", text) == ["Gaits", "Shifts", "Film", "Settings"]
    assert base64.b64encode(b"a film").decode() in text


@pytest.mark.parametrize(
    ("bundle", "own"),
    [("player.js", ("player.js", "scene.js", "charts.js")), ("figures.js", ("figures.js",))],
)
def test_scripts_were_made_from_their_sources(bundle, own):
    """`make player` bundles web/ and writes the sum of a bundle's sources into it."""
    total = hashlib.sha256()
    for name in (*own, "theme.js", "unpack.js", "package.json"):
        total.update((ROOT / "web" / name).read_bytes())
    head = (ROOT / "src/gaitshift/show/report" / bundle).read_text()[:200]
    assert total.hexdigest() in head, "run: make player"


def test_report_writes_a_page_beside_the_log_and_replaces_none_unasked(log, tmp_path, capsys):
    log.save(tmp_path / "run.npz")
    main(["report", str(tmp_path / "run.npz"), "--robot", "1"])
    assert capsys.readouterr().out.strip() == str(tmp_path / "run.html")
    with pytest.raises(SystemExit) as end:
        main(["report", str(tmp_path / "run.npz")])
    assert end.value.code == 2
    assert "--overwrite" in capsys.readouterr().err
    main(["report", str(tmp_path / "run.npz"), "--overwrite"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.npz"], "no log file nowhere.npz"),
        (["{log}", "--robot", "7"], "got 7"),
        (["{log}", "--video", "no.mp4"], "no video file no.mp4"),
        (["{log}", "--out", "no/where.html"], "no folder no"),
        (["README.md"], "not a complete npz file"),
    ],
)
def test_bad_input_of_report_is_one_line_and_code_2(log, tmp_path, capsys, arguments, message):
    log.save(tmp_path / "run.npz")
    given = [argument.format(log=tmp_path / "run.npz") for argument in arguments]
    with pytest.raises(SystemExit) as end:
        main(["report", *given])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]
    assert not (tmp_path / "run.html").exists()


@pytest.mark.slow
@browsing.needed
def test_the_page_opens_without_a_network_and_its_slider_moves_the_robot(log, page, browser):
    opened, wrong = browsing.opened(browser, page.as_uri(), offline=True)
    opened.wait_for_function("window.gaitshift !== undefined")

    def position():
        return opened.evaluate("gaitshift.view.position()")

    opened.evaluate("gaitshift.seek(0)")
    np.testing.assert_allclose(position(), log.truth.base_position_w[0, 1], atol=1e-4)
    told = opened.locator("#charts .note").inner_text()
    assert told.startswith("0.01 s")
    assert "NaN" not in told, "of feet that have not touched yet there is nothing to tell"
    slider = opened.locator("#time")
    slider.fill("4")
    np.testing.assert_allclose(position()[0], log.truth.base_position_w[400, 1, 0], atol=0.03)
    assert opened.locator("#clock").inner_text() == "4.00 s"
    browsing.click(opened.locator("#play"))
    opened.wait_for_function("gaitshift.state.time > 4.3")
    browsing.click(opened.locator("#play"))
    stopped = opened.evaluate("gaitshift.state.time")
    time.sleep(0.5)
    assert opened.evaluate("gaitshift.state.time") == stopped
    browsing.click(
        opened.locator("h2", has_text="Shifts").locator("xpath=following::tr[@data-seek][1]")
    )
    shift = json.loads(page.read_text().split("data-walk>")[1].split("</script>")[0])["shifts"][0]
    assert opened.evaluate("gaitshift.state.time") == pytest.approx(shift - 1.0, abs=0.02)
    opened.locator("#charts canvas").click(position={"x": 500, "y": 60})
    assert opened.evaluate("gaitshift.state.time") != pytest.approx(shift - 1.0, abs=0.02)
    opened.locator("#scene").scroll_into_view_if_needed()
    browsing.wait_for_robot(opened, "report", rows=3 / 4)
    browsing.click(opened.locator("#theme"))
    assert opened.evaluate("getComputedStyle(document.documentElement).colorScheme") == "dark"
    assert not wrong
