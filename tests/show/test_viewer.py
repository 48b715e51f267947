"""Pages in the browser: the robots behind them, what is drawn, and the pages themselves."""

import json
import re
import signal
import socket
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

import browsing
from gaitshift.cli import main
from gaitshift.control import policy
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.log import Log
from gaitshift.shift import load_condition
from gaitshift.show.geometry import frames_of
from gaitshift.show.viewer.charts import contact_svg, counter, foot_heights, machine_svg
from gaitshift.show.viewer.live import LiveConfig, LiveRun
from gaitshift.show.viewer.panels import with_amplitude
from gaitshift.show.viewer.tape import WINDOW, Tape
from gaitshift.sim.terrain import from_spec
from waiting import PATIENCE, wait_until

TRACK = "flat@3,perlin:0.12@5,flat@2"

BESIDE_THE_PANEL = 2 / 3
"""Share of a page's columns that the panel on its right leaves free."""


@pytest.fixture(scope="module")
def policies():
    return {name: policy.load(name) for name in ("trot", "bound", "pace")}


def walk(run, seconds):
    frames = [run.step()]
    while frames[-1].time < seconds - 1e-9 and not run.is_over:
        frames.append(run.step())
    return frames


# Whether a page keeps real time -----------------------------------------------------------------


def test_a_page_walks_no_faster_than_time_and_draws_every_second_step(capsys):
    main(["bench", "page", "--page-seconds", "2", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["robots_1", "robots_16"]
    for figures in found.values():
        assert 0.1 < figures["real_time"] <= 1.02
        assert figures["pictures_per_s"] == pytest.approx(50 * figures["real_time"])
        assert 0.0 < figures["core_share"] <= 1.05
    one, many = found.values()
    assert 0.05 < one["sent_mb_per_s"] < many["sent_mb_per_s"]


def test_a_page_for_no_time_is_refused(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["bench", "page", "--page-seconds", "0"])
    assert "1 to 3600" in capsys.readouterr().err


# Robots that walk now -----------------------------------------------------------------------------


def test_a_live_robot_does_what_the_demonstrations_robot_does(policies):
    """The demonstration is a rollout of its own, with the same ground, start and condition."""
    config = DemoConfig(track=TRACK, seed=3, beta=80.0)
    log, _ = run_demo(config, {gait: policies[gait] for gait in config.used})
    condition = load_condition(config.condition, beta=80.0)
    run = LiveRun(LiveConfig(track=TRACK, seed=3, condition=condition), policies)
    frames = walk(run, 5.0)
    names = [run.gaits[int(frame.gait[0])] for frame in frames]
    assert names == [log.gaits[g] for g in log.gait[: len(names), 0]]
    assert "bound" in names
    ours, theirs = np.array([f.qpos[0] for f in frames]), log.qpos[: len(frames), 0]
    np.testing.assert_allclose(ours, theirs, atol=1e-5)
    np.testing.assert_allclose([f.k[0] for f in frames], log.k[: len(frames), 0])


@pytest.mark.learned
def test_alpha_acts_at_once_and_the_count_goes_on_from_where_it_was(policies):
    run = LiveRun(LiveConfig(track="perlin:0.12@20"), policies)
    before = next(frame for frame in iter(run.step, None) if frame.k[0] > 20)
    run.change(replace(run.config, condition=replace(run.config.condition, alpha=2.0)))
    after = walk(run, before.time + 1.0)
    assert {float(frame.k[0]) for frame in after} == {float(before.k[0])}, "no feet differ by 2 m"
    run.change(
        replace(run.config, condition=replace(run.config.condition, beta=float(before.k[0])))
    )
    run.change(replace(run.config, condition=replace(run.config.condition, alpha=0.01)))
    assert any(run.gaits[int(f.gait[0])] == "bound" for f in walk(run, after[-1].time + 0.5))


def test_robots_that_are_not_to_shift_do_not_and_take_the_gait_they_are_given(policies):
    run = LiveRun(LiveConfig(track="perlin:0.12@20", is_autonomous=False, robots=3), policies)
    frames = walk(run, 3.0)
    assert {int(g) for frame in frames for g in frame.gait} == {run.gaits.index("trot")}
    assert frames[-1].threshold.tolist() == [0.0, 0.0, 0.0]
    run.take("pace")
    assert run.step().gait.tolist() == [run.gaits.index("pace")] * 3


@pytest.mark.learned
def test_a_push_moves_the_robot_its_way_and_no_further_than_a_free_body_of_its_mass(policies):
    """90 N for 0.2 s on 30.5 kg, then 0.1 s more: a t² / 2 + a t · 0.1 s = 0.118 m in flight."""
    config = LiveConfig(track="flat@30", is_autonomous=False)
    quiet, pushed = (LiveRun(config, policies) for _ in range(2))
    walk(quiet, 2.0), walk(pushed, 2.0)
    pushed.push(90.0, np.pi / 2)
    sideways = [
        (b.qpos[0, 1] - a.qpos[0, 1])
        for a, b in zip(walk(quiet, 2.3), walk(pushed, 2.3), strict=True)
    ]
    assert sideways[0] == pytest.approx(0.0, abs=1e-3)
    assert 0.02 < sideways[-1] < 0.118


def test_a_run_is_over_at_the_end_of_the_track_or_after_a_fall(policies):
    run = LiveRun(LiveConfig(track="flat@3", is_autonomous=False), policies)
    frames = walk(run, 10.0)
    assert run.is_over
    assert frames[-1].qpos[0, 0] == pytest.approx(3.0, abs=0.05)
    run.restart(replace(run.config, track="flat@60"))
    assert not run.is_over
    walk(run, 1.0)
    run._walk.fallen[0] = True
    frames = walk(run, 10.0)
    fell = next(frame.time for frame in frames if frame.fallen[0])
    assert frames[-1].time == pytest.approx(fell + 2.0, abs=0.03)


@pytest.mark.learned
def test_another_speed_is_walked_without_beginning_anew(policies):
    run = LiveRun(LiveConfig(track="flat@30", is_autonomous=False), policies)
    walk(run, 2.0)
    run.change(replace(run.config, speed=0.6, stride_frequency=2.0))
    frames = walk(run, 6.0)
    assert frames[0].time > 2.0
    assert np.mean([frame.speed[0] for frame in frames[200:]]) == pytest.approx(0.6, abs=0.08)


def test_what_was_recorded_is_a_log_of_what_was_seen(policies, tmp_path):
    run = LiveRun(LiveConfig(track=TRACK, robots=2), policies)
    walk(run, 1.0)
    assert run.end_recording() is None
    run.record()
    seen = walk(run, 1.5)
    log = run.end_recording()
    assert not run.is_recording
    log.save(tmp_path / "log.npz")
    again = frames_of(Log.load(tmp_path / "log.npz"), 1)
    assert len(again) == len(seen) == 50
    for one, other in zip(again, seen, strict=True):
        for name in ("qpos", "contact", "k", "threshold", "gait", "speed", "foot_height"):
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), atol=1e-5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"robots": 17}, "1 to 16"),
        ({"seed": -1}, "0 or larger"),
        ({"track": "moon@3"}, "moon"),
        ({"rough_gait": "walk"}, "got 'walk'"),
    ],
)
def test_what_cannot_be_had_is_refused_and_all_stays_as_it_was(policies, change, message):
    run = LiveRun(LiveConfig(track="flat@5"), policies)
    before = walk(run, 0.2)[-1]
    with pytest.raises(GaitshiftError, match=re.escape(message)):
        run.restart(replace(run.config, **change))
    assert run.step().time == pytest.approx(before.time + 0.01)


