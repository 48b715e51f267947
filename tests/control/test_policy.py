"""A policy file: the exported network is the trained one, and what does not fit is refused."""

import json
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace

import numpy as np
import onnx
import pytest
import torch
from onnx import helper

from gaitshift.control import policy
from gaitshift.control.policy_info import PolicyInfo
from gaitshift.errors import GaitshiftError
from gaitshift.gait import RewardMachine, gaits
from gaitshift.learn.export import describe, export, write
from gaitshift.learn.learner import Learner, as_tensors
from gaitshift.learn.presets import PRESETS
from gaitshift.learn.recipe import PpoConfig, Recipe
from gaitshift.sim.env import EnvConfig, GaitEnv
from gaitshift.sim.terrain import flat
from waiting import PATIENCE

TRAINING = {"command": "gaitshift train trot --seed 3", "seed": 3, "survival": 0.75, "π": [1, 2]}


def untrained(seed, *, normalize=True, config=None):
    """An environment and an actor for it whose weights and statistics are all arbitrary."""
    torch.manual_seed(seed)
    env = GaitEnv(gaits.load("trot"), flat(10.0, 10.0), 2, config=config, threads=1)
    ppo = PpoConfig(hidden=(24, 10), normalize_observations=normalize)
    actor = Learner(env, Recipe(env=env.config, ppo=ppo, robots=2, steps=2)).ppo.actor
    with torch.no_grad():
        for parameter in actor.mlp.parameters():
            parameter.normal_(0.0, 0.5)
        if normalize:
            size = env.walker.observation.size
            many = torch.randn(500, size) * torch.linspace(0.1, 4.0, size) + torch.arange(size)
            actor.train()
            actor.obs_normalizer.update(many)
    return env, actor.eval()


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Actor, description and file of one policy; nobody writes into the file."""
    env, actor = untrained(0)
    info = describe(env, TRAINING)
    path = tmp_path_factory.mktemp("policy") / "trot.onnx"
    export(actor, info, path)
    return actor, info, path


@pytest.fixture
def altered(made, tmp_path):
    """Writes a copy of the policy with other metadata, as text; None takes an entry away."""

    def write(**texts):
        model = onnx.load(made[2])
        entries = {entry.key: entry.value for entry in model.metadata_props}
        for name, text in texts.items():
            entries[f"gaitshift.{name}"] = text
        helper.set_model_props(model, {k: v for k, v in entries.items() if v is not None})
        path = tmp_path / "altered.onnx"
        onnx.save(model, str(path))
        return path

    return write


def refusal(path):
    """The one line with which a policy file is refused; it names the file."""
    with pytest.raises(GaitshiftError) as caught:
        policy.load(path)
    line = str(caught.value)
    assert "\n" not in line
    assert str(path) in line
    return line


# The network ------------------------------------------------------------------------------------


@pytest.mark.parametrize("normalize", [True, False])
@pytest.mark.parametrize("robots", [1, 7])
def test_the_exported_network_is_the_trained_one(tmp_path, robots, normalize):
    env, actor = untrained(1, normalize=normalize)
    path = tmp_path / "policy.onnx"
    export(actor, describe(env, {}), path)
    size = env.walker.observation.size
    observation = np.random.default_rng(0).normal(size=(robots, size)).astype(np.float32)
    if normalize:
        observation = (observation * np.linspace(0.1, 4, size) + np.arange(size)).astype(np.float32)
    with torch.no_grad():
        trained = actor(as_tensors(observation)).numpy()
    exported = policy.load(path)(observation)
    np.testing.assert_allclose(exported, trained, rtol=1e-5, atol=1e-5)
    assert exported.dtype == np.float32
    assert np.ptp(trained, axis=1).min() > 0.1, "the twelve actions differ"


@pytest.mark.parametrize("normalize", [True, False])
def test_the_exported_critic_is_the_trained_one_but_for_half_precision(tmp_path, normalize):
    env, actor = untrained(1, normalize=normalize)
    ppo = PpoConfig(hidden=(24, 10), normalize_observations=normalize)
    recipe = Recipe(env=env.config, ppo=ppo, robots=2, steps=2)
    critic = Learner(env, recipe).ppo.critic
    size = env.walker.observation.size
    with torch.no_grad():
        for parameter in critic.mlp.parameters():
            parameter.normal_(0.0, 0.5)
        if normalize:
            critic.train()
            critic.obs_normalizer.update(torch.randn(500, size) * 3.0 + 1.0)
    critic.eval()
    path = tmp_path / "policy.onnx"
    export(actor, describe(env, {}), path, critic=critic)
    observation = np.random.default_rng(0).normal(size=(9, size)).astype(np.float32)
    with torch.no_grad():
        trained = critic(as_tensors(observation)).numpy()[:, 0]
        acted = actor(as_tensors(observation)).numpy()
    loaded = policy.load(path)
    assert loaded.has_critic
    np.testing.assert_allclose(
        loaded.value(observation), trained, atol=3e-3 * np.abs(trained).max()
    )
    assert np.ptp(trained) > 0.1, "the values differ"
    np.testing.assert_allclose(
        loaded(observation), acted, rtol=1e-5, atol=1e-7 * np.abs(acted).max()
    )


def test_a_policy_without_a_critic_says_so(made):
    loaded = policy.load(made[2])
    assert not loaded.has_critic
    with pytest.raises(GaitshiftError, match="has no critic"):
        loaded.value(np.zeros((1, loaded.observation.size), dtype=np.float32))


def test_a_robot_gets_the_same_action_alone_as_among_others(made):
    loaded = policy.load(made[2])
    observation = np.random.default_rng(0).normal(size=(7, loaded.observation.size))
    observation = observation.astype(np.float32)
    together = loaded(observation)
    for robot in range(7):
        alone = loaded(observation[robot : robot + 1])
        np.testing.assert_allclose(alone[0], together[robot], rtol=1e-5, atol=1e-6)


def test_export_leaves_one_file_and_takes_the_place_of_the_one_before(made, tmp_path):
    actor, info, _ = made
    path = tmp_path / "policy.onnx"
    path.write_text("an older policy")
    export(actor, info, path)
    assert [file.name for file in tmp_path.iterdir()] == ["policy.onnx"]
    assert policy.load(path).info == info


def test_the_target_is_the_stance_plus_the_scaled_action(altered):
    loaded = policy.load(altered(action_scale="0.25"))
    action = 0.4 * np.arange(24.0).reshape(2, 12)
    stance, (_, target) = np.array(loaded.robot.stance), loaded.walker.target(action)
    np.testing.assert_allclose(target[0, :3] - stance[:3], [0.0, 0.1, 0.2])
    np.testing.assert_allclose(target[1, 9:] - stance[9:], [2.1, 2.2, 2.3])


# What stands beside it --------------------------------------------------------------------------


def test_everything_told_at_export_is_read_back(made):
    _, info, path = made
    loaded = policy.load(path)
    assert loaded.info == info
    assert loaded.info.training == TRAINING
    assert loaded.path == path
    assert loaded.gait == "trot"
    assert loaded.machine == gaits.load("trot")
    assert loaded.robot.name == "anymal_b"


def test_the_description_names_the_environment_it_was_trained_in():
    config = EnvConfig(observed=("contact", "machine_state"), gains="paper", forward_speed=0.7)
    env = GaitEnv(gaits.load("bound"), flat(10.0, 10.0), 1, config=config, threads=1)
    info = describe(env, TRAINING)
    assert info.observation == {"contact": [0, 4], "machine_state": [4, 6]}
    assert (info.gains, info.kp, info.kd) == ("paper", 3.0, 0.2)
    assert info.forward_speed == 0.7
    assert info.control_rate == pytest.approx(100.0)
    assert info.machine["name"] == "bound"


def ranged(machine, **config):
    """The description of a policy for this machine, whose own stride is 2 · 20 steps."""
    tables = machine.to_dict() | {"dwell": 20, "dwell_range": [16, 25]}
    tables |= {"speed": 0.8, "speed_range": [0.5, 1.25]}
    for way in tables["transition"]:
        way["dwell"] = 20
    env = GaitEnv(
        RewardMachine.from_dict(tables), flat(9.0, 9.0), 1, config=EnvConfig(**config), threads=1
    )
    return describe(env, TRAINING)


def test_the_description_tells_the_commands_it_was_trained_for(made, tmp_path):
    info = ranged(gaits.load("trot"))
    assert (info.forward_speed, info.speed_range) == (0.8, [0.5, 1.25])
    # 100 control steps a second over 2 · 20, 2 · 25 and 2 · 16 of them.
    assert info.stride_frequency == pytest.approx(2.5)
    assert info.stride_frequency_range == pytest.approx([2.0, 3.125])
    path = tmp_path / "policy.onnx"
    export(made[0], info, path)
    assert policy.load(path).info == info


def test_a_policy_trained_for_one_command_says_so():
    info = ranged(gaits.load("trot"), command_share=0.0, forward_speed=1.1)
    assert (info.forward_speed, info.speed_range) == (1.1, [1.1, 1.1])
    assert info.stride_frequency_range == [info.stride_frequency] * 2


def test_the_policy_wants_the_observation_it_was_trained_on(tmp_path):
    names = ("last_action", "contact", "machine_state", "base_height")
    env, actor = untrained(2, config=EnvConfig(observed=names))
    path = tmp_path / "policy.onnx"
    export(actor, describe(env, {}), path)
    wanted = policy.load(path).observation
    assert wanted.names == names
    assert wanted.slices == env.walker.observation.slices


def test_a_policy_runs_where_neither_torch_nor_gymnasium_nor_mujoco_is(made):
    _, _, path = made
    size = policy.load(path).observation.size
    program = f"""
