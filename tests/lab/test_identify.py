"""`gaitshift record` and `gaitshift identify`: robots whose right answer is known by hand."""

import csv
import json
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification import auc, log_files
from gaitshift.lab.identification.candidates import CANDIDATES
from gaitshift.lab.identification.classifier import Examples, RoughnessClassifier
from gaitshift.lab.identification.judging import judge, replay_rules
from gaitshift.lab.identification.kept import EXAMPLES, REPLAYED, TRIED
from gaitshift.lab.identification.passage import passage_scores
from gaitshift.lab.identification.statistics import auc_interval
from gaitshift.lab.identification.step_cache import StepCache
from gaitshift.lab.identification.tuning import as_given, try_grids, tune
from gaitshift.shift import HeightDifference, PlaneResidual, Rule, TouchdownSurprise
from marches import march, table, walk


def backwards(run):
    """The same steps from the last to the first."""
    sensed = replace(run.sensed[::-1], time=run.sensed.time)
    return replace(run, sensed=sensed, rough=run.rough[::-1].copy())


def tuned_by(candidates, recordings, way):
    return tune(candidates, try_grids(candidates, recordings, way))


def judged_by(tuned, recordings):
    return judge(tuned, replay_rules(tuned, recordings))


def ways():
    return [march("flat", noise=0.0), march("into", noise=0.04, seed=1)]


def height_candidates():
    return [c for c in CANDIDATES if c.name in ("height_difference", "plane_residual")]


# Tuning and judging -------------------------------------------------------------------------------


def time_to_fire(tuned):
    """Until a robot fires whose values are all beyond α [s], step by step."""
    pairs = {"height_difference": 6, "plane_residual": 1}[tuned.candidate.name]
    k, steps = np.zeros(1), 0
    while not tuned.rule.fires(k, np.ones(1))[0]:
        k, steps = tuned.rule.step(k, np.full((1, pairs), 9.0)), steps + 1
    return 0.01 * steps


def test_numbers_that_are_chosen_notice_noise_and_keep_still_on_smooth_ground():
    """Touches differ by 2 mm at most on smooth ground, by 8 cm on rough: α lies in between."""
    tuned = tuned_by(height_candidates(), ways(), way="rough")
    for one, judged in zip(tuned, judged_by(tuned, ways()), strict=True):
        assert one.choice.is_free
        tallies = {course.course: course.tally for course in judged.courses}
        assert tallies["flat"].fired[0, 0] == 0
        assert tallies["into"].detected[0, 0] == tallies["into"].came[0, 0] == 3
        assert 0.0 <= max(judged.courses[1].delays_m) < 1.5, "a stride is half a metre"
        area = judged.area("into")
        assert area is not None
        assert area[0] == 1.0
        assert judged.area("flat") is None, "nothing to notice there"
        assert judged.soonest == pytest.approx(time_to_fire(one))
        way = sum(float(way.distance[-1].sum()) for way in ways())
        time = sum(len(way.time) * way.period * way.robots for way in ways())
        assert judged.speed == pytest.approx(way / time)
    assert 0.002 < tuned[0].choice.alpha < 0.08


def test_values_computed_in_one_pass_are_those_of_each_statistic_alone():
    statistics = HeightDifference(), TouchdownSurprise(), PlaneResidual()
    together = march("into", noise=0.04)
    together.compute(statistics)
    for statistic in statistics:
        alone = march("into", noise=0.04).values(statistic)
        np.testing.assert_array_equal(together.values(statistic), alone)


def test_judging_replays_what_a_live_condition_does():
    """The delays of the report are those of the rule itself, step by step."""
    (tuned,) = tuned_by(height_candidates()[:1], ways(), way="rough")
    (judged,) = judged_by([tuned], ways())
    recording = ways()[1]
    values, rule = tuned.candidate.values(recording), tuned.rule
    expected = []
    for robot in range(recording.robots):
        k = np.zeros(1)
        for t in range(len(recording.time)):
            k = rule.step(k, values[t, robot : robot + 1])
            if rule.fires(k, np.ones(1))[0]:
                entry = recording.rough[:, robot].argmax()
                expected.append(recording.distance[t, robot] - recording.distance[entry, robot])
                break
    assert sorted(judged.courses[1].delays_m) == pytest.approx(sorted(expected))