def test_only_noise_is_made_higher():
    track = "flat@8, perlin:0.10@12,slope:5@3,perlin:0.2@4"
    assert with_amplitude(track, 0.05) == "flat@8,perlin:0.050@12,slope:5@3,perlin:0.050@4"
    from_spec(with_amplitude(track, 0.05), seed=0, length=1.0, width=4.0)


# What is drawn ------------------------------------------------------------------------------------


def test_a_tape_keeps_the_window_and_forgets_what_lies_ahead(policies):
    run, tape = LiveRun(LiveConfig(track="flat@40"), policies), Tape()
    frames = walk(run, WINDOW + 1.0)
    for frame in frames:
        tape.add(frame)
    time_ = tape.of("time")
    assert (time_[-1], len(time_)) == (pytest.approx(WINDOW + 1.0), round(100 * WINDOW) + 1)
    tape.add(frames[400])
    assert tape.of("time")[-1] == frames[400].time
    assert (np.diff(tape.of("time")) > 0).all()


def test_the_diagram_has_a_bar_for_each_time_that_a_foot_is_down(policies):
    run, tape = LiveRun(LiveConfig(track="flat@40", is_autonomous=False), policies), Tape()
    for frame in walk(run, 4.0):
        tape.add(frame)
    contact = tape.of("contact").astype(int)
    stances = int((np.diff(contact, axis=0) > 0).sum() + contact[0].sum())
    svg = contact_svg(tape, ("#111111", "#222222", "#333333"))
    bars = re.findall(r'width="([\d.]+)" height="12" fill="#111111"', svg)
    assert len(bars) == stances > 20
    # 300 units are the window.
    assert sum(map(float, bars)) == pytest.approx(300 * contact.sum() / 100 / WINDOW, rel=0.05)