import sys
for name in ("torch", "gymnasium", "mujoco", "onnx", "rsl_rl", "tensordict"):
    sys.modules[name] = None
import json
import numpy as np
from gaitshift.control import policy
observation = np.linspace(-2, 2, {size}, dtype=np.float32)[None]
print(json.dumps(policy.load({str(path)!r})(observation)[0].tolist()))
"""
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    here = policy.load(path)(np.linspace(-2, 2, size, dtype=np.float32)[None])[0]
    np.testing.assert_allclose(json.loads(done.stdout), here, rtol=1e-6)


@pytest.mark.parametrize("name", policy.shipped())
def test_a_shipped_policy_is_loaded_by_the_name_of_its_gait(name):
    assert policy.load(name).gait == name


@pytest.mark.parametrize("name", policy.shipped("deployable"))
def test_a_policy_for_real_sensors_names_the_command_that_trains_it(name):
    loaded = policy.load(f"deployable/{name}")
    assert loaded.gait == name
    assert "base_linear_velocity_b" in loaded.info.observation, "by the estimator"
    command = loaded.info.training["command"]
    record = json.loads(policy.record_file(f"deployable/{name}").read_text(encoding="utf-8"))
    assert record["command"] == command
    assert record["preset"] in ("deployable", "deployable-gradual")
    assert record["iterations"] == PRESETS[record["preset"]]().iterations, "as it is now"
    assert command.startswith(f"gaitshift train {name} --preset {record['preset']} --seed ")
    assert "--out" not in command


# What is refused --------------------------------------------------------------------------------


def test_a_missing_file_is_refused(tmp_path):
    assert "no policy file" in refusal(tmp_path / "nowhere.onnx")


def test_a_folder_is_no_policy_file(tmp_path):
    (tmp_path / "folder.onnx").mkdir()
    assert "no policy file" in refusal(tmp_path / "folder.onnx")


def test_an_unknown_name_is_refused_with_those_there_are():
    with pytest.raises(GaitshiftError) as caught:
        policy.load("canter")
    line = str(caught.value)
    assert line.startswith("policy must be one of ")
    assert "got 'canter'" in line
    assert all(name in line for name in policy.shipped())
    assert all(f"deployable/{name}" in line for name in policy.shipped("deployable"))


@pytest.mark.parametrize("share", [0.0, 0.001, 0.2, 0.5, 0.9, 0.99, 0.9999])
def test_a_truncated_file_is_refused_wherever_it_breaks_off(made, tmp_path, share):
    whole = made[2].read_bytes()
    path = tmp_path / "truncated.onnx"
    path.write_bytes(whole[: int(share * len(whole))])
    line = refusal(path)
    assert "damaged ONNX file" in line or "not a gaitshift policy" in line or "lacks" in line


def test_a_file_that_is_not_onnx_is_refused(tmp_path):
    path = tmp_path / "text.onnx"
    path.write_text("These are not the weights you are looking for.\n" * 100)
    assert "damaged ONNX file" in refusal(path)


def test_an_onnx_file_of_somebody_else_is_refused(tmp_path):
    inputs, outputs = (
        helper.make_tensor_value_info(name, onnx.TensorProto.FLOAT, ["N", 12])
        for name in ("observation", "action")
    )
    node = helper.make_node("Identity", ["observation"], ["action"])
    graph = helper.make_graph([node], "foreign", [inputs], [outputs])
    opset = [helper.make_opsetid("", 18)]
    path = tmp_path / "foreign.onnx"
    onnx.save(helper.make_model(graph, opset_imports=opset, ir_version=9), str(path))
    assert "not a gaitshift policy" in refusal(path)


def test_another_format_version_is_refused(altered):
    assert "format version must be 2, got 99" in refusal(altered(format_version="99"))


def test_another_robot_is_refused_with_those_there_are(altered):
    line = refusal(altered(robot='"spot"'))
    assert "of the robot 'spot', not of 'anymal_b'" in line


@pytest.mark.parametrize(("name", "text"), [("kp", "81.5"), ("kd", "0.5")])
def test_other_gains_than_the_presets_are_refused(altered, name, text):
    line = refusal(altered(**{name: text}))
    assert f"{name} {text}" in line
    assert "preset 'default'" in line


def test_an_unknown_preset_of_gains_is_refused_with_those_there_are(altered):
    assert "gains must be one of default, paper, got 'soft'" in refusal(altered(gains='"soft"'))


@pytest.mark.parametrize("stance", [[0.5] * 12, [0.0] * 11])
def test_another_stance_is_refused(altered, stance):
    assert "stance must be that of anymal_b" in refusal(altered(stance=json.dumps(stance)))


def test_another_control_rate_is_refused(altered):
    assert "50" in refusal(altered(control_rate="50.0"))


def test_slices_that_do_not_add_up_are_refused(made, altered):
    slices = made[1].observation
    shifted = {name: [start + 1, stop + 1] for name, (start, stop) in slices.items()}
    shorter = {name: ends for name, ends in slices.items() if name != "last_action"}
    for faulty in (shifted, shorter, dict(reversed(slices.items())), {}):
        assert "observation slices must match" in refusal(altered(observation=json.dumps(faulty)))


def test_a_network_of_another_size_than_the_slices_is_refused(made, tmp_path):
    _, smaller = untrained(3, config=EnvConfig(observed=("contact", "machine_state")))
    path = tmp_path / "mixed.onnx"
    export(smaller, made[1], path)
    assert "observation slices must match the network's 6 inputs" in refusal(path)


def test_an_unknown_slice_is_refused(made, altered):
    slices = {**made[1].observation, "smell": [55, 56]}
    assert "'smell'" in refusal(altered(observation=json.dumps(slices)))


@pytest.mark.parametrize("name", ["robot", "machine", "observation", "stance", "training"])
def test_metadata_that_is_no_json_is_refused(altered, name):
    assert f"metadata '{name}': not valid JSON" in refusal(altered(**{name: '{"half": [1, 2'}))


ADDED = ("lateral_speed", "body_height", "height_range")
"""What files of before lack."""


@pytest.mark.parametrize("name", [n for n in PolicyInfo.__dataclass_fields__ if n not in ADDED])
def test_missing_metadata_is_refused(altered, name):
    line = refusal(altered(**{name: None}))
    assert name in line or "not a gaitshift policy" in line


def test_a_policy_of_before_has_no_lateral_speed_and_no_height(altered):
    info = policy.load(altered(**dict.fromkeys(ADDED))).info
    assert (info.lateral_speed, info.body_height, info.height_range) == (0.0, 0.0, [0.0, 0.0])


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("robot", '["anymal_b"]', "'robot' must be a text, got ['anymal_b']"),
        ("machine", "[]", "'machine' must be a table of keys and values, got []"),
        ("observation", "7", "'observation' must be a table of keys and values, got 7"),
        ("observation", '{"contact": [0, 4.5]}', "give 'contact' a start and an end, got [0, 4.5]"),
        ("observation", '{"contact": 4}', "give 'contact' a start and an end, got 4"),
        ("action_scale", "0", "'action_scale' must be a finite number above 0, got 0"),
        ("action_scale", "-0.3", "'action_scale' must be a finite number above 0, got -0.3"),
        ("action_scale", "Infinity", "'action_scale' must be a finite number, got inf"),
        ("action_scale", "true", "'action_scale' must be a number, got True"),
        ("stance", '["a", "b"]', "'stance' must be the angles of 12 joints, got ['a', 'b']"),
        ("stance", "null", "'stance' must be the angles of 12 joints, got None"),
        ("gains", "80", "'gains' must be a text, got 80"),
        ("kp", '"stiff"', "'kp' must be a number, got 'stiff'"),
        ("control_rate", "null", "'control_rate' must be a number, got None"),
        ("forward_speed", '"fast"', "'forward_speed' must be a number, got 'fast'"),
        ("forward_speed", "NaN", "'forward_speed' must be a finite number, got nan"),
        ("speed_range", "null", "'speed_range' must be two numbers, such as [0.4, 1.6], got None"),
        ("speed_range", "[1.6, 0.4]", "'speed_range' must be two finite, rising numbers from 0 up"),
        (
            "speed_range",
            "[0.4]",
            "'speed_range' must be two numbers, such as [0.4, 1.6], got [0.4]",
        ),
        ("stride_frequency", "0", "'stride_frequency' must be a finite number above 0, got 0"),
        ("stride_frequency_range", "[0, 3]", "'stride_frequency_range' must begin above 0"),
        ("training", '"long"', "'training' must be a table of keys and values, got 'long'"),
    ],
)
def test_metadata_of_another_type_or_beyond_all_sense_is_named(altered, name, text, says):
    line = refusal(altered(**{name: text}))
    assert says in line
    assert line.endswith("export it again from its run")


def test_whatever_the_metadata_hold_the_error_is_ours(altered, made):
    """Every entry in turn is something else: nothing but a policy or one line comes of it."""
    odd = (None, True, -1, 0, 1e400, "", "x", [], [1, 2], [None], {}, {"x": [0, 1]}, {"x": None})
    for name in PolicyInfo.__dataclass_fields__:
        for value in odd:
            with suppress(GaitshiftError):
                policy.load(altered(**{name: json.dumps(value)}))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [("action", "deed", "an output 'action'"), ("observation", "view", "an input 'observation'")],
)
def test_a_network_without_what_a_policy_gives_and_takes_is_refused(made, tmp_path, old, new, says):
    model = onnx.load(made[2])
    for node in model.graph.node:
        for names in (node.input, node.output):
            names[:] = [new if name == old else name for name in names]
    for end in (*model.graph.input, *model.graph.output):
        end.name = new if end.name == old else end.name
    path = tmp_path / "renamed.onnx"
    onnx.save(model, str(path))
    assert says in refusal(path)


def test_a_network_of_another_number_of_actions_is_refused(made, tmp_path):
    layer = torch.nn.Linear(made[0].mlp[0].in_features, 11)
    path = tmp_path / "eleven.onnx"
    write([layer], made[1], path)
    model = onnx.load(path)
    model.graph.output[0].type.tensor_type.shape.dim[1].dim_value = 11
    onnx.save(model, str(path))
    assert "12 actions, one for each joint, got 11" in refusal(path)


def test_a_machine_that_breaks_the_laws_is_refused(made, altered):
    machine = json.loads(json.dumps(made[1].machine))
    machine["transition"][0]["to"] = "nowhere"
    assert "nowhere" in refusal(altered(machine=json.dumps(machine)))


def test_a_stance_and_gains_of_today_are_accepted_whatever_they_are(made, tmp_path):
    actor, info, _ = made
    path = tmp_path / "policy.onnx"
    export(actor, replace(info, gains="paper", kp=3.0, kd=0.2), path)
    assert policy.load(path).info.gains == "paper"
