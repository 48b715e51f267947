"""Oscillators against their couplings, kinematics against MuJoCo's, and the walk itself."""

import json

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitshift.cli import main
from gaitshift.control import Autonomous
from gaitshift.control.cpg import GAITS, CpgController, HopfNetwork, phase_of
from gaitshift.errors import GaitshiftError
from gaitshift.gait.gaits import load
from gaitshift.lab.evaluation.evaluate import grounds_of
from gaitshift.lab.evaluation.rollout import RolloutConfig, rollout
from gaitshift.lab.gait_analysis import measure
from gaitshift.lab.log import Log
from gaitshift.robot.description import ANYMAL_B
from gaitshift.robot.legs import LEGS, joint_angles, lift_torques
from gaitshift.shift import Rule, TouchdownSurprise, there_and_back
from gaitshift.sim.terrain import from_spec
from gaitshift.sim.world import World

SPEC = ANYMAL_B.spec(ANYMAL_B.gains_of("default"))
MODEL = SPEC.compile()


def feet_of(angles):
    """Middles of the feet by MuJoCo, from the base origin [m]."""
    data = mujoco.MjData(MODEL)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    data.qpos[7:] = angles
    mujoco.mj_kinematics(MODEL, data)
    return np.array([data.geom(f"{leg}_foot").xpos for leg in LEGS])


@settings(max_examples=100, deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=4, max_size=4))
def test_legs_reach_where_they_are_asked_to(offsets):
    home = feet_of(ANYMAL_B.stance_angles)
    wanted = home + np.array(offsets) * [0.15, 0.08, 0.08] + [0.0, 0.0, 0.1]
    angles = joint_angles(wanted[None])[0]
    np.testing.assert_allclose(feet_of(angles), wanted, atol=1e-6)


def test_the_stance_is_its_own_inverse():
    angles = joint_angles(feet_of(ANYMAL_B.stance_angles)[None])[0]
    np.testing.assert_allclose(angles, ANYMAL_B.stance_angles, atol=1e-9)


def test_a_point_out_of_reach_is_reached_for_with_the_leg_straight():
    far = np.array([[0.3, 0.25, -2.0], [0.3, -0.25, -2.0], [-0.3, 0.25, -2.0], [-0.3, -0.25, -2.0]])
    feet = feet_of(joint_angles(far[None])[0])
    assert np.isfinite(feet).all()
    assert (feet[:, 2] < -0.5).all()


@pytest.mark.parametrize("name", GAITS)
def test_phases_converge_to_those_of_the_coupling_from_any_start(name):
    network, rng = HopfNetwork(), np.random.default_rng(1)
    offset = -np.tile(load(name).ideal_phase, (50, 1))
    state = network.start(50, rng.random((50, 4)))
    frequency = rng.uniform(1.0, 3.0, 50)
    for _ in range(400):
        state = network.step(state, offset, frequency, 0.01)
    apart = (phase_of(state) - offset - (phase_of(state) - offset)[:, :1] + 0.5) % 1.0 - 0.5
    converged = np.abs(apart).max(axis=1) < 1e-3
    assert converged.mean() > 0.9, "all but starts near the saddles"
    np.testing.assert_allclose(np.abs(state[converged]), 1.0, atol=1e-3)


def test_the_stride_frequency_is_the_commanded_one():
    network = HopfNetwork()
    offset = -np.array([load("trot").ideal_phase])
    state = network.start(1, offset)
    turned = 0.0
    for _ in range(1000):
        before = phase_of(state)[0, 0]
        state = network.step(state, offset, np.array([2.2]), 0.01)
        turned += (phase_of(state)[0, 0] - before) % 1.0
    assert turned == pytest.approx(22.0, abs=0.01)


def test_the_coupling_decays_at_four_times_its_strength():
    """A small offset of one leg, by the linearised equation: it decays as exp(-4 κ t)."""
    network = HopfNetwork(coupling=2.0)
    offset = np.zeros((1, 4))
    state = network.start(1, np.array([[0.01, 0.0, 0.0, 0.0]]))
    for _ in range(1000):
        state = network.step(state, offset, np.array([0.0]), 0.0001)
    phase = np.angle(state[0]) / (2 * np.pi)
    assert phase[0] - phase[1] == pytest.approx(0.01 * np.exp(-4 * 2.0 * 0.1), rel=0.02)


# The walk -----------------------------------------------------------------------------------------


def walked(name, ground, seconds=8.0, n=8):
    """A log of robots in a gait of oscillators."""
    controller = CpgController([name], n, start=name)
    grounds = grounds_of(ground, seed=1, speed=1.0, seconds=seconds)
    world = World(controller.robot, grounds, n, gains=controller.gains)
    start = np.stack([np.zeros(n), np.linspace(-3.0, 3.0, n)], axis=1)
    run = RolloutConfig(seconds=seconds)
    return rollout(world, controller, run, start_xy=start, rng=np.random.default_rng(0))


@pytest.mark.parametrize("name", GAITS)
def test_each_gait_walks_at_its_speed_and_is_named_by_its_contacts(name):
    figures = measure(walked(name, "flat"), {name: load(name)}, ANYMAL_B)
    assert figures["survival"] == 1.0
    assert figures["verdict"]["gait"] == name
    assert figures["speed_mean"] == pytest.approx(GAITS[name].speed, abs=0.08)
    assert figures["cycles_per_s"] == pytest.approx(GAITS[name].frequency, rel=0.05)