def test_numbers_that_are_given_are_judged_as_those_that_are_chosen():
    tuned = tuned_by(height_candidates()[:1], ways(), way="rough")
    chosen = tuned[0].choice
    numbers = {"alpha": chosen.alpha, "beta": chosen.beta, "leak": chosen.leak}
    given = as_given(height_candidates()[:1], way="rough", **numbers)
    by_choice, by_hand = (judged_by(those, ways())[0].courses for those in (tuned, given))
    assert [c.delays_m for c in by_hand] == [c.delays_m for c in by_choice]
    assert by_hand[1].tally.detected[0, 0] == 3
    # No two of the feet differ by 20 cm where the noise is of 4 cm.
    (far,) = judged_by(as_given(height_candidates()[:1], way="rough", alpha=0.2, beta=0.0), ways())
    assert far.courses[1].tally.came[0, 0] == 3
    assert far.courses[1].tally.detected[0, 0] == 0


def test_the_way_back_notices_that_rough_ground_has_ended():
    def out():
        return [backwards(march("out-of", noise=0.04, seed=2))]

    (tuned,) = tuned_by(height_candidates()[:1], out(), way="flat")
    assert tuned.rule.when == "below"
    (judged,) = judged_by([tuned], out())
    assert judged.courses[0].tally.detected[0, 0] == 3
    assert judged.courses[0].tally.fired[0, 0] == 0


def test_on_the_way_back_an_oracle_notices_the_very_step_in_which_rough_ground_ends():
    def out():
        return [backwards(march("out-of", noise=0.04, seed=2))]

    tuned = tuned_by([c for c in CANDIDATES if c.name == "oracle"], out(), way="flat")
    (judged,) = judged_by(tuned, out())
    assert judged.courses[0].tally.fired[0, 0] == 0
    assert judged.courses[0].delays_m == pytest.approx([0.0] * 3)


def test_a_condition_whose_signals_are_missing_is_left_out():
    slip = [c for c in CANDIDATES if c.name in ("slip", "height_difference")]
    assert [t.candidate.name for t in tuned_by(slip, ways(), way="rough")] == ["height_difference"]


# Passages -----------------------------------------------------------------------------------------


def test_passages_are_cut_at_their_length_at_the_border_and_at_a_fall():
    """4 m smooth and 8 m rough: one whole passage of 3 m, then two; after a fall none."""
    recording = march("into", noise=0.04, robots=1)
    values = np.ones((len(recording.time), 1, 1))
    rule, alphas = Rule(alpha=1.0, beta=50.0), np.array([0.5, 2.0])
    scores = passage_scores(recording, values, rule, alphas)
    assert scores == {False: [1], True: [1, 1]}, "of the two α only 0.5 lies below 1"
    patient = replace(rule, beta=299.5)
    assert passage_scores(recording, values, patient, alphas) == {False: [1], True: [1, 1]}
    too_patient = replace(rule, beta=310.0)
    assert passage_scores(recording, values, too_patient, alphas) == {False: [0], True: [0, 0]}
    alive = recording.alive.copy()
    alive[750:] = False
    fallen = passage_scores(replace(recording, alive=alive), values, rule, alphas)
    assert fallen == {False: [1], True: [1]}


def test_the_interval_of_an_area_is_wide_where_trials_are_few():
    low, high = auc_interval(1.0, 30, 2000)
    assert high == pytest.approx(1.0)
    assert low == pytest.approx(1.0 - 1.96**2 / (30 + 1.96**2), abs=1e-3), "Wilson's, at 30 of 30"


# The commands -------------------------------------------------------------------------------------


@pytest.mark.slow
def test_identify_writes_a_report_of_anybodys_log(tmp_path, capsys):
    logs = [str(table(tmp_path / f"walk{seed}.csv", walk(seed))) for seed in range(2)]
    out = tmp_path / "report"
    command = ["identify", *logs, "--condition", "all", "--out", str(out), "--json"]
    main(command)
    rows = json.loads(capsys.readouterr().out)["conditions"]
    names = [row["condition"] for row in rows]
    wanted = {"paper", "height_difference", "touchdown_surprise", "oracle", "classifier"}
    assert wanted <= set(names)
    assert "slip" not in names, "the table has no velocity"
    readme = (out / "README.md").read_text()
    for name in names:
        assert f"## {name}" in readme
        assert (out / f"{name}.png").stat().st_size < 300_000
    assert "the same logs" in readme.lower()
    with (out / "courses.csv").open() as file:
        assert len(list(csv.DictReader(file))) == len(names) * len(logs)
    with pytest.raises(SystemExit) as end:
        main(command)
    assert end.value.code == 2, "a report that is there is not overwritten unasked"
    assert "--overwrite" in capsys.readouterr().err