@pytest.mark.parametrize("name", gaits.names())
def test_the_present_state_of_the_machine_is_lit(name):
    machine = gaits.load(name)
    for state, one in enumerate(machine.states):
        svg = machine_svg(machine, state, "#123456")
        (lit,) = re.findall(r'fill="#123456".*?>([A-Z a-z]+)</text>', svg)
        assert set(lit.split()) == (set(one.stance) or {"no", "foot"})
        assert svg.count("<g>") == len(machine.states)


def test_the_chart_of_k_marks_shifts_where_they_are_and_nowhere_else(policies):
    run, tape = LiveRun(LiveConfig(track="flat@40", is_autonomous=False), policies), Tape()
    for _ in range(40):
        tape.add(run.step())
    run.take("bound")
    for _ in range(40):
        tape.add(run.step())
    _, _, shift = counter(tape)
    assert np.flatnonzero(shift).tolist() == [40]


def test_the_chart_of_heights_is_silent_of_feet_that_have_not_touched(policies):
    run, tape = LiveRun(LiveConfig(track="flat@40"), policies), Tape()
    for _ in range(60):
        tape.add(run.step())
    touched = np.logical_or.accumulate(tape.of("contact"), axis=0)
    assert not touched[0].all()
    assert touched[-1].all()
    heights = foot_heights(tape)
    assert np.array_equal(np.isfinite(heights), touched)
    assert (heights[touched] < -0.3).all(), "below the base"


# The command --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nowhere.npz"], "no log file nowhere.npz"),
        (["--robots", "40"], "1 to 16"),
        (["--condition", "guess"], "unknown condition 'guess'"),
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
    """A page on the address, and what went wrong on it.

    To draw in software takes most of a page's time, so that those are coarse that nobody looks at.
    """
    page, wrong = browsing.opened(browser, address, device_scale_factor=1.0 if fine else 0.25)
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
    page.get_by_role("button", name="pace", exact=True).click()
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


def box_of(page, label):
    """The box that this label stands before."""
    return page.locator("label").get_by_text(label, exact=True).locator("xpath=following::input[1]")


def pause(page):
    """Until the page tells, to the step, where it stopped."""
    page.get_by_role("button", name="pause", exact=True).click()
    page.locator("p", has_text=re.compile(r"· \d+\.\d\d s ·")).wait_for()


def begin_recording(page):
    """And lets two seconds go."""
    page.get_by_text("Recording", exact=True).click()
    page.get_by_role("button", name="record", exact=True).click()
    begun = status(page)[2]
    wait_until(lambda: status(page)[2] > begun + 2.0)


def end_recording(page, folder):
    """The log that was saved."""
    page.get_by_role("button", name="end and save", exact=True).click()
    page.get_by_text("opens from disk").first.wait_for()
    return Log.load(folder / "log-1.npz")


def gait_is(page, gait):
    return lambda: status(page)[0] == gait


@pytest.mark.slow
@browsing.needed
def test_alpha_on_the_page_decides_when_the_gait_shifts_and_a_push_is_felt(served, browser):
    """No feet differ by 0.3 m on this ground, and nearly all steps differ by 5 mm."""
    _, address = served("--track", "perlin:0.1@300")
    page, wrong = opened(browser, address, fine=True)
    enter(page, "α [m]", 0.3)
    enter(page, "α' [m]", 0.3)
    wait_until(gait_is(page, "trot"))
    walked = status(page)[1]
    wait_until(lambda: status(page)[1] > walked + 3.0)
    assert status(page)[0] == "trot"
    enter(page, "α' [m]", 0.001)
    enter(page, "α [m]", 0.005)
    wait_until(gait_is(page, "bound"))
    browsing.wait_for_robot(page, "view", columns=BESIDE_THE_PANEL)
    page.get_by_role("button", name="push", exact=True).click()
    clicked = status(page)[2]
    wait_until(lambda: status(page)[2] > clicked + 1.0)
    assert not wrong


