"""The paper's recipe run again: what each switch changes, what is found, and that it goes on."""

import re
from dataclasses import asdict, replace

import numpy as np
import pytest

from gaitshift.control.observation import PAPER_SLICES
from gaitshift.errors import GaitshiftError
from gaitshift.gait import gaits
from gaitshift.lab.reproduction.findings import findings
from gaitshift.lab.reproduction.judging import curve_rows, run_rows
from gaitshift.lab.reproduction.learning_curve import LearningCurve, median_iteration
from gaitshift.lab.reproduction.plan import ABLATIONS, AS_IN_THE_PAPER, REFERENCE, Plan
from gaitshift.lab.reproduction.results import EarlierRuns, Results, Seeds
from gaitshift.learn.presets import paper
from gaitshift.learn.run import Run
from gaitshift.learn.run_config import RunConfig
from gaitshift.show.plots.reproduction import Landmarks, comparison_curves, reward_curves
from gaitshift.sim.env import Curriculum, EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat
from gaitshift.table import write

CHANGES = {
    "multiply-clipped": {"recipe/env/reward/bonus_mode": "multiply_clipped"},
    "multiply": {"recipe/env/reward/bonus_mode": "multiply"},
    "lockout-0": {"lockout": 0},
    "lockout-20": {"lockout": 20},
    "blind": {"recipe/env/observed": PAPER_SLICES[2:]},
    "no-bonus": {"recipe/env/reward/bonus": 0.0},
    "curriculum": {"recipe/penalty_start": 0.1},
    "paper-gains": {"recipe/env/gains": "paper"},
}
"""All that each ablation is meant to change, and what it becomes."""


def leaves(data, path=""):
    """Every number and word of nested data, by its path."""
    if not isinstance(data, dict):
        return {path: data}
    parts = (leaves(value, f"{path}/{key}".lstrip("/")) for key, value in data.items())
    return {key: value for part in parts for key, value in part.items()}


def difference(one, other):
    """What `other` has where it differs from `one`."""
    a, b = leaves(one), leaves(other)
    assert a.keys() == b.keys()
    return {key: b[key] for key in a if a[key] != b[key]}


# Settings and plan ------------------------------------------------------------------------------


@pytest.mark.parametrize("setting", ABLATIONS, ids=lambda setting: setting.name)
def test_each_ablation_changes_what_it_names_and_nothing_else(setting):
    changed = difference(asdict(REFERENCE), asdict(setting))
    for key in ("name", "group", "label"):
        changed.pop(key)
    assert changed == CHANGES[setting.name]
    assert setting.group in AS_IN_THE_PAPER


def test_the_reference_is_the_paper_on_one_core_and_on_gains_that_stand():
    changed = difference(asdict(paper()), asdict(REFERENCE.recipe))
    assert changed == {"env/gains": "default", "threads": 1, "physics_threads": 1}


@pytest.mark.parametrize("lockout", [0, 10, 20])
def test_a_machine_changes_as_often_as_its_lock_out_lets_it(lockout):
    machine = replace(REFERENCE, lockout=lockout).machine("trot")
    diagonals = np.array([[True, False, False, True], [False, True, True, False]])
    state, waited, changes = np.zeros(1, dtype=int), np.zeros(1, dtype=int), []
    stride = np.array([float(machine.stride())])
    for step in range(100):
        shown = diagonals[1 - state]  # what the machine waits for
        out = machine.step(state, shown, waited, dwell=machine.dwell_for(stride))
        state, waited = out.state, np.where(out.changed, 0, waited + 1)
        changes += [step] * int(out.changed[0])
    assert set(np.diff(changes)) == {max(1, lockout)}
    assert machine.states == gaits.load("trot").states


def test_a_plan_is_all_settings_gaits_and_seeds_and_parts_can_be_picked():
    plan = Plan(seed=4)
    assert len(plan.jobs) == 3 * 5 + 8 * 3
    assert len({job.name for job in plan.jobs}) == len(plan.jobs)
    assert {job.recipe.iterations for job in plan.jobs} == {500, 200}
    assert [job.name for job in plan.select(("pace",))] == [f"paper-pace-{s}" for s in range(4, 9)]
    assert [job.name for job in plan.select(("gains",))] == [
        *(f"paper-trot-{s}" for s in (4, 5, 6)),
        *(f"paper-gains-trot-{s}" for s in (4, 5, 6)),
    ]
    assert plan.select(("bonus",)) == plan.select(("multiply", "multiply-clipped"))
    with pytest.raises(GaitshiftError, match=r"paper, trot.*got 'canter'"):
        plan.select(("canter",))


