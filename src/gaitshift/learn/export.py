"""A trained actor as a policy file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import onnx
import torch
from onnx import NodeProto, TensorProto, helper, numpy_helper
from rsl_rl.models import MLPModel
from rsl_rl.modules import EmpiricalNormalization

from gaitshift.control.policy_info import PolicyInfo
from gaitshift.robot.command import CONTROL_PERIOD
from gaitshift.sim.env import GaitEnv
from gaitshift.whole_file import replacing

OPSET = 18
"""ONNX operator set; every recent onnxruntime reads it."""


def describe(env: GaitEnv, training: dict[str, Any]) -> PolicyInfo:
    """The description of a policy trained in `env`."""
    gains = env.robot.gains_of(env.config.gains)
    return PolicyInfo(
        robot=env.robot.name,
        machine=env.machine.to_dict(),
        observation={name: [s.start, s.stop] for name, s in env.walker.observation.slices.items()},
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
    actor: MLPModel,
    info: PolicyInfo,
    path: Path,
    layers: torch.nn.Sequential | None = None,
    critic: MLPModel | None = None,
) -> None:
    """Writes the actor's deterministic part and `info` as one ONNX file, atomically.

    `layers` replace the actor's own, after its normalisation of observations. With a critic the
    file has the output `value` beside `action`; the critic's weights are in half precision.
    """
    modules = list(actor.mlp if layers is None else layers)
    write(modules, info, path, normalizer=_normalizer(actor), critic=critic)


def write(
    layers: Sequence[torch.nn.Module],
    info: PolicyInfo,
    path: Path,
    *,
    normalizer: EmpiricalNormalization | None = None,
    critic: MLPModel | None = None,
) -> None:
    """Writes a network of these layers, after `normalizer`, and `info` as one ONNX file.

    The graph is written layer by layer (linear, leaky ReLU, tanh), so that the file does not depend
    on the version of a tracer.
    """
    inputs = next(layer.in_features for layer in layers if isinstance(layer, torch.nn.Linear))
    parts = _Graph()
    parts.network("action", layers, normalizer)
    outputs = [helper.make_tensor_value_info("action", TensorProto.FLOAT, ["N", 12])]
    if critic is not None:
        parts.network("value", list(critic.mlp), _normalizer(critic), half=True)
        outputs.append(helper.make_tensor_value_info("value", TensorProto.FLOAT, ["N", 1]))
    observation = helper.make_tensor_value_info("observation", TensorProto.FLOAT, ["N", inputs])
    graph = helper.make_graph(parts.nodes, "policy", [observation], outputs, parts.constants)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", OPSET)], ir_version=9)
    helper.set_model_props(model, info.to_metadata())
    onnx.checker.check_model(model)
    with replacing(path) as part:
        onnx.save(model, str(part))


def _normalizer(model: MLPModel) -> EmpiricalNormalization | None:
    return cast(EmpiricalNormalization, model.obs_normalizer) if model.obs_normalization else None


class _Graph:
    """Nodes and constants of an ONNX graph, network by network, all fed with `observation`."""

    def __init__(self) -> None:
        self.nodes: list[NodeProto] = []
        self.constants: list[TensorProto] = []

    def network(
        self,
        output: str,
        layers: Sequence[torch.nn.Module],
        normalizer: EmpiricalNormalization | None,
        *,
        half: bool = False,
    ) -> None:
        """Adds the layers, whose last result is `output`; `half`: weights in half precision."""
        flow = "observation"
        if normalizer is not None:
            mean = self._constant(f"{output}_mean", normalizer.mean)
            std = self._constant(f"{output}_std", normalizer.std + normalizer.eps)
            flow = self._node("Div", [self._node("Sub", [flow, mean]), std])
        for index, layer in enumerate(layers):
            if isinstance(layer, torch.nn.Linear):
                weight = self._constant(f"{output}_weight_{index}", layer.weight, half=half)
                bias = self._constant(f"{output}_bias_{index}", layer.bias)
                flow = self._node("Gemm", [flow, weight, bias], transB=1)
            elif isinstance(layer, torch.nn.LeakyReLU):
                flow = self._node("LeakyRelu", [flow], alpha=layer.negative_slope)
            elif isinstance(layer, torch.nn.Tanh):
                flow = self._node("Tanh", [flow])
            else:
                raise TypeError(f"cannot export a layer of type {type(layer).__name__}")
        self.nodes[-1].output[0] = output

    def _constant(self, name: str, value: torch.Tensor, *, half: bool = False) -> str:
        array = value.detach().cpu().numpy().copy()
        self.constants.append(
            numpy_helper.from_array(array.astype(np.float16) if half else array, name)
        )
        return self._node("Cast", [name], to=TensorProto.FLOAT) if half else name

    def _node(self, kind: str, inputs: list[str], **attributes: Any) -> str:
        output = f"{kind}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(kind, inputs, [output], **attributes))
        return output