@pytest.mark.slow
@browsing.needed
def test_the_clock_and_the_ground_are_in_the_hands_of_whoever_looks(served, browser):
    _, address = served("--track", "flat@200")
    page, wrong = opened(browser, address, fine=True)
    wait_until(lambda: status(page)[2] > 3.0)
    pause(page)
    stopped = status(page)[2]
    for _ in range(12):
        page.get_by_role("radio", name="one step").or_(page.get_by_text("one step")).first.click()
    wait_until(lambda: status(page)[2] == pytest.approx(stopped + 0.12, abs=1e-6))
    page.get_by_text("restart", exact=True).first.click()
    wait_until(lambda: status(page)[2] == 0.01)
    page.get_by_role("button", name="go on", exact=True).click()
    wait_until(lambda: status(page)[2] > 1.0)
    page.get_by_text("Ground", exact=True).click()
    enter(page, "robots", 4)
    pause(page)
    page.get_by_role("button", name="walk there", exact=True).click()
    wait_until(lambda: status(page)[2] == 0.01)
    page.get_by_role("button", name="go on", exact=True).click()
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
    page.get_by_role("button", name="trot", exact=True).click()
    wait_until(gait_is(page, "trot"))
    enter(page, "α [m]", 0.005)  # with which it would shift at once
    page.get_by_label("the gait's own speed and stride").uncheck()
    enter(page, "speed [m/s]", 0.8)
    enter(page, "stride [Hz]", 2.0)
    walked = status(page)[1]
    wait_until(lambda: status(page)[1] > walked + 3.0)
    assert status(page)[0] == "trot"

    page.get_by_text("Ground", exact=True).click()
    box_of(page, "track").fill("perlin:0.02@150")
    box_of(page, "seed").fill("7")
    pause(page)
    page.get_by_role("button", name="walk there", exact=True).click()
    wait_until(lambda: status(page)[2] == 0.01)
    page.get_by_role("button", name="go on", exact=True).click()
    begin_recording(page)
    enter(page, "force [N]", 200)
    box_of(page, "direction").click()
    page.get_by_role("option", name="right", exact=True).click()
    page.get_by_role("button", name="push", exact=True).click()
    clicked = status(page)[2]
    wait_until(lambda: status(page)[2] > clicked + 1.0)
    log = end_recording(page, tmp_path / "recorded")
    assert log.terrain.startswith("perlin:0.02@150,")
    with_seed = {seed: from_spec(log.terrain, seed=seed, length=1.0, width=8.0) for seed in (0, 7)}
    assert np.allclose(log.terrain_height, with_seed[7].height, atol=1e-6)
    assert not np.allclose(log.terrain_height, with_seed[0].height, atol=1e-3)
    assert np.allclose(log.command[-1, 0], [0.8, 0.0, 2.0], atol=[1e-6, 0.5, 1e-6])
    to_the_right = -log.qvel[:, 0, 1]
    assert to_the_right.max() > max(0.5, 2 * np.abs(to_the_right[:150]).max()), "the push"

    enter(page, "times real time", 0.1)
    wait_until(lambda: 0.0 < times_real_time(page) < 0.15)
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
    assert log.k.shape[1] == 2
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
    one.get_by_role("button", name="pace", exact=True).click()
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
def test_a_log_plays_in_the_browser_and_its_slider_is_obeyed(served, browser, policies, tmp_path):
    run = LiveRun(LiveConfig(track="flat@30", is_autonomous=False), policies)
    run.record()
    walk(run, 6.0)
    run.end_recording().save(tmp_path / "log.npz")
    _, address = served(str(tmp_path / "log.npz"))
    page, wrong = opened(browser, address, fine=True)
    wait_until(lambda: 0.5 < shown_time(page) < 5.0)
    page.get_by_role("button", name="pause", exact=True).click()
    page.get_by_role("button", name="play", exact=True).wait_for()
    settled(lambda: shown_time(page))
    enter(page, "time [s]", 4.5)
    assert settled(lambda: shown_time(page)) == pytest.approx(4.5, abs=0.02), "it stands still"
    browsing.wait_for_robot(page, "replay", columns=BESIDE_THE_PANEL)
    page.get_by_role("button", name="play", exact=True).click()
    wait_until(lambda: abs(shown_time(page) - 4.5) > 0.3)
    assert not wrong