# The factor on the penalties --------------------------------------------------------------------


def test_the_factor_on_penalties_grows_in_a_straight_line():
    recipe = replace(paper(), penalty_start=0.2, penalty_until=100)
    table = {0: 0.2, 25: 0.4, 50: 0.6, 100: 1.0, 101: 1.0, 499: 1.0}
    assert {i: round(recipe.curriculum(i).penalty_scale, 9) for i in table} == table
    assert {paper().curriculum(i).penalty_scale for i in table} == {1.0}


@pytest.mark.parametrize("start", [-0.1, 1.1])
def test_a_factor_on_penalties_beyond_0_to_1_is_refused(start):
    with pytest.raises(GaitshiftError, match="penalty_start"):
        replace(paper(), penalty_start=start)


def test_the_factor_is_on_the_penalties_and_on_nothing_else():
    def terms(scale):
        config = EnvConfig(command_share=0.0)
        env = GaitEnv(gaits.load("trot"), flat(4.0, 4.0), 5, config=config, threads=1)
        env.reset(seed=3)
        env.curriculum = Curriculum(penalty_scale=scale)
        return env.step(np.random.default_rng(0).normal(size=(5, 12)))[4]["reward_terms"]

    whole, quarter = terms(1.0), terms(0.25)
    gains = {
        *("forward_velocity", "speed_tracking", "lateral_tracking", "height_tracking"),
        *("stance_feet", "stance_pattern"),
    }
    for name, values in whole.items():
        np.testing.assert_array_equal(quarter[name], (1.0 if name in gains else 0.25) * values)
    assert all((whole[name] <= 0).all() for name in whole.keys() - gains)


def test_a_run_that_goes_on_has_the_factor_of_its_iteration(tmp_path):
    job = next(job for job in Plan.tiny().jobs if job.setting.name == "curriculum")
    recipe = replace(job.recipe, penalty_until=4, checkpoint_every=1)

    def trained(folder, broken):
        def report(row):
            if broken and row["iteration"] == 2:
                raise KeyboardInterrupt

        config = RunConfig(machine=job.machine, recipe=recipe, seed=1, command="test")
        run = Run.create(folder, config)
        if broken:
            with pytest.raises(KeyboardInterrupt):
                run.train(report)
            run = Run.resume(folder)
        run.train()
        return [curve_of(folder).reward, curve_of(folder).speed]

    np.testing.assert_array_equal(
        trained(tmp_path / "whole", False), trained(tmp_path / "broken", True)
    )


def curve_of(folder):
    return LearningCurve.read(folder / "progress.csv")


# Courses and findings ---------------------------------------------------------------------------


def curve(n=500, *, walks=None, start=-25.0, end=26.0, zero=40, changes=9.5, speed=1.1):
    """A run that stands, and walks at once from iteration `walks` on."""
    iteration = np.arange(1, n + 1)
    walking = np.zeros(n, dtype=bool) if walks is None else iteration >= walks
    return LearningCurve(
        reward=np.where(iteration < zero, start, end),
        speed=np.where(walking, speed, 0.1),
        survival=np.where(walking, 0.97, 0.2),
        changes_per_s=np.where(walking, changes, 0.5),
        stance_fraction=np.where(walking, 0.6, 0.1),
    )


def seeds(setting, gait, curves, *, broken=0):
    plan = Plan()
    jobs = [job for job in plan.jobs if job.setting.name == setting and job.gait == gait]
    curves = [*curves, *(curve(7) for _ in range(broken))]
    return Seeds(
        jobs=tuple(jobs[: len(curves)]),
        curves=tuple(curves),
        broken=(False,) * (len(curves) - broken) + (True,) * broken,
    )


def like_the_paper():
    """Runs that do what the paper says."""
    curves = {
        gait: [curve(walks=zero + shift, zero=zero) for shift in range(5)]
        for gait, zero in (("trot", 38), ("bound", 52), ("pace", 85))
    }
    return {("paper", gait): seeds("paper", gait, made) for gait, made in curves.items()}


def verdicts(table):
    found = findings(Results(plan=Plan(), seeds=table))
    return {finding.name: finding.verdict for finding in found}


def test_landmarks_of_a_learning_curve():
    made = curve(100, walks=60, zero=31)
    made.speed[20:29] = 1.0  # nine in a row are not ten
    made.changes_per_s[20:29] = 5.0
    assert (made.walks_at, made.moves_at, made.crosses_zero_at) == (60, 60, 31)
    made.speed[9:19] = 1.0  # as fast, but its machine stands still
    assert (made.walks_at, made.moves_at) == (60, 10)
    assert curve(100, walks=92).walks_at is None, "too near the end to hold ten times"
    assert curve(100, walks=91).walks_at == 91
    assert made.late("speed") == pytest.approx(1.1)
    assert made.cut(50).walks_at is None


