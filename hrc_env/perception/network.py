"""The BlazePose networks as plain functions from an image to raw tensors, on LiteRT or OpenVINO.

Load one function per thread. LiteRT gives the same bits on every machine with the same
instructions. The official landmark file also computes a segmentation mask and world landmarks, 40 %
of its time, which `prune` drops.
"""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import flatbuffers
from ai_edge_litert import schema_py_generated as schema
from ai_edge_litert.interpreter import Interpreter

from hrc_env.core.errors import unknown
from hrc_env.core.typing import Tensor
from hrc_env.perception import vino
from hrc_env.perception.vino import Network
from hrc_env.perception.weights import find_weights

DETECTOR_SIDE = 224
LANDMARK_SIDE = 256
NETWORKS = ("lite", "full", "heavy")
"""Landmark networks, from quick to exact."""
DETECTOR_OUTPUTS = ("Identity", "Identity_1")
"""Boxes (1, 2254, 12), score logits (1, 2254, 1) in the official graph."""
LANDMARK_OUTPUTS = ("Identity", "Identity_1", "Identity_3")
"""Landmarks (1, 195), person flag (1, 1), heatmap (1, 64, 64, 39) in the official graph."""
RUNTIMES = ("litert", "openvino", "auto")
"""LiteRT, the default; OpenVINO, an extra; OpenVINO where it is installed, else LiteRT."""
PersonDetector: TypeAlias = Callable[[Tensor], tuple[Tensor, Tensor]]
"""(224, 224, 3) in [-1, 1] -> boxes (2254, 12), score logits (2254,)."""
Landmarker: TypeAlias = Callable[[Tensor], tuple[Tensor, float, Tensor]]
"""(256, 256, 3) in [0, 1] -> landmarks (39, 5), person flag, heatmap logits (64, 64, 39)."""


def chosen_runtime(name: str) -> str:
    """The runtime that `name` comes to here. Raises `ConfigError` for one unknown or missing."""
    if name not in RUNTIMES:
        raise unknown("runtime", name, RUNTIMES)
    if name == "openvino":
        vino.require()
    if name == "auto":
        return "openvino" if vino.installed() else "litert"
    return name


def load_person_detector(runtime: str = "litert") -> PersonDetector:
    """The person detector stage. Raises `WeightsError` where the weights are missing."""
    run = _load("pose_detection", DETECTOR_OUTPUTS, runtime)

    def detect(image: Tensor) -> tuple[Tensor, Tensor]:
        boxes, logits = run(image)
        return boxes[0], logits[0, :, 0]

    return detect


def load_landmarker(network: str = "full", runtime: str = "litert") -> Landmarker:
    """A landmark stage, of `NETWORKS`. Raises `WeightsError` where its weights are missing."""
    run = _load(f"pose_landmark_{network}", LANDMARK_OUTPUTS, runtime)

    def landmark(image: Tensor) -> tuple[Tensor, float, Tensor]:
        points, flag, heat = run(image)
        return points.reshape(39, 5), float(flag[0, 0]), heat[0]

    return landmark


def _load(weights: str, outputs: tuple[str, ...], runtime: str) -> Network:
    path = find_weights(weights)
    if chosen_runtime(runtime) == "openvino":
        return vino.load(path, outputs)
    return load_tflite(_pruned(path, outputs), outputs)


@functools.lru_cache(maxsize=4)
def _pruned(path: Path, outputs: tuple[str, ...]) -> bytes:
    """Every thread has an interpreter of its own; pruning takes half a second."""
    return prune(path.read_bytes(), outputs)


def load_tflite(content: bytes, outputs: Sequence[str]) -> Network:
    """A .tflite file's content as a function from an image to the named outputs."""
    net = Interpreter(model_content=content, num_threads=1)
    net.allocate_tensors()
    into = net.get_input_details()[0]["index"]
    index = {detail["name"]: detail["index"] for detail in net.get_output_details()}
    wanted = [index[name] for name in outputs]

    def run(image: Tensor) -> list[Tensor]:
        net.set_tensor(into, image[None])
        net.invoke()
        return [net.get_tensor(k) for k in wanted]

    return run


def prune(content: bytes, outputs: Sequence[str]) -> bytes:
    """A .tflite model, operators in topological order, without what the outputs do not need."""
    model: Any = schema.ModelT.InitFromPackedBuf(content, 0)  # generated code, loosely typed
    graph = model.subgraphs[0]
    by_name = {graph.tensors[k].name.decode(): int(k) for k in graph.outputs}
    graph.outputs = [by_name[name] for name in outputs]
    needed, operators = set(graph.outputs), []
    for operator in reversed(graph.operators):
        if needed.intersection(int(k) for k in operator.outputs):
            operators.append(operator)
            needed.update(int(k) for k in operator.inputs if k >= 0)
    graph.operators = operators[::-1]
    needed.update(int(k) for k in graph.inputs)
    needed.update(int(k) for operator in operators for k in operator.outputs)
    _keep_tensors(model, sorted(needed))
    builder = flatbuffers.Builder(len(content))
    builder.Finish(model.Pack(builder), b"TFL3")
    return bytes(builder.Output())


def _keep_tensors(model: Any, kept: list[int]) -> None:
    """Renumber tensors and buffers so that only `kept` remain (-1 marks an absent input)."""
    graph = model.subgraphs[0]
    place = {old: new for new, old in enumerate(kept)}
    place[-1] = -1
    graph.tensors = [graph.tensors[k] for k in kept]
    for item in (graph, *graph.operators):
        item.inputs = [place[int(k)] for k in item.inputs]
        item.outputs = [place[int(k)] for k in item.outputs]
    buffers = [model.buffers[0]]  # the empty one, by the format's convention
    for tensor in graph.tensors:
        if tensor.buffer:
            buffers.append(model.buffers[tensor.buffer])
            tensor.buffer = len(buffers) - 1
    model.buffers = buffers
    model.metadata = model.metadataBuffer = model.signatureDefs = None
