"""There and back: what the way to flat ground counts, passages scored at their own β, chatter."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.image import imread
from test_identify import (
    height_candidates,
    judged_by,
    time_to_fire,
    tuned_by,
    ways,
)

from gaitshift.cli import main
from gaitshift.errors import GaitshiftError
from gaitshift.lab.identification import ParameterGrid, Tally, choose, passages
from gaitshift.lab.identification.candidates import BETAS, CANDIDATES
from gaitshift.lab.identification.chatter import chattered, shifts
from gaitshift.lab.identification.labelled_run import align_to_entry
from gaitshift.lab.identification.passage import best_beta, passage_grid, passage_scores
from gaitshift.lab.identification.report import (
    condition_cells,
    condition_rows,
    course_cells,
    course_rows,
    introduction,
)
from gaitshift.lab.identification.tuning import as_given
from gaitshift.robot.state import Proprioception
from gaitshift.shift import (
    GaitGraph,
    HeightDifference,
    Oracle,
    PlaneResidual,
    Rule,
    load_graph,
    there_and_back,
)
from gaitshift.shift import ways as edges_of
from gaitshift.show.plots.identification import condition_map, roc_figure
from marches import march, table


def crossing(noise=0.04, *, seed=2, robots=3, name="crossing"):
    """Robots that walk 4 m of smooth ground, 4 m of noise, and 6 m of smooth ground at 1 m/s."""
    into = march(name, noise=noise, seconds=8.0, seed=seed, robots=robots)
    after = march(name, noise=0.0, seconds=6.0, seed=seed + 50, robots=robots)
    time = 0.01 * np.arange(1, 1401)
    return replace(
        into,
        sensed=replace(Proprioception.stack([*into, *after]), time=time),
        rough=np.concatenate([into.rough, after.rough]),
        alive=np.concatenate([into.alive, after.alive]),
        distance=np.tile(time[:, None], (1, robots)),
    )


def only(name):
    return [candidate for candidate in CANDIDATES if candidate.name == name]


# The way to flat ground ---------------------------------------------------------------------------


def test_on_the_way_to_flat_ground_each_robot_begins_where_it_comes_to_rough_ground():
    rec = crossing(robots=4)
    rec.rough[400:450, 1] = False  # comes to it half a second later
    rec.rough[:, 2] = False  # never comes to it
    rec.alive[600:, 3] = False
    values = np.arange(1400.0)[:, None, None] * np.ones((1, 4, 1))
    seen, aligned = align_to_entry(rec, values, "flat")
    assert seen.rough[:, 0].tolist() == [False] * 400 + [True] * 1000
    assert seen.rough[:400, 1].tolist() == [False] * 350 + [True] * 50
    assert seen.alive.sum(axis=0).tolist() == [1000, 950, 0, 200]
    np.testing.assert_allclose(seen.distance[[0, 100], 0], [0.0, 1.0])
    np.testing.assert_allclose(seen.distance[[0, 100], 1], [0.0, 1.0])
    assert aligned[[0, 10], :2, 0].tolist() == [[400.0, 450.0], [410.0, 460.0]]


def test_on_the_way_to_rough_ground_each_robot_begins_where_it_first_walks_on_smooth_ground():
    """What it starts on it has not come to; rough ground alone counts as it is."""
    rec = crossing(robots=4)
    values = np.arange(1400.0)[:, None, None] * np.ones((1, 4, 1))
    assert align_to_entry(rec, values, "rough")[0] is rec, "all start on smooth ground"
    rec.rough[:300, 1] = True
    rec.rough[:, 2] = True
    rec.alive[600:, 1] = False
    seen, aligned = align_to_entry(rec, values, "rough")
    assert seen.rough[:, 0].tolist() == rec.rough[:, 0].tolist()
    assert seen.rough[:600, 1].tolist() == [False] * 100 + [True] * 400 + [False] * 100
    assert seen.rough[:, 2].all()
    assert seen.alive.sum(axis=0).tolist() == [1400, 300, 1400, 1400]
    np.testing.assert_allclose(seen.distance[[0, 100], 1], [0.0, 1.0])
    assert aligned[[0, 10], 1, 0].tolist() == [300.0, 310.0]


def test_rough_ground_that_a_table_begins_on_was_not_come_to(tmp_path):
    """Its first metre does not count where smooth ground follows, and does where none does."""
    rec = crossing(robots=1)
    rec.rough[:100] = True
    walk = table(tmp_path / "walk.csv", rec)
    assert [len(one.time) for one in passages(walk)] == [700, 600]
    assert [len(one.time) for one in passages(walk, "flat")] == [400, 1000]
    noticed_at_once = as_given(height_candidates()[:1], way="rough", alpha=1e-9, beta=0.0)
    (judged,) = judged_by(noticed_at_once, passages(walk))
    (course,) = judged.courses
    assert course.tally.came.item() == 0, "on smooth ground it has fired before"
    assert course.tally.fired.item() == 2, "in each passage"
    rec.rough[:] = True
    rough = table(tmp_path / "rough.csv", rec)
    (judged,) = judged_by(noticed_at_once, passages(rough))
    assert judged.courses[0].tally.detected.item() == 1


def test_a_firing_before_the_first_rough_ground_is_no_detection_of_its_end():
    """β is 3 s of smooth steps: k would exceed it on the 4 s before the rough ground."""
    rec = crossing()
    given = as_given(height_candidates()[:1], way="flat", alpha=0.0055, beta=300.0)
    (judged,) = judged_by(given, [rec])
    tally = judged.courses[0].tally
    assert tally.came.item() == tally.detected.item() == 3
    assert tally.km.item() == pytest.approx(3 * 4.0 / 1000, rel=0.01), "4 m of rough ground each"
    # By hand: k from the first rough step on.
    values, rule = given[0].candidate.values(rec), given[0].rule
    expected = []
    for robot in range(3):
        k, t = np.zeros(1), 400
        while not rule.fires(k, np.ones(1))[0]:
            k, t = rule.step(k, values[t, robot : robot + 1]), t + 1
        expected.append(0.01 * (t - 1 - 800))
    assert min(expected) > 2.0
    assert judged.courses[0].delays_m == pytest.approx(expected)


def test_the_numbers_of_a_crossing_are_those_of_the_same_robots_from_the_noise_on():
    whole = crossing()
    late = replace(
        whole,
        sensed=whole.sensed[400:],
        rough=whole.rough[400:],
        alive=whole.alive[400:],
        distance=whole.distance[400:] - whole.distance[400],
    )
    (first, second) = (tuned_by(only("oracle"), [r], way="flat") for r in (whole, late))
    assert first[0].choice == second[0].choice
    np.testing.assert_array_equal(first[0].tally.fired, second[0].tally.fired)
    np.testing.assert_allclose(first[0].tally.metres, second[0].tally.metres)


@pytest.mark.slow
def test_identify_finds_the_way_back_in_a_table_of_smooth_rough_and_smooth_ground(tmp_path, capsys):
    logs = [
        str(table(tmp_path / f"walk{seed}.csv", crossing(robots=1, seed=seed))) for seed in range(3)
    ]
    assert [one.rough[:, 0].any() for one in passages(tmp_path / "walk0.csv", "flat")] == [0, 1]
    out = tmp_path / "report"
    command = ["identify", *logs, "--way", "flat", "--condition", "height_difference", "--json"]
    main([*command, "--out", str(out)])
    (row,) = json.loads(capsys.readouterr().out)["conditions"]
    assert (row["came"], row["detected"], row["false_shifts"]) == (3, 3, 0)
    assert row["km"] == pytest.approx(3 * 0.004, rel=0.2), "of rough ground"
    assert "Passages of level ground" in (out / "page.html").read_text()


GRID = ParameterGrid(alphas=np.array([0.01, 0.03, 0.0305, 0.06]), betas=np.array([0.0, 1.0]))


def test_the_headroom_of_the_way_back_lies_at_a_larger_alpha():
    """A rule fires more at a larger α: 0.0315 is not known to be quiet, as 0.06 is not."""
    made = Tally(shape=GRID.shape)
    made.came[:], made.detected[:], made.km[:] = 4, 4, 2.0
    made.metres[:] = np.array([9.0, 2.0, 2.0, 1.0])[:, None]
    made.fired[3] = 1
    ground = {0.0: {"walk": made}}
    assert choose(ground, GRID, "below").alpha == 0.01
    assert choose(ground, GRID, "above").alpha == 0.03
    made.fired[3] = 0
    back = choose(ground, GRID, "below")
    assert back.alpha == 0.03, "nothing beyond 0.06 shows headroom for it"
    assert back.is_free


def test_the_words_for_ground_that_is_missing_are_those_of_the_way_back():
    made = Tally(shape=GRID.shape)
    with pytest.raises(GaitshiftError, match="must contain rough ground that ends to detect"):
        choose({0.0: {"walk": made}}, GRID, "below")
    made.came[:] = 1
    with pytest.raises(GaitshiftError, match="must contain rough ground to count false shifts on"):
        choose({0.0: {"walk": made}}, GRID, "below")


def test_where_nothing_keeps_still_the_fewest_a_kilometre_are_taken_not_the_fewest():
    """2 in 4 km are fewer a kilometre than 1 in 1 km: who fires late walks on until then."""
    made = Tally(shape=GRID.shape)
    made.came[:], made.detected[:], made.metres[:] = 4, 4, 4.0
    made.fired[:], made.km[:] = 1, 1.0
    made.fired[2, 1], made.km[2, 1] = 2, 4.0
    chosen = choose({0.0: {"walk": made}}, GRID)
    assert (chosen.alpha, chosen.beta, chosen.false_per_km) == (0.0305, 1.0, 0.5)


# The β of passages --------------------------------------------------------------------------------


def test_scores_at_every_beta_are_those_of_each_beta_alone():
    rec, alphas, betas = crossing(), np.geomspace(0.001, 0.2, 30), np.array([0.0, 20.0, 400.0])
    values = rec.values(HeightDifference())
    for leak in (0.0, 0.4):
        rule = Rule(alpha=1.0, beta=1.0, leak=leak)
        together = passage_grid(rec, values, rule, alphas, betas)
        for b, beta in enumerate(betas):
            alone = passage_scores(rec, values, replace(rule, beta=float(beta)), alphas)
            assert {kind: [row[b] for row in rows] for kind, rows in together.items()} == alone


def test_the_best_beta_has_the_largest_mean_area_and_the_chosen_one_wins_a_tie():
    betas = np.array([0.0, 5.0, 10.0, 50.0])
    smooth = [np.array([1, 0, 0, 0]), np.array([3, 1, 0, 0])]
    near = [np.array([2, 2, 0, 0]), np.array([2, 2, 1, 0])]  # areas 0.5, 1, 0.75, 0.5
    far = [np.array([9, 1, 9, 0])]  # areas 1, 0.75, 1, 0.5
    scores = {
        "near": {True: near, False: smooth[:1]},
        "far": {True: far, False: smooth[1:]},
        "flat": {True: [], False: []},
    }
    assert best_beta(scores, betas, 50.0) == 5.0
    assert best_beta(scores, betas, 10.0) == 10.0, "0.875 as well"
    assert best_beta({"flat": {True: [], False: smooth}}, betas, 50.0) == 50.0


def uneven():
    """Two courses of noise, and one that is a little less uneven and is called smooth."""
    less = march("c", noise=0.018, seed=7)
    return [
        march("a", noise=0.02, seed=5),
        march("b", noise=0.02, seed=6),
        replace(less, rough=np.zeros_like(less.rough)),
    ]


def mean_area(tuned, recordings, beta):
    """Mean over courses of the share of pairs of passages in the right order."""
    rule, alphas = replace(tuned.rule, beta=float(beta)), tuned.grid.alphas
    values = [tuned.candidate.values(rec) for rec in recordings]
    pairs = zip(recordings, values, strict=True)
    scored = [passage_scores(rec, seen, rule, alphas) for rec, seen in pairs]
    others = np.array([score for of in scored for score in of[False]])
    areas = [
        np.mean([(score > others).mean() + 0.5 * (score == others).mean() for score in of[True]])
        for of in scored
        if of[True]
    ]
    return np.mean(areas)


def test_passages_are_scored_at_the_beta_that_tells_them_apart_best():
    recordings = uneven()
    (tuned,) = tuned_by(height_candidates()[:1], recordings, way="rough")
    areas = np.array([mean_area(tuned, recordings, beta) for beta in BETAS])
    assert areas.max() > areas[np.searchsorted(BETAS, tuned.choice.beta)] + 0.01
    assert tuned.area_beta == BETAS[areas.argmax()]
    (judged,) = judged_by([tuned], recordings)
    told = [area[0] for c in "ab" if (area := judged.area(c)) is not None]
    assert np.mean(told) == pytest.approx(areas.max())
    (row,) = condition_rows([judged])
    assert (row["area"], row["area_beta"]) == (min(told), tuned.area_beta)
    assert condition_cells(row)[-1] == f"{tuned.area_beta:g}"
    assert "the β with the largest area on the logs for choosing" in introduction([judged], True)[1]


@pytest.mark.parametrize(("beta", "is_told"), [(1793.0, True), (1801.0, False)])
def test_an_area_is_told_only_where_a_passage_is_long_enough_for_beta(beta, is_told):
    """Six numbers in each of 300 steps make k 1800 at most."""
    given = as_given(height_candidates()[:1], way="rough", alpha=0.01, beta=beta)
    (judged,) = judged_by(given, ways())
    assert (judged.area("into") is not None) == is_told
    (row,), courses = condition_rows([judged]), course_rows([judged])
    assert (row["area"] is None) == (row["area_beta"] is None) == (not is_told)
    if not is_told:
        assert condition_cells(row)[-2:] == ("–", "–")
        told = {row["course"]: course_cells(row)[-2] for row in courses}
        assert told == {"flat": "", "into": "–"}


# Chatter ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("statistic_back", [None, PlaneResidual()])
def test_shifts_there_and_back_are_those_of_a_live_graph(statistic_back):
    rec = crossing(noise=0.02)
    rec.alive[1000:, 2] = False
    graph = there_and_back(
        HeightDifference(),
        Rule(alpha=0.02, beta=9.0, leak=0.3),
        Rule(when="below", alpha=0.03, beta=12.0, leak=0.1),
        statistic_back=statistic_back,
    )
    state, expected = graph.begin(3), np.zeros(3, dtype=int)
    for t, sensed in enumerate(rec):
        state, decision = graph.step(state, sensed)
        expected += decision.fired & rec.alive[t]
    never = there_and_back(HeightDifference(), Rule(alpha=9.0, beta=9.0), Rule(alpha=9.0, beta=9.0))
    np.testing.assert_array_equal(shifts(rec, [graph, never]), [expected, np.zeros(3)])
    assert expected.min() > 2, "they chatter"


def test_chatter_is_more_than_once_there_and_once_back_for_each_rough_stretch():
    rec = crossing(robots=4)
    rec.rough[500:520, 3] = False  # two stretches
    rec.rough[:, 2] = False  # none
    for count, wanted in (
        ([2, 3, 2, 4], [False, True, False, False]),
        ([0, 1, 3, 5], [False, False, True, True]),
    ):
        assert chattered(rec, np.array(count)).tolist() == wanted


@pytest.mark.parametrize("way", ["rough", "flat"])
def test_the_report_counts_chatter_with_the_shipped_way_back_or_there(way):
    """An oracle on one way, and on the other the default graph's edge, live."""
    rec = crossing()
    (judged,) = judged_by(as_given(only("oracle"), way=way, alpha=0.5, beta=0.0), [rec])
    (row,) = course_rows([judged])
    shipped = load_graph("terrain")
    statistics, (there, back) = shipped.statistics, edges_of(shipped)
    if way == "rough":
        there = replace(there, statistic="oracle", rule=Rule(alpha=0.5, beta=0.0))
    else:
        back = replace(back, statistic="oracle", rule=Rule(when="below", alpha=0.5, beta=0.0))
    graph = GaitGraph(
        start=shipped.start,
        statistics={**statistics, "oracle": Oracle()},
        edges=(there, back),
    )
    state, count = graph.begin(3), np.zeros(3, dtype=int)
    for sensed, rough in zip(rec, rec.rough, strict=True):
        state, decision = graph.step(state, sensed, rough)
        count += decision.fired
    assert count.min() >= 2
    assert (row["shifts"], row["chattered"]) == (count.sum(), (count > 2).sum())
    assert f"{row['chattered']} of 3" in course_cells(row)
    words = introduction([judged], True)[1]
    assert f"default graph's rule for the way {'back' if way == 'rough' else 'there'} (α" in words