@pytest.mark.parametrize(
    ("iterations", "middle"),
    [([5, 9, 7], 7), ([5, None, 7], 7), ([None, 5, None], None), ([4, 8], 6), ([4, None], None)],
)
def test_never_is_later_than_any_iteration(iterations, middle):
    assert median_iteration(iterations) == middle


def test_runs_that_do_what_the_paper_says_hold():
    assert verdicts(like_the_paper()) == dict.fromkeys(
        ("three gaits", "learned early", "order", "reward curves"), "holds"
    )
    told = {f.name: f.measured for f in findings(Results(plan=Plan(), seeds=like_the_paper()))}
    assert "trot 40, bound 54, pace 87" in told["order"]
    assert told["learned early"].startswith("15 of 15 runs")
    assert (
        "bound starts at -25, is positive from iteration 52 (paper: 52) and ends at 26.0"
        in (told["reward curves"])
    )


def test_runs_that_do_not_are_told_apart():
    table = like_the_paper()
    never = [curve(zero=501, start=-8.0) for _ in range(5)]
    table["paper", "trot"] = seeds("paper", "trot", never)
    assert verdicts(table) == {
        "three gaits": "holds in part",
        "learned early": "holds",
        "order": "holds in part",
        "reward curves": "holds in part",
    }
    for gait in ("bound", "pace"):
        table["paper", gait] = seeds("paper", gait, never)
    assert set(verdicts(table).values()) == {"does not hold"}


@pytest.mark.parametrize(
    ("setting", "curves", "broken", "group", "verdict"),
    [
        ("multiply", [curve(300, walks=90)] * 3, 0, "bonus", "holds"),
        ("multiply", [curve(300, walks=90)] * 2, 1, "bonus", "holds in part"),
        ("multiply", [curve(300)] * 3, 0, "bonus", "does not hold"),
        ("lockout-0", [curve(300, walks=30, changes=45.0)] * 3, 0, "lock-out", "does not hold"),
        ("lockout-0", [curve(300, walks=30, changes=5.0)] * 3, 0, "lock-out", "holds"),
        ("blind", [curve(300, walks=42)] * 3, 0, "observation", "does not hold"),
        ("blind", [curve(300, walks=60)] * 3, 0, "observation", "holds"),
        ("blind", [curve(300, walks=20)] * 2, 1, "observation", "holds"),
        ("no-bonus", [curve(300, walks=30, changes=0.0)] * 3, 0, "machine", "does not hold"),
        ("no-bonus", [curve(300)] * 3, 0, "machine", "holds"),
        ("no-bonus", [curve(300, walks=60)] * 3, 0, "machine", "holds in part"),
        ("curriculum", [curve(300, walks=60)] * 3, 0, "penalties", "holds"),
        ("curriculum", [curve(300, walks=38)] * 3, 0, "penalties", "holds in part"),
        ("curriculum", [curve(300, walks=20)] * 3, 0, "penalties", "holds in part"),
        ("paper-gains", [curve(300)] * 3, 0, "gains", "does not hold"),
        ("paper-gains", [], 3, "gains", "does not hold"),
    ],
)
def test_an_ablation_is_judged_by_how_it_learned(setting, curves, broken, group, verdict):
    table = like_the_paper() | {
        (setting, "trot"): seeds(setting, "trot", curves, broken=broken),
    }
    assert verdicts(table)[group] == verdict


def test_an_ablation_that_does_not_decide_gives_no_verdict():
    table = like_the_paper() | {
        ("lockout-20", "trot"): seeds("lockout-20", "trot", [curve(300, walks=30)] * 3),
    }
    assert "lock-out" not in verdicts(table)


def test_an_ablation_is_held_against_as_many_seeds_and_iterations():
    late = [curve(walks=400)] * 3 + [curve(walks=38)] * 2
    table = {
        ("paper", "trot"): seeds("paper", "trot", late),
        ("blind", "trot"): seeds("blind", "trot", [curve(300, walks=250)] * 3),
    }
    (finding,) = findings(Results(plan=Plan(), seeds=table))
    assert "**u and δ shown** 0 of 3 walk (the median never)" in finding.measured
    assert "**u and δ hidden** 3 of 3 walk (median iteration 250)" in finding.measured