def test_identify_judges_numbers_that_are_given(tmp_path, capsys):
    log = str(table(tmp_path / "walk.csv", walk()))
    command = ["identify", log, "--condition", "paper", "--alpha", "0.2", "--beta", "1000"]
    main([*command, "--out", str(tmp_path / "report"), "--json"])
    (row,) = json.loads(capsys.readouterr().out)["conditions"]
    assert (row["alpha"], row["beta"], row["leak"], row["keeps_still"]) == (0.2, 1000.0, 0.0, None)
    assert (row["came"], row["detected"]) == (1, 0)
    readme = (tmp_path / "report" / "README.md").read_text()
    assert "with the given α, β and leak" in readme
    assert "same logs" not in readme


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "record"),
        (["nowhere.npz"], "no log file nowhere.npz"),
        (["README.md"], ".npz"),
        (["{log}", "--condition", "guess"], "got 'guess'"),
        (["{log}", "--condition", "slip"], "lack the signals"),
        (["{smooth}"], "must contain rough ground"),
        (["{log}", "--alpha", "0.2"], "--beta"),
        (["{log}", "--leak", "1"], "--alpha and --beta"),
        (["{log}", "--alpha", "-1", "--beta", "3"], "alpha must be above 0"),
        (
            ["{log}", "--alpha", "1", "--beta", "3", "--condition", "all"],
            "--alpha must be given with named",
        ),
    ],
)
def test_bad_input_of_identify_is_one_line_and_code_2(tmp_path, capsys, arguments, message):
    logs = {
        "log": table(tmp_path / "walk.csv", walk()),
        "smooth": table(tmp_path / "flat.csv", march("flat", noise=0.0, robots=1)),
    }
    given = [argument.format(**logs) for argument in arguments]
    with pytest.raises(SystemExit) as end:
        main(["identify", *given, "--out", str(tmp_path / "report")])
    assert end.value.code == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert message in error
    made = [path for path in (tmp_path / "report").rglob("*") if "unfinished" not in path.parts]
    assert not made, "but what was found out of single logs"


# Going on -----------------------------------------------------------------------------------------