def test_a_rule_without_patience_chatters_on_rough_ground():
    """β' is 0 and all heights lie below α': each shift there is followed by one back at once."""
    given = as_given(only("height_difference"), way="flat", alpha=9.0, beta=0.0)
    (judged,) = judged_by(given, [crossing()])
    (row,) = condition_rows([judged])
    assert row["chattered"] == 3
    assert row["shifts"] > 2 * 3
    assert "3 of 3" in condition_cells(row)


# What is asked for and cannot be ------------------------------------------------------------------


@pytest.fixture
def log(tmp_path):
    return table(tmp_path / "walk.csv", march("into", noise=0.04, robots=1))


def said(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main(["identify", *map(str, arguments)])
    assert end.value.code == 2
    return capsys.readouterr().err.splitlines()[-1]


NUMBERS = ("--alpha", "0.1", "--beta", "9")


@pytest.mark.parametrize("more", [(), NUMBERS, ("paper",)])
def test_columns_that_a_condition_needs_are_named(tmp_path, capsys, log, more):
    line = said(capsys, log, "--out", tmp_path / "report", "--condition", "slip", *more)
    assert "'slip'" in line
    assert line.endswith(
        "needs velocity_x, velocity_y, velocity_z, angular_velocity_x, angular_velocity_y, "
        "angular_velocity_z"
    )


def test_only_the_columns_that_are_missing_are_named(tmp_path):
    rec = march("walk", noise=0.04)
    rec = replace(rec, sensed=replace(rec.sensed, velocity_b=np.zeros((1200, 3, 3))))
    with pytest.raises(GaitshiftError, match=r"needs angular_velocity_x, [a-z_, ]*_z$"):
        tuned_by(only("slip"), [rec], way="rough")


def test_a_log_that_chooses_cannot_judge_as_held_out(tmp_path, capsys, log):
    again = tmp_path / "again.csv"
    again.symlink_to(log)
    line = said(capsys, log, "--held-out", again, "--out", tmp_path / "report")
    assert f"{again}: a log must not both" in line
    assert not (tmp_path / "report").exists()


def test_a_condition_named_twice_is_judged_once(tmp_path, capsys, log):
    for names in (["paper"], ["paper", "paper"]):
        out = ["--out", str(tmp_path / f"{len(names)}"), "--json"]
        main(["identify", str(log), "--condition", *names, *NUMBERS, *out])
    once, twice = capsys.readouterr().out.splitlines()
    assert json.loads(once)["conditions"] == json.loads(twice)["conditions"]
    with (tmp_path / "2" / "courses.csv").open() as file:
        assert [row["came"] for row in csv.DictReader(file)] == ["1"]


def test_no_recordings_at_all_are_refused():
    given = as_given(only("paper"), way="rough", alpha=0.1, beta=9.0)
    with pytest.raises(GaitshiftError, match="must be recordings to judge by"):
        judged_by(given, [])


def test_a_map_tells_beta_in_the_time_of_the_logs(tmp_path):
    """Of logs at 50 Hz, twice the time that the rule takes at 100 Hz; six numbers count a step."""
    slow = [
        replace(way, sensed=replace(way.sensed, time=2 * way.time, period=2 * way.period))
        for way in ways()
    ]
    (tuned,) = tuned_by(height_candidates()[:1], slow, way="rough")
    tuned = replace(tuned, choice=replace(tuned.choice, beta=37.0, leak=1.2))
    (judged,) = judged_by([tuned], slow)
    figure = condition_map(judged, tmp_path / "map.png")
    expected = 2 * time_to_fire(tuned)
    assert f"β = 37 ({expected:.2g} s or longer), leak 1.2" in figure.axes[0].get_title("left")


def test_every_name_beside_roc_curves_stays_in_the_picture(tmp_path):
    given = as_given(only("touchdown_surprise"), way="rough", alpha=0.01, beta=287.0)
    judged = judged_by(given, ways())
    roc_figure(judged, "into", tmp_path / "roc.png")
    border = imread(tmp_path / "roc.png")[:, -8:]
    assert (border == border[0, 0]).all()
