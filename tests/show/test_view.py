"""`gaitshift view`: its pages in a browser, and what it refuses."""

import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request

import numpy as np
import pytest

import browsing
from gaitshift.cli import main
from gaitshift.lab.log import Log
from gaitshift.sim.terrain import from_spec
from waiting import PATIENCE, wait_until
from walking import live_run, walk

BESIDE_THE_PANEL = 2 / 3
"""Share of a page's columns that the panel on its right leaves free."""


# The command --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.npz"], "no log file nowhere.npz"),
        (["--robots", "40"], "1 to 16"),
        (["--condition", "guess"], "unknown graph 'guess'"),
        (["--condition", "oracle"], "got 'oracle', which needs the truth about the ground"),
        (["--condition", "speed"], "a graph of two gaits, there and back, is needed"),
        (["--port", "70000"], "1 to 65535"),
        (["--track", "moon@3"], "moon"),
        (["--host", "203.0.113.7"], "cannot listen on 203.0.113.7:8080"),
    ],
)
def test_bad_input_of_view_is_one_line_and_code_2(capsys, arguments, message):
    with pytest.raises(SystemExit) as end:
        main(["view", *arguments])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


def test_a_port_that_is_taken_is_named(capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(SystemExit) as end:
            main(["view", "--port", str(port)])
    assert end.value.code == 2
    assert f"cannot listen on 127.0.0.1:{port}" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("host", "opens"), [("0.0.0.0", "127.0.0.1"), ("::1", "[::1]"), ("::", "[::1]")]
)
def test_the_address_that_is_printed_opens(host, opens):
    port = free_port()
    command = [sys.executable, "-m", "gaitshift", "view", "--host", host, "--port", str(port)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        address = process.stdout.readline().split()[1]
        try:
            assert address == f"http://{opens}:{port}"
            with urllib.request.urlopen(address, timeout=PATIENCE) as page:
                assert page.status == 200
        finally:
            process.send_signal(signal.SIGINT)
        assert process.wait(PATIENCE) == 0


# In a browser -------------------------------------------------------------------------------------


def free_port():
    with socket.socket() as some:
        some.bind(("127.0.0.1", 0))
        return some.getsockname()[1]


@pytest.fixture
def served(tmp_path):
    """Starts `gaitshift view` with these arguments: its address; ended by Ctrl-C."""
    started = []

    def start(*arguments):
        port = free_port()
        command = [sys.executable, "-m", "gaitshift", "view", *arguments, "--port", str(port)]
        process = subprocess.Popen(
            [*command, "--out", str(tmp_path / "recorded")],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        started.append(process)
        assert any("open http" in line for line in iter(process.stdout.readline, ""))
        return process, f"http://127.0.0.1:{port}"

    yield start
    for process in started:
        process.kill()
        process.communicate()


def opened(browser, address, *, fine=False):
    """A page on the address, fine where its picture is looked at, and what went wrong on it."""
    scale = 1.0 if fine else 0.25
    page, wrong = browsing.opened(browser, address, draws=fine, device_scale_factor=scale)
    wait_for_status(page)
    return page, wrong


def wait_for_status(page):
    page.get_by_text("real time").first.wait_for()
    wait_until(lambda: page.locator("p", has_text=" · ").count() > 0)


def status(page):
    """Gait, way [m] and time [s] as the page tells them."""
    text = page.locator("p", has_text=" · ").first.inner_text()
    gait, _, way, clock, *_ = text.split(" · ")
    return gait, float(way.removesuffix(" m")), float(clock.removesuffix(" s"))


@pytest.mark.slow
@browsing.needed
def test_the_live_page_shows_a_robot_that_walks_and_obeys(served, browser):
    process, address = served("--track", "flat@200")
    page, wrong = opened(browser, address)
    first = status(page)
    assert first[0] == "trot"
    wait_until(lambda: status(page)[1] > first[1] + 1.0)
    browsing.click(page.get_by_role("button", name="pace", exact=True))
    wait_until(gait_is(page, "pace"))
    page.reload(wait_until="commit")
    wait_for_status(page)
    assert status(page)[0] == "pace", "it goes on as it was"
    assert not wrong
    process.send_signal(signal.SIGINT)
    assert process.wait(PATIENCE) == 0
    assert "closed" in process.stderr.read()


def number_box(page, label):
    """What is beside the slider of this label."""
    row = page.locator("div").filter(has=page.locator("label", has_text=label)).last
    return row.locator("xpath=..").locator("input.mantine-NumberInput-input")


def shown_time(page):
    """Where a log stands [s]."""
    return float(number_box(page, "time [s]").input_value())


def enter(page, label, number):
    """Types a number beside the slider of this label."""
    box = number_box(page, label)
    box.fill(str(number))
    box.press("Enter")


def enter_alone(page, label, number):
    """Types a number into the box of this label, which has no slider."""
    box = box_of(page, label)
    box.fill(str(number))
    box.press("Enter")


def box_of(page, label):
    """The box that this label stands before."""
    return page.locator("label").get_by_text(label, exact=True).locator("xpath=following::input[1]")


def pause(page):
    """Until the page tells, to the step, where it stopped."""
    browsing.click(page.get_by_role("button", name="pause", exact=True))
    page.locator("p", has_text=re.compile(r"· \d+\.\d\d s ·")).wait_for()


def begin_recording(page):
    """And lets two seconds go, from when the page tells that it records."""
    from playwright.sync_api import TimeoutError as NotSeenError  # may not be installed

    browsing.click(page.get_by_text("Recording", exact=True))
    record, save = (
        page.get_by_role("button", name=name, exact=True) for name in ("record", "end and save")
    )
    for _ in range(4):  # on a busy machine the browser may lose a click
        browsing.click(record)
        try:
            save.wait_for(timeout=60_000)
            break
        except NotSeenError:
            continue
    assert save.is_visible()
    begun = status(page)[2]
    wait_until(lambda: status(page)[2] > begun + 2.0)


def end_recording(page, folder):
    """The log that was saved."""
    browsing.click(page.get_by_role("button", name="end and save", exact=True))
    page.get_by_text("play the log with").first.wait_for()
    return Log.load(folder / "log-1.npz")


def gait_is(page, gait):
    return lambda: status(page)[0] == gait


@pytest.mark.slow
@browsing.needed
def test_alpha_on_the_page_decides_when_the_gait_shifts_and_a_push_is_felt(served, browser):
    """No feet differ by 0.3 m on this ground, and nearly all steps differ by 5 mm."""
    _, address = served("--track", "perlin:0.1@60")
    page, wrong = opened(browser, address, fine=True)
    enter_alone(page, "α [mm]", 300)
    enter_alone(page, "α' [mm]", 300)
    wait_until(gait_is(page, "trot"))
    walked = status(page)[1]
    wait_until(lambda: abs(status(page)[1] - walked) > 3.0)  # at the track's end it begins anew
    assert status(page)[0] == "trot"
    enter_alone(page, "α' [mm]", 1)
    enter_alone(page, "α [mm]", 5)
    wait_until(gait_is(page, "bound"))
    browsing.wait_for_robot(page, "view", columns=BESIDE_THE_PANEL)
    browsing.click(page.get_by_role("button", name="push", exact=True))
    clicked = status(page)[2]
    wait_until(lambda: abs(status(page)[2] - clicked) > 1.0)
    assert not wrong


@pytest.mark.slow
@browsing.needed
def test_the_clock_and_the_ground_are_in_the_hands_of_whoever_looks(served, browser):
    _, address = served("--track", "flat@200")
    page, wrong = opened(browser, address, fine=True)
    wait_until(lambda: status(page)[2] > 3.0)
    pause(page)
    stopped = status(page)[2]
    for step in range(1, 13):  # one after the other: a page may send two quick clicks as one
        browsing.click(
            page.get_by_role("radio", name="one step").or_(page.get_by_text("one step")).first
        )
        expected = pytest.approx(stopped + 0.01 * step, abs=1e-6)
        wait_until(lambda expected=expected: status(page)[2] == expected)
    browsing.click(page.get_by_text("restart", exact=True).first)
    wait_until(lambda: status(page)[2] == 0.01)
    browsing.click(page.get_by_role("button", name="go on", exact=True))
    wait_until(lambda: status(page)[2] > 1.0)
    browsing.click(page.get_by_text("Ground", exact=True))
    enter(page, "robots", 4)
    pause(page)
    browsing.click(page.get_by_role("button", name="walk there", exact=True))
    wait_until(lambda: status(page)[2] == 0.01)
    browsing.click(page.get_by_role("button", name="go on", exact=True))
    wait_until(lambda: status(page)[2] > 1.0)
    browsing.wait_for_robot(page, "ghosts", columns=BESIDE_THE_PANEL)
    assert not wrong


@pytest.mark.slow
@browsing.needed
def test_speed_stride_ground_pace_and_push_reach_the_robot(served, browser, tmp_path):
    """What the sliders order stands in the recorded log, or is felt by the robot in it."""
    _, address = served("--track", "perlin:0.1@300")
    page, wrong = opened(browser, address)
    page.get_by_label("shifts by itself").uncheck()
    browsing.click(page.get_by_role("button", name="trot", exact=True))
    wait_until(gait_is(page, "trot"))
    enter_alone(page, "α [mm]", 5)  # with which it would shift at once
    page.get_by_label("the gait's own speed and stride").uncheck()
    enter(page, "speed [m/s]", 0.8)
    enter(page, "stride [Hz]", 2.0)
    walked = status(page)[1]
    wait_until(lambda: status(page)[1] > walked + 3.0)
    assert status(page)[0] == "trot"

    browsing.click(page.get_by_text("Ground", exact=True))
    box_of(page, "track").fill("perlin:0.02@150")
    box_of(page, "seed").fill("7")
    pause(page)
    browsing.click(page.get_by_role("button", name="walk there", exact=True))
    wait_until(lambda: status(page)[2] == 0.01)
    browsing.click(page.get_by_role("button", name="go on", exact=True))
    begin_recording(page)
    enter(page, "force [N]", 200)
    browsing.click(box_of(page, "direction"))
    browsing.click(page.get_by_role("option", name="right", exact=True))
    browsing.click(page.get_by_role("button", name="push", exact=True))
    clicked = status(page)[2]
    wait_until(lambda: status(page)[2] > clicked + 1.0)
    log = end_recording(page, tmp_path / "recorded")
    assert log.terrain.startswith("perlin:0.02@150,")
    with_seed = {seed: from_spec(log.terrain, seed=seed, length=1.0, width=8.0) for seed in (0, 7)}
    assert np.allclose(log.terrain_height, with_seed[7].height, atol=1e-6)
    assert not np.allclose(log.terrain_height, with_seed[0].height, atol=1e-3)
    asked = log[-1].sensed
    assert asked.forward_speed_command[0] == pytest.approx(0.8, abs=1e-6)
    assert asked.yaw_rate_command[0] == pytest.approx(0.0, abs=0.5)
    assert asked.stride_frequency_command[0] == pytest.approx(2.0, abs=1e-6)
    to_the_right = -np.diff(log.truth.base_position_w[:, 0, 1]) / 0.01
    assert to_the_right.max() > max(0.5, 2 * np.abs(to_the_right[:150]).max()), "the push"

    enter(page, "times real time", 0.1)
    wait_until(lambda: 0.0 < times_real_time(page) < 0.15)
    assert not wrong


@pytest.mark.slow
@browsing.needed
def test_buttons_and_keys_drive_the_robot(served, browser, tmp_path):
    """A click or a key moves the sliders by a step, and what they say stands in the log."""
    _, address = served("--track", "flat@200")
    page, wrong = opened(browser, address)
    for name in ("faster", "left", "turn right", "higher"):
        browsing.click(page.get_by_role("button", name=name, exact=True))
    wait_until(lambda: float(number_box(page, "height from stance [m]").input_value()) > -0.03)
    assert not page.get_by_label("the gait's own speed and stride").is_checked()
    assert float(number_box(page, "speed [m/s]").input_value()) == pytest.approx(1.3)
    browsing.click(page.get_by_text("real time").first)  # no field of the page takes the keys
    for key in ("ArrowDown", "ArrowLeft", "ArrowLeft", "q"):
        page.keyboard.press(key)
    wait_until(lambda: float(number_box(page, "to the left [m/s]").input_value()) == 0.2)
    begin_recording(page)
    log = end_recording(page, tmp_path / "recorded")
    asked = log[-1].sensed
    assert asked.forward_speed_command[0] == pytest.approx(1.2, abs=1e-6)
    assert asked.lateral_speed_command[0] == pytest.approx(0.2, abs=1e-6)
    assert asked.body_height_command[0] == pytest.approx(-0.02, abs=1e-6)
    turned = np.unwrap(log.truth.yaw[:, 0])
    assert turned[-1] - turned[0] == pytest.approx(0.1 * np.ptp(log.time), abs=0.15)
    browsing.click(page.get_by_text("real time").first)
    page.keyboard.press("Space")
    wait_until(lambda: float(number_box(page, "speed [m/s]").input_value()) == 0.0)
    assert not wrong


def times_real_time(page):
    """How fast the robot's clock goes, measured over four seconds."""
    robots, ours = status(page)[2], time.monotonic()
    time.sleep(4.0)
    return (status(page)[2] - robots) / (time.monotonic() - ours)


@pytest.mark.slow
@browsing.needed
def test_a_click_records_a_log_and_a_page(served, browser, tmp_path):
    _, address = served("--track", "flat@200", "--robots", "2")
    page, wrong = opened(browser, address)
    begin_recording(page)
    log = end_recording(page, tmp_path / "recorded")
    assert log.n == 2
    assert len(log.time) > 150
    told = (tmp_path / "recorded" / "run-1.html").read_text()
    assert "<html" in told
    assert len(told) > 1e5
    assert not wrong


def settled(number):
    """What a number is once it has stayed the same for a second."""
    seen = []

    def stays():
        seen.append(number())
        return len(seen) > 1 and seen[-1] == seen[-2]

    wait_until(stays, pause=1.0)
    return seen[-1]


@pytest.mark.slow
@browsing.needed
def test_two_tabs_see_the_same_robot_and_a_machine_that_slept_does_not_hurry(served, browser):
    process, address = served("--track", "flat@200")
    one, wrong_in_one = opened(browser, address)
    other, wrong_in_other = opened(browser, address)
    browsing.click(one.get_by_role("button", name="pace", exact=True))
    wait_until(gait_is(other, "pace"))
    one.close()
    walked = status(other)[1]
    wait_until(lambda: status(other)[1] > walked + 0.5)
    process.send_signal(signal.SIGSTOP)  # the lid is closed
    time.sleep(5.0)
    before, woken = settled(lambda: status(other)[2]), time.monotonic()
    process.send_signal(signal.SIGCONT)
    wait_until(lambda: status(other)[2] > before + 4.0)
    assert status(other)[2] - before < time.monotonic() - woken + 1.0, "the five seconds are let go"
    assert not wrong_in_one
    assert not wrong_in_other


@pytest.mark.slow
@browsing.needed
def test_a_log_plays_in_the_browser_and_its_slider_is_obeyed(served, browser, tmp_path):
    run = live_run(track="flat@30", is_autonomous=False)
    run.record()
    walk(run, 6.0)
    run.end_recording().save(tmp_path / "log.npz")
    _, address = served(str(tmp_path / "log.npz"))
    page, wrong = opened(browser, address, fine=True)
    wait_until(lambda: 0.5 < shown_time(page) < 5.0)
    browsing.click(page.get_by_role("button", name="pause", exact=True))
    page.get_by_role("button", name="play", exact=True).wait_for()
    settled(lambda: shown_time(page))
    enter(page, "time [s]", 4.5)
    assert settled(lambda: shown_time(page)) == pytest.approx(4.5, abs=0.02), "it stands still"
    browsing.wait_for_robot(page, "replay", columns=BESIDE_THE_PANEL)
    browsing.click(page.get_by_role("button", name="play", exact=True))
    wait_until(lambda: abs(shown_time(page) - 4.5) > 0.3)
    assert not wrong