@pytest.fixture
def two_logs(tmp_path):
    return [table(tmp_path / f"walk-{i}.csv", walk(seed)) for i, seed in enumerate((0, 5))]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The report of `two_logs` by a run that nothing stopped."""
    folder = tmp_path_factory.mktemp("whole")
    logs = [table(folder / f"walk-{i}.csv", walk(seed)) for i, seed in enumerate((0, 5))]
    identify(logs, folder / "out")
    return report_in(folder / "out")


def replayed_logs(monkeypatch, killed_at=None):
    """Files that are replayed from here on, in turn; the process is killed at one of them."""
    seen = []

    def reading(paths, way):
        for path in paths:
            if len(seen) == killed_at:
                raise KeyboardInterrupt
            seen.append(path.stem)
        return log_files.recordings(paths, way)

    monkeypatch.setattr("gaitshift.lab.identification.task.recordings", reading)
    return seen


def identify(logs, out, conditions=("paper", "oracle")):
    main(["identify", *map(str, logs), "--out", str(out), "--condition", *conditions])


def report_in(folder):
    return {name: (folder / name).read_text() for name in ("conditions.csv", "courses.csv")}


@pytest.mark.parametrize("killed_at", [1, 2, 3])
def test_a_run_that_was_killed_goes_on_where_it_stopped(
    tmp_path, monkeypatch, capsys, two_logs, whole, killed_at
):
    out = tmp_path / "out"
    done = replayed_logs(monkeypatch, killed_at)
    with pytest.raises(SystemExit) as end:
        identify(two_logs, out)
    assert end.value.code == 130
    after = replayed_logs(monkeypatch)
    capsys.readouterr()
    identify(two_logs, out)
    assert [*done, *after] == ["walk-0", "walk-1", "walk-0", "walk-1"], "chosen by, then judged by"
    assert "choosing: walk-0 (cached)" in capsys.readouterr().err
    assert report_in(out) == whole
    assert not (out / "unfinished").exists()


def test_a_run_that_was_killed_while_it_drew_goes_on(tmp_path, monkeypatch, two_logs, whole):
    out = tmp_path / "out"

    def half_a_picture(judged, path):
        path.touch()
        raise KeyboardInterrupt

    with monkeypatch.context() as patched:
        patched.setattr("gaitshift.show.plots.identification.condition_map", half_a_picture)
        with pytest.raises(SystemExit):
            identify(two_logs, out)
    assert (out / "paper.png").stat().st_size == 0
    replayed = replayed_logs(monkeypatch)
    identify(two_logs, out)
    assert not replayed
    assert report_in(out) == whole
    assert (out / "paper.png").stat().st_size > 1000


def test_a_picture_of_someone_else_beside_an_unfinished_run_is_not_replaced(
    tmp_path, monkeypatch, two_logs
):
    out = tmp_path / "out"
    replayed_logs(monkeypatch, killed_at=1)
    with pytest.raises(SystemExit):
        identify(two_logs, out)
    (out / "holiday.png").touch()
    with pytest.raises(SystemExit) as end:
        identify(two_logs, out)
    assert end.value.code == 2


def test_what_was_kept_of_a_log_is_not_used_for_another_one_of_its_name(
    tmp_path, monkeypatch, two_logs
):
    out = tmp_path / "out"
    replayed_logs(monkeypatch, killed_at=2)
    with pytest.raises(SystemExit):
        identify(two_logs, out)
    table(two_logs[1], march("into", noise=0.05, robots=1, seed=6))
    after = replayed_logs(monkeypatch)
    identify(two_logs, out)
    assert after == ["walk-1", "walk-0", "walk-1"]
    whole = tmp_path / "whole"
    identify(two_logs, whole)
    assert report_in(out) == report_in(whole)


def test_numbers_that_were_kept_are_not_used_for_others(tmp_path, monkeypatch, two_logs):
    out = tmp_path / "out"
    replayed_logs(monkeypatch, killed_at=1)
    with pytest.raises(SystemExit):
        main(["identify", *map(str, two_logs), "--out", str(out), "--alpha", "0.1", "--beta", "9"])
    after = replayed_logs(monkeypatch)
    main(["identify", *map(str, two_logs), "--out", str(out), "--alpha", "0.01", "--beta", "9"])
    assert after == ["walk-0", "walk-1"]


@pytest.mark.slow
def test_the_classifier_goes_on_too(tmp_path, monkeypatch, two_logs):
    out, whole = tmp_path / "out", tmp_path / "whole"
    for folder, killed_at in ((whole, None), (out, 5), (out, None)):
        seen = replayed_logs(monkeypatch, killed_at)
        if killed_at is None:
            identify(two_logs, folder, ["classifier"])
        else:
            with pytest.raises(SystemExit):
                identify(two_logs, folder, ["classifier"])
    assert seen == ["walk-1"], "the last log to be judged by"
    assert report_in(out) == report_in(whole)


class Trap:
    """Runs code where it is unpickled."""

    def __init__(self, mark):
        self.mark = mark

    def __reduce__(self):
        return Path.touch, (self.mark,)


def replace_by_a_pickle(path, trap):
    path.write_bytes(pickle.dumps(trap))


def replace_by_an_array_of_objects(path, trap):
    np.savez(path.with_suffix(""), text=np.array([trap], dtype=object))


def replace_by_half(path, trap):
    del trap
    path.write_bytes(path.read_bytes()[:-100])


def replace_by_text(path, trap):
    del trap
    np.savez(
        path.with_suffix(""), text=np.frombuffer(b'{"format": 1, "key": "", "result": []}', "u1")
    )


@pytest.mark.parametrize(
    "craft",
    [replace_by_a_pickle, replace_by_an_array_of_objects, replace_by_half, replace_by_text],
)
def test_no_file_that_an_unfinished_run_keeps_is_run(tmp_path, monkeypatch, two_logs, whole, craft):
    out, mark = tmp_path / "out", tmp_path / "code-was-run"
    replayed_logs(monkeypatch, killed_at=2)
    with pytest.raises(SystemExit):
        identify(two_logs, out)
    kept = [path for path in (out / "unfinished").rglob("*") if path.is_file()]
    assert kept
    for path in kept:
        craft(path, Trap(mark))
    replayed = replayed_logs(monkeypatch)
    identify(two_logs, out)
    assert not mark.exists()
    assert len(replayed) == 4, "what cannot be read is done again"
    assert report_in(out) == whole


def test_what_is_kept_of_a_log_is_what_was_found_to_the_last_bit(tmp_path):
    some = [c for c in CANDIDATES if c.name in ("paper", "height_difference", "oracle")]

    def logs():
        return [march("into", noise=0.04, seconds=10.0, robots=2)]

    tried = try_grids(some, logs(), "rough")
    replayed = replay_rules(tune(some, tried), logs())
    examples = Examples.of(logs())
    for form, found in ((TRIED, tried), (REPLAYED, replayed), (EXAMPLES, examples)):
        StepCache(tmp_path, print).get("step", (), form, lambda found=found: found)
        again = StepCache(tmp_path, print).get("step", (), form, pytest.fail)
        assert_same(again, found)
        next(tmp_path.iterdir()).unlink()


def assert_same(one, other):
    """Two results have the same types, the same shapes and the same bits all the way down."""
    assert type(one) is type(other)
    if isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape)
        np.testing.assert_array_equal(one, other)
    elif isinstance(one, dict):
        assert list(one) == list(other)
        assert_same(list(one.values()), list(other.values()))
    elif isinstance(one, list | tuple):
        assert len(one) == len(other)
        for part, of_other in zip(one, other, strict=True):
            assert_same(part, of_other)
    elif hasattr(one, "__dict__"):
        assert_same(vars(one), vars(other))
    else:
        assert one == other


@pytest.mark.slow
def test_record_and_identify_find_noise_on_the_standard_courses(tmp_path, capsys):
    logs = tmp_path / "logs"
    command = ["record", "trot", "--out", str(logs), "--courses", "flat", "into-0.20"]
    command += ["--robots", "8", "--seconds", "9", "--json"]
    main(command)
    rows = json.loads(capsys.readouterr().out)["logs"]
    assert [row["robots"] for row in rows] == [8, 8]
    before = [path.stat().st_mtime_ns for path in sorted(logs.iterdir())]
    main(command)
    assert "exists, not repeated" in capsys.readouterr().err
    assert [path.stat().st_mtime_ns for path in sorted(logs.iterdir())] == before
    files = [str(path) for path in sorted(logs.iterdir())]
    main(["identify", *files, "--out", str(tmp_path / "report"), "--json"])
    (row,) = json.loads(capsys.readouterr().out)["conditions"]
    assert row["condition"] == "touchdown_surprise"
    assert row["false_shifts"] == 0
    assert row["detected"] >= 7


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "trot"),
        (["trot", "--courses", "moon"], "got 'moon'"),
        (["moon"], "policy must be one of"),
    ],
)
def test_bad_input_of_record_is_one_line_and_code_2(tmp_path, capsys, arguments, message):
    with pytest.raises(SystemExit) as end:
        main(["record", *arguments, "--out", str(tmp_path / "logs")])
    assert end.value.code == 2
    assert message in capsys.readouterr().err.splitlines()[-1]


# The classifier -----------------------------------------------------------------------------------


def test_a_classifier_is_judged_on_robots_that_it_never_saw():
    """Labels of pure chance: what it has learned by heart helps it on its own robots alone."""
    rng = np.random.default_rng(4)
    noise = march("noise", noise=0.0, robots=2)
    chance = replace(noise, rough=rng.random((len(noise.time) // 50, 2)).repeat(50, axis=0) < 0.5)
    classifier = RoughnessClassifier.fit([chance])
    truth = chance.rough.ravel()
    areas = []
    for crosswise in (False, True):
        likely = classifier.probability(chance, crosswise=crosswise).ravel()
        areas.append(auc(likely[truth][:, None], likely[~truth][:, None])[0])
    assert areas[0] > 0.9
    assert areas[1] < 0.7


@pytest.mark.slow
def test_a_classifier_learns_what_rough_ground_is():
    classifier = RoughnessClassifier.fit(ways())
    other = march("into", noise=0.04, seed=9)
    likely = classifier.probability(other, crosswise=False)[..., 0]
    assert likely[150:380].mean() < 0.1
    assert likely[600:].mean() > 0.9


@pytest.mark.parametrize(("rough", "says"), [(True, "rough"), (False, "smooth")])
def test_a_classifier_needs_both_labels(rough, says):
    one_kind = march("flat", noise=0.0)
    with pytest.raises(GaitshiftError, match=f"got {says} only"):
        RoughnessClassifier.fit([replace(one_kind, rough=np.full_like(one_kind.rough, rough))])


@pytest.mark.slow
def test_of_all_conditions_the_classifier_is_left_out_where_one_robot_is_all_there_is(
    tmp_path, capsys
):
    log = table(tmp_path / "walk.csv", walk())
    out = ["--out", str(tmp_path / "report"), "--json"]
    main(["identify", str(log), "--condition", "all", *out])
    said = capsys.readouterr()
    assert "skipped" in said.err
    assert "classifier" not in {row["condition"] for row in json.loads(said.out)["conditions"]}
    with pytest.raises(SystemExit) as end:
        main(["identify", str(log), "--condition", "classifier", "--overwrite", *out])
    assert end.value.code == 2
