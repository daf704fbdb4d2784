"""The BlazePose networks as functions from an image to raw tensors, on LiteRT or OpenVINO.

Each thread must load separate functions. LiteRT gives bitwise equal results on all machines with
the same instruction set. The official landmark network also computes a segmentation mask and world
landmarks, which require 40 % of its computing time; `prune` removes these parts.
"""

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import flatbuffers
from ai_edge_litert import schema_py_generated as schema
from ai_edge_litert.interpreter import Interpreter

from hrc_env.core.errors import make_unknown_name_error
from hrc_env.core.typing import Tensor
from hrc_env.perception import vino
from hrc_env.perception.vino import Network
from hrc_env.perception.weights import find_weights

DETECTOR_SIDE = 224
"""Side of the detector stage's input [px]."""
LANDMARK_SIDE = 256
"""Side of the landmark stage's input [px]."""
NETWORKS = ("lite", "full", "heavy")
"""Names of the landmark networks, from the fastest to the most accurate."""
DETECTOR_OUTPUTS = ("Identity", "Identity_1")
"""Names of the detector's outputs: boxes (1, 2254, 12) and score logits (1, 2254, 1)."""
LANDMARK_OUTPUTS = ("Identity", "Identity_1", "Identity_3")
"""Names of the landmark network's outputs: landmarks (1, 195), presence score (1, 1) and heatmaps
(1, 64, 64, 39)."""
RUNTIMES = ("litert", "openvino", "auto")
"""Names of the runtimes. "auto" selects OpenVINO (an optional extra) if it is installed, otherwise
LiteRT."""


class PersonTensors(NamedTuple):
    """Output of the detector stage."""

    boxes: Tensor
    """(2254, 12) box and keypoints of each cell."""
    logits: Tensor
    """(2254,) logits of the scores."""


class LandmarkTensors(NamedTuple):
    """Output of the landmark stage."""

    points: Tensor
    """(39, 5) x, y, z in crop pixels, and logits of visibility and presence."""
    presence: float
    """Presence score of a person in [0, 1]."""
    heat: Tensor
    """(64, 64, 39) logits of the heatmaps."""


PersonDetector: TypeAlias = Callable[[Tensor], PersonTensors]
"""Detector stage as a function of an image (224, 224, 3) in [-1, 1]."""
Landmarker: TypeAlias = Callable[[Tensor], LandmarkTensors]
"""Landmark stage as a function of a crop (256, 256, 3) in [0, 1]."""


def resolve_runtime(name: str) -> str:
    """Return the runtime for a name in `RUNTIMES`; raise `ConfigError` if it is not available."""
    if name not in RUNTIMES:
        raise make_unknown_name_error("runtime", name, RUNTIMES)
    if name == "openvino":
        vino.check_installed()
    if name == "auto":
        return "openvino" if vino.is_installed() else "litert"
    return name


def load_person_detector(runtime: str = "litert") -> PersonDetector:
    """Load the detector stage; raise `WeightsError` if its weights are missing."""
    run = _load("pose_detection", DETECTOR_OUTPUTS, runtime)

    def detect(image: Tensor) -> PersonTensors:
        boxes, logits = run(image)
        return PersonTensors(boxes[0], logits[0, :, 0])

    return detect


def load_landmarker(network: str = "full", runtime: str = "litert") -> Landmarker:
    """Load a landmark network by name; raise `WeightsError` if its weights are missing."""
    run = _load(f"pose_landmark_{network}", LANDMARK_OUTPUTS, runtime)

    def landmark(image: Tensor) -> LandmarkTensors:
        points, flag, heat = run(image)
        return LandmarkTensors(points.reshape(39, 5), float(flag[0, 0]), heat[0])

    return landmark


def _load(weights: str, outputs: tuple[str, ...], runtime: str) -> Network:
    """Load a network as a function from an image to the named outputs."""
    path = find_weights(weights)
    if resolve_runtime(runtime) == "openvino":
        return vino.load(path, outputs)
    return load_tflite(_read_pruned(path, outputs), outputs)


@functools.lru_cache(maxsize=4)
def _read_pruned(path: Path, outputs: tuple[str, ...]) -> bytes:
    """Read and prune a model, and cache the result for all threads."""
    return prune(path.read_bytes(), outputs)


def load_tflite(content: bytes, outputs: Sequence[str]) -> Network:
    """Load a network from the content of a .tflite file, as a function of an image."""
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
    """Remove unused operators from a .tflite model with operators in topological order."""
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
    """Remove all tensors and buffers except `kept`, and renumber the rest (-1: absent input)."""
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