@pytest.mark.parametrize(
    ("name", "ground"),
    [("trot", "perlin:0.05"), ("bound", "perlin:0.05"), ("walk", "perlin:0.03")],
)
def test_robots_keep_on_their_feet_on_mild_noise(name, ground):
    assert not walked(name, ground, seconds=6.0).fallen[-1].any()


def test_oscillators_shift_by_the_very_condition_of_trained_policies():
    """Trot to bound on noise, by an α between what flat ground and the noise show."""
    graph = there_and_back(
        TouchdownSurprise(), Rule(alpha=0.002, beta=5.0), Rule(when="below", alpha=0.005, beta=1e6)
    )
    n = 6
    controller = CpgController(["trot", "bound"], n, start="trot")
    ground = from_spec("flat@5,perlin:0.06@8", seed=3, length=1.0, width=8.0)
    world = World(controller.robot, [ground], n, gains=controller.gains)
    start = np.stack([np.full(n, 1.5), np.linspace(-2.0, 2.0, n)], axis=1)
    log = rollout(
        world,
        controller,
        RolloutConfig(seconds=14.0),
        start_xy=start,
        rng=np.random.default_rng(0),
        switcher=Autonomous(graph, n),
    )
    x, shifted = log.qpos[..., 0], log.gait == 1
    assert not log.fallen[-1].any()
    assert shifted[-1].all(), "all have shifted"
    at = x[shifted.argmax(axis=0), np.arange(n)]
    assert (at > 5.0).all(), "and none on flat ground"


def test_who_walks_off_the_ground_has_fallen():
    """One robot stands where there is none, a metre beside the one that has ground below it."""
    controller = CpgController(["trot"], 2, start="trot")
    ground = from_spec("perlin:0.03", seed=0, length=4.0, width=4.0)
    world = World(controller.robot, [ground], 2, gains=controller.gains)
    start = np.array([[2.0, 0.0], [2.0, 3.0]])
    run = RolloutConfig(seconds=1.0)
    log = rollout(world, controller, run, start_xy=start, rng=np.random.default_rng(0))
    assert log.fallen[-1].tolist() == [False, True]


def test_oscillators_are_judged_as_policies_are(capsys, tmp_path):
    log = tmp_path / "log.npz"
    main(["evaluate", "trot", "--controller", "cpg", "--episodes", "8", "--seconds", "5",
          "--json", "--log", str(log)])  # fmt: skip
    figures = json.loads(capsys.readouterr().out)
    assert (figures["controller"], figures["gait"]) == ("cpg", "trot")
    assert figures["survival"] == 1.0
    assert figures["verdict"]["gait"] == "trot"
    assert Log.load(log).fallen.shape[1] == 8


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["trot", "--trials", "quick"], "--trials is for policies, got --controller cpg"),
        (["trot", "--commands"], "--commands is for policies, got --controller cpg"),
        (
            ["trot", "--robot-file", "pony.toml"],
            "pony.toml: no such file",
        ),
        (["gallop", "--log", "{folder}/new/log.npz"], "got 'gallop'"),
    ],
)
def test_what_oscillators_cannot_be_judged_by_is_refused(tmp_path, capsys, arguments, says):
    given = [argument.format(folder=tmp_path) for argument in arguments]
    with pytest.raises(SystemExit) as end:
        main(["evaluate", *given, "--controller", "cpg"])
    assert end.value.code == 2
    assert says in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def test_a_gait_without_oscillators_is_refused():
    with pytest.raises(
        GaitshiftError, match=r"gait of the oscillators must be one of .*, got 'gallop'"
    ):
        CpgController(["gallop"], 1, start="gallop")


def test_loads_of_standing_legs_are_the_weight():
    """Joint torques that bear 300 N on four feet, by the ground's own equilibrium in MuJoCo."""
    angles = joint_angles(feet_of(ANYMAL_B.stance_angles)[None])
    torques = lift_torques(angles, np.full((1, 4), 75.0))[0]
    data = mujoco.MjData(MODEL)
    data.qpos[:7] = [0, 0, 0, 1, 0, 0, 0]
    data.qpos[7:] = angles[0]
    mujoco.mj_kinematics(MODEL, data)
    mujoco.mj_comPos(MODEL, data)
    expected = np.zeros(MODEL.nv)
    for leg in LEGS:
        jacobian = np.zeros((3, MODEL.nv))
        foot = data.geom(f"{leg}_foot")
        body = MODEL.geom(f"{leg}_foot").bodyid[0]
        mujoco.mj_jac(MODEL, data, jacobian, None, foot.xpos, body)
        expected += jacobian.T @ [0.0, 0.0, -75.0]
    np.testing.assert_allclose(torques, expected[6:], atol=1e-9)


@pytest.mark.slow
def test_the_demonstration_walks_on_oscillators(tmp_path, capsys):
    """There and back by their own graph, each shift behind the border that is its cause."""
    track = ["--track", "flat@3,perlin:0.05@5,flat@3", "--controller", "cpg"]
    track += ["--no-video", "--json"]
    ways = ["--graph", "oscillators"]
    main(["demo", *track, *ways, "--seed", "1", "--out", str(tmp_path / "walk")])
    summary = json.loads(capsys.readouterr().out)
    assert summary["survived"]
    there, back = summary["switches"]
    assert (there["from"], there["to"], back["to"]) == ("trot", "walk", "trot")
    assert 3.0 < there["x_m"] < 8.0 < back["x_m"] < 11.0
    with pytest.raises(SystemExit) as end:
        main(["demo", *track, "--rough-gait", "gallop", "--out", str(tmp_path / "none")])
    assert end.value.code == 2
    assert "got 'gallop'" in capsys.readouterr().err
