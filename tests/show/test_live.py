"""Robots that walk on a page: they follow its controls, and a recording shows what was drawn."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.evaluation import DemoConfig, run_demo
from gaitshift.lab.log import Log
from gaitshift.show.geometry import frames_of
from gaitshift.show.viewer import server
from gaitshift.show.viewer.panels import with_amplitude
from gaitshift.sim.terrain import from_spec
from walking import live_run, walk

TRACK = "flat@3,perlin:0.12@5,flat@2"


# Whether a page keeps real time -----------------------------------------------------------------


@pytest.mark.slow
def test_a_page_walks_no_faster_than_time_and_draws_every_second_step(capsys):
    main(["bench", "page", "--page-seconds", "2", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["robots_1", "robots_16"]
    for figures in found.values():
        assert figures["real_time"] <= 1.02
        # Not 0.1 of a second walked in a second: neighbours may leave the page less of a core.
        assert figures["real_time"] > 0.1 * figures["core_share"]
        assert figures["pictures_per_s"] == pytest.approx(50 * figures["real_time"])
        assert 0.0 < figures["core_share"] <= 1.05
    one, many = found.values()
    one, many = (of["sent_mb_per_s"] / of["real_time"] for of in (one, many))  # a second walked
    assert 0.05 < one < many


@pytest.mark.parametrize(
    ("cost", "pace"),
    [(0.0, 1.0), (0.015, 1.0), (0.04, 0.5), (2.0, 0.01)],
    ids=["free", "in time", "twice too slow", "far too slow"],
)
def test_pictures_come_at_real_time_or_as_fast_as_they_are_drawn(monkeypatch, cost, pace):
    """On a clock of the test's own: a picture is due each 20 ms, and costs so much to draw [s]."""
    now = [0.0]
    monkeypatch.setattr(server.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(server.time, "sleep", lambda wait: now.__setitem__(0, now[0] + wait))
    clock = server.Clock()
    for _ in range(1000):
        now[0] += cost
        clock.wait()
    assert 1000 * server.TICK / now[0] == pytest.approx(pace)


def test_a_picture_that_comes_late_is_made_up_for_up_to_a_quarter_of_a_second(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(server.time, "perf_counter", lambda: now[0])
    monkeypatch.setattr(server.time, "sleep", lambda wait: now.__setitem__(0, now[0] + wait))
    for late, over in [(0.2, 0.0), (3.0, 3.0 - server.TICK)]:  # the late one was due itself
        now[0] = 0.0
        clock = server.Clock()
        for picture in range(1000):
            now[0] += late if picture == 500 else 0.0
            clock.wait()
        assert now[0] == pytest.approx(1000 * server.TICK + over)


def test_a_page_for_no_time_is_refused(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["bench", "page", "--page-seconds", "0"])
    assert "1 to 3600" in capsys.readouterr().err


# Robots that walk now -----------------------------------------------------------------------------


def test_a_live_robot_does_what_the_demonstrations_robot_does():
    """The demonstration is a rollout of its own, with the same ground, start and graph.

    Its log is in single precision.
    """
    config = DemoConfig(track=TRACK, seed=3, beta=80.0)
    log, _ = run_demo(config)
    run = live_run(track=TRACK, seed=3, numbers={"beta": 80.0})
    frames = walk(run, 5.0)
    names = [run.gaits[int(frame.step.gait[0])] for frame in frames]
    assert names == [log.gaits[g] for g in log.gait[: len(names), 0]]
    assert "bound" in names
    ours, theirs = np.array([f.step.qpos[0] for f in frames]), log.qpos[: len(frames), 0]
    np.testing.assert_allclose(ours, theirs, atol=1e-5)
    np.testing.assert_allclose([f.step.k[0] for f in frames], log.k[: len(frames), 0])


@pytest.mark.learned
def test_alpha_acts_at_once_and_the_count_goes_on_from_where_it_was():
    run = live_run(track="perlin:0.12@20", condition="height_difference")
    before = next(frame for frame in iter(run.step, None) if frame.step.k[0] > 20)
    k = float(before.step.k[0])
    run.change(replace(run.config, numbers={"alpha": 2.0}))
    after = walk(run, before.time + 1.0)
    assert {float(frame.step.k[0]) for frame in after} == {k}, "no feet differ by 2 m"
    run.change(replace(run.config, numbers={"alpha": 2.0, "beta": k}))
    run.change(replace(run.config, numbers={"alpha": 0.01, "beta": k}))
    assert any(run.gaits[int(f.step.gait[0])] == "bound" for f in walk(run, after[-1].time + 0.5))


def test_robots_that_are_not_to_shift_do_not_and_take_the_gait_they_are_given():
    run = live_run(track="perlin:0.12@20", is_autonomous=False, robots=3)
    frames = walk(run, 3.0)
    assert {int(g) for frame in frames for g in frame.step.gait} == {run.gaits.index("trot")}
    assert frames[-1].step.threshold.tolist() == [0.0, 0.0, 0.0]
    run.take("pace")
    assert run.step().step.gait.tolist() == [run.gaits.index("pace")] * 3


@pytest.mark.learned
def test_a_push_moves_the_robot_its_way_and_no_further_than_a_free_body_of_its_mass():
    """90 N for 0.2 s on 30.5 kg, then 0.1 s more: a t² / 2 + a t · 0.1 s = 0.118 m in flight."""
    config = {"track": "flat@30", "is_autonomous": False}
    quiet, pushed = (live_run(**config) for _ in range(2))
    walk(quiet, 2.0), walk(pushed, 2.0)
    pushed.push(90.0, np.pi / 2)
    sideways = [
        b.step.truth.base_position_w[0, 1] - a.step.truth.base_position_w[0, 1]
        for a, b in zip(walk(quiet, 2.3), walk(pushed, 2.3), strict=True)
    ]
    assert sideways[0] == pytest.approx(0.0, abs=1e-3)
    assert 0.02 < sideways[-1] < 0.118


def test_a_run_is_over_at_the_end_of_the_track_or_after_a_fall():
    run = live_run(track="flat@3", is_autonomous=False)
    frames = walk(run, 10.0)
    assert run.is_over
    assert frames[-1].step.truth.base_position_w[0, 0] == pytest.approx(3.0, abs=0.05)
    run.restart(replace(run.config, track="flat@60"))
    assert not run.is_over
    walk(run, 1.0)
    run._walk.fallen[0] = True
    frames = walk(run, 10.0)
    fell = next(frame.time for frame in frames if frame.step.fallen[0])
    assert frames[-1].time == pytest.approx(fell + 2.0, abs=0.03)


@pytest.mark.learned
def test_another_speed_is_walked_without_beginning_anew():
    run = live_run(track="flat@30", is_autonomous=False)
    walk(run, 2.0)
    run.change(replace(run.config, speed=0.6, stride_frequency=2.0))
    frames = walk(run, 6.0)
    assert frames[0].time > 2.0
    speed = np.mean([frame.step.truth.forward_speed[0] for frame in frames[200:]])
    assert speed == pytest.approx(0.6, abs=0.08)


def test_what_was_recorded_is_a_log_of_what_was_seen(tmp_path):
    run = live_run(track=TRACK, robots=2)
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
        assert one.time == pytest.approx(other.time, abs=1e-5)
        for mine, theirs in zip(_arrays(one), _arrays(other), strict=True):
            np.testing.assert_allclose(mine, theirs, atol=1e-5)
        touched = np.isfinite(one.touch_height)  # since the recording began
        np.testing.assert_allclose(
            one.touch_height[touched], other.touch_height[touched], atol=1e-5
        )
    assert touched.all()


def _arrays(frame):
    step = frame.step
    speed = step.truth.forward_speed
    return step.qpos, step.sensed.contact, step.k, step.threshold, step.gait, speed


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"robots": 17}, "1 to 16"),
        ({"seed": -1}, "0 or larger"),
        ({"track": "moon@3"}, "moon"),
        ({"rough_gait": "walk"}, "got 'walk'"),
    ],
)
def test_what_cannot_be_had_is_refused_and_all_stays_as_it_was(change, message):
    run = live_run(track="flat@5")
    before = walk(run, 0.2)[-1]
    with pytest.raises(GaitshiftError, match=re.escape(message)):
        run.restart(replace(run.config, **change))
    assert run.step().time == pytest.approx(before.time + 0.01)


def test_only_noise_is_made_higher():
    track = "flat@8, perlin:0.10@12,slope:5@3,perlin:0.2@4"
    assert with_amplitude(track, 0.05) == "flat@8,perlin:0.050@12,slope:5@3,perlin:0.050@4"
    from_spec(with_amplitude(track, 0.05), seed=0, length=1.0, width=4.0)
