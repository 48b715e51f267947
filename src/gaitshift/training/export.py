"""A trained actor as a policy file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import onnx
import torch
from onnx import NodeProto, TensorProto, helper, numpy_helper
from rsl_rl.models import MLPModel
from rsl_rl.modules import EmpiricalNormalization

from gaitshift.command import CONTROL_PERIOD
from gaitshift.env import GaitEnv
from gaitshift.policy import PolicyInfo

OPSET = 18
"""ONNX operator set; every onnxruntime of the last years reads it."""


def describe(env: GaitEnv, training: dict[str, Any]) -> PolicyInfo:
    """What a policy trained in `env` has to say of itself."""
    gains = env.robot.gains_of(env.config.gains)
    return PolicyInfo(
        robot=env.robot.name,
        machine=env.machine.to_dict(),
        observation={name: [s.start, s.stop] for name, s in env.observe.slices.items()},
        action_scale=env.robot.action_scale,
        stance=list(env.robot.stance),
        gains=env.config.gains,
        kp=gains.kp,
        kd=gains.kd,
        control_rate=1.0 / CONTROL_PERIOD,
        **env.commands(),
        training=training,
    )


def export(
    actor: MLPModel, info: PolicyInfo, path: Path, layers: torch.nn.Sequential | None = None
) -> None:
    """Writes the actor's deterministic part and `info` as one ONNX file, whole or not at all.

    `layers` stand in for the actor's own, behind its normalisation of observations.
    """
    normalizer = cast(EmpiricalNormalization, actor.obs_normalizer)
    modules = list(actor.mlp if layers is None else layers)
    write(modules, info, path, normalizer if actor.obs_normalization else None)


def write(
    layers: Sequence[torch.nn.Module],
    info: PolicyInfo,
    path: Path,
    normalizer: EmpiricalNormalization | None = None,
) -> None:
    """Writes a network of these layers, behind `normalizer`, and `info` as one ONNX file.

    The graph is written out layer by layer (linear, leaky ReLU, tanh): a policy is no more than
    that, and the file then depends on no tracer's version.
    """
    nodes: list[NodeProto] = []
    constants: list[TensorProto] = []
    flow = "observation"

    def constant(name: str, value: torch.Tensor) -> str:
        constants.append(numpy_helper.from_array(value.detach().cpu().numpy().copy(), name))
        return name

    def node(kind: str, inputs: list[str], **attributes: Any) -> str:
        output = f"{kind}_{len(nodes)}"
        nodes.append(helper.make_node(kind, inputs, [output], **attributes))
        return output

    if normalizer is not None:
        mean = constant("mean", normalizer.mean)
        std = constant("std", normalizer.std + normalizer.eps)
        flow = node("Div", [node("Sub", [flow, mean]), std])
    for index, layer in enumerate(layers):
        if isinstance(layer, torch.nn.Linear):
            weight = constant(f"weight_{index}", layer.weight)
            bias = constant(f"bias_{index}", layer.bias)
            flow = node("Gemm", [flow, weight, bias], transB=1)
        elif isinstance(layer, torch.nn.LeakyReLU):
            flow = node("LeakyRelu", [flow], alpha=layer.negative_slope)
        elif isinstance(layer, torch.nn.Tanh):
            flow = node("Tanh", [flow])
        else:
            raise TypeError(f"cannot export a layer of type {type(layer).__name__}")
    nodes[-1].output[0] = "action"
    inputs = next(layer.in_features for layer in layers if isinstance(layer, torch.nn.Linear))
    observation = helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["N", inputs])
    action = helper.make_tensor_value_info("action", TensorProto.FLOAT, ["N", 12])
    graph = helper.make_graph(nodes, "policy", [observation], [action], constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=9)
    helper.set_model_props(model, info.to_metadata())
    onnx.checker.check_model(model)
    part = path.with_suffix(".part")
    onnx.save(model, str(part))
    part.replace(path)
