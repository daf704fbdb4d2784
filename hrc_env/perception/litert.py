"""Networks on LiteRT, the default: the same bits on every machine with the same instructions.

XNNPACK's results do not depend on the number of threads. The official landmark file also computes a
segmentation mask and world landmarks, 40 % of its time, which `prune` drops.
"""

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

import flatbuffers
import numpy as np
from ai_edge_litert import schema_py_generated as schema
from ai_edge_litert.interpreter import Interpreter
from numpy.typing import NDArray

Tensor: TypeAlias = NDArray[np.float32]
Network: TypeAlias = Callable[[Tensor], list[Tensor]]
"""An image (H, W, 3) -> copies of the outputs that were asked for; for one thread at a time."""


def load(content: bytes, outputs: Sequence[str]) -> Network:
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
    """A .tflite model without whatever the named outputs do not need: one pass from the end, as
    operators are stored in topological order."""
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
