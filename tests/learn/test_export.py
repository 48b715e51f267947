"""The policy that a run leaves behind."""

import numpy as np
import pytest
import torch

from gaitshift.control import policy
from gaitshift.gait import gaits


def test_the_policy_left_behind_is_the_trained_actor_and_says_how_it_was_made(whole):
    run, _ = whole
    loaded = policy.load(run.folder / "policy.onnx")
    assert loaded.gait == "trot"
    info, trot = loaded.info, gaits.load("trot")
    assert (info.forward_speed, info.speed_range) == (trot.speed, list(trot.speed_range))
    # Two states; control steps of 0.01 s.
    assert info.stride_frequency == pytest.approx(50 / trot.dwell)
    slow, fast = trot.dwell_range[::-1]
    assert info.stride_frequency_range == pytest.approx([50 / slow, 50 / fast])
    training = loaded.info.training
    assert (training["seed"], training["iterations"], training["steps"]) == (7, 6, 192)
    assert training["command"] == "gaitshift train trot"


def test_the_policy_left_behind_is_the_mean_of_the_last_actors(whole):
    """Against the weights of the two checkpoints, layer by layer in numpy."""
    run, _ = whole
    loaded = policy.load(run.folder / "policy.onnx")
    size = loaded.observation.size
    seen = np.random.default_rng(0).normal(size=(3, size)).astype(np.float32)
    earlier, last = (
        torch.load(run.folder / "checkpoints" / f"{n:06d}.pt", weights_only=True)["ppo"][
            "actor_state_dict"
        ]
        for n in (4, 6)
    )
    with torch.no_grad():
        flow = run.learner.ppo.actor.obs_normalizer(torch.from_numpy(seen)).numpy()
    for layer in (0, 2, 4):
        weight, bias = (
            (earlier[f"mlp.{layer}.{name}"] + last[f"mlp.{layer}.{name}"]).numpy() / 2
            for name in ("weight", "bias")
        )
        flow = flow @ weight.T + bias
        if layer < 4:
            flow = np.where(flow > 0, flow, 0.01 * flow)
    np.testing.assert_allclose(loaded(seen), flow, atol=1e-5)
    assert not torch.equal(earlier["mlp.0.weight"], last["mlp.0.weight"])