def test_a_table_of_curves_reads_back_as_the_curves(tmp_path):
    """Landmarks and findings from the table are those from the runs, digit by digit."""
    table = like_the_paper() | {
        ("blind", "trot"): seeds("blind", "trot", [curve(200, walks=61)] * 2, broken=1),
    }
    first = Results(plan=Plan(), seeds=table)
    write(tmp_path / "runs.csv", run_rows(first))
    write(tmp_path / "curves.csv", list(curve_rows(first)))
    earlier = EarlierRuns.read(Plan(), tmp_path)
    again = Results.read(Plan(), tmp_path / "none", earlier)
    assert findings(again) == findings(first)
    assert list(curve_rows(again)) == list(curve_rows(first))
    assert earlier.broken == {"blind-trot-2"}
    assert again.seeds["paper", "pace"].curves[1].walks_at == 86


@pytest.mark.parametrize(
    ("name", "old", "new", "says"),
    [
        ("runs.csv", "setting,", "set,", "runs.csv is damaged: 'setting'"),
        ("curves.csv", "blind,trot,0,7,", "blind,trot,9,7,", "must have 200 lines of blind-trot-0"),
        ("curves.csv", "26.00", "2_6.0?", "curves.csv is damaged: could not convert"),
    ],
)
def test_a_damaged_report_is_named(name, old, new, says, tmp_path):
    table = {("blind", "trot"): seeds("blind", "trot", [curve(200, walks=61)] * 3)}
    results = Results(plan=Plan(), seeds=table)
    write(tmp_path / "runs.csv", run_rows(results))
    write(tmp_path / "curves.csv", list(curve_rows(results)))
    path = tmp_path / name
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(GaitshiftError, match=re.escape(says)):
        EarlierRuns.read(Plan(), tmp_path)


def test_a_figure_of_a_policy_that_is_no_number_is_named(tmp_path):
    results = Results(plan=Plan(), seeds=like_the_paper())
    write(tmp_path / "runs.csv", run_rows(results))
    write(tmp_path / "curves.csv", list(curve_rows(results)))
    row = {"setting": "paper", "gait": "pace", "seed": 1, "walks_from_iteration": 86}
    write(tmp_path / "gaits.csv", [row | {"survival": 1.0, "speed_mean": None}])
    figures = EarlierRuns.read(Plan(), tmp_path).figures
    assert figures == {"paper-pace-1": {"survival": 1.0, "speed_mean": None}}
    write(tmp_path / "gaits.csv", [row | {"survival": "all", "speed_mean": None}])
    with pytest.raises(GaitshiftError, match=r"gaits\.csv, paper-pace-1 is damaged: .*'all'"):
        EarlierRuns.read(Plan(), tmp_path)


def test_a_report_of_another_recipe_is_not_added_to(tmp_path):
    plan = Plan()
    results = Results(plan=plan, seeds=like_the_paper())
    write(tmp_path / "runs.csv", run_rows(results))
    write(tmp_path / "curves.csv", list(curve_rows(results)))
    assert len(EarlierRuns.read(plan, tmp_path).curves) == 15
    assert len(EarlierRuns.read(replace(plan, seeds=2), tmp_path).curves) == 6, (
        "as far as it is planned"
    )
    with pytest.raises(GaitshiftError, match="paper-trot-0 with another recipe"):
        EarlierRuns.read(Plan.tiny(), tmp_path)
    assert not EarlierRuns.read(plan, tmp_path / "nothing").curves


# Figures ----------------------------------------------------------------------------------------


def test_a_curve_is_the_mean_and_its_band_the_spread(tmp_path):
    rewards = {"trot": [np.array([0.0, 2.0, 4.0]), np.array([2.0, 6.0])]}
    marks = Landmarks(start=-25.0, plateau=(25.0, 27.0), zero_crossing={"trot": 38, "pace": 85})
    (axes,) = reward_curves(rewards, marks, tmp_path / "reward.png").axes
    (line,) = [line for line in axes.lines if line.get_label() == "trot"]
    np.testing.assert_array_equal(line.get_xydata(), [[1, 1], [2, 4], [3, 4]])
    points = {
        tuple(p) for mark in axes.lines if mark.get_marker() in "v>" for p in mark.get_xydata()
    }
    assert points == {(38.0, 0.0), (0.0, -25.0)}
    settings = {"as in the paper": rewards["trot"], "other": [np.array([1.0, 1.0])]}
    page = comparison_curves({"why": settings}, tmp_path / "why.png", aim=1.2).axes
    assert [axes.get_title(loc="left") for axes in page if axes.get_visible()] == ["why"]
    with pytest.raises(GaitshiftError, match="no folder"):
        reward_curves(rewards, marks, tmp_path / "none" / "reward.png")


# Runs -------------------------------------------------------------------------------------------
