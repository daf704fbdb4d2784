"""Inference with OpenVINO, which is an optional extra: pip install "hrc_env[openvino]".

OpenVINO evaluates only the operators that are needed for the requested outputs. On processors with
16-bit floating-point arithmetic (bf16: AVX512_BF16 or AMX), it requires half of LiteRT's computing
time, and landmarks differ by a quarter of a pixel.
"""

import functools
import importlib.util
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from hrc_env.core.errors import ConfigError
from hrc_env.core.typing import Tensor

Network: TypeAlias = Callable[[Tensor], list[Tensor]]
"""Function from an image (H, W, 3) to copies of the requested outputs. It is not thread-safe."""
INSTALL = 'pip install "hrc_env[openvino]"'
"""Command that installs OpenVINO."""
TIME_SHARE = 0.72
"""Time of a step at level `pixels` with OpenVINO in bf16, as a share of that with LiteRT
(docs/results/whole/pixels.json)."""


def describe_gain() -> str:
    """Return a sentence on the gain of OpenVINO, or on the setting that selects it."""
    if is_installed():
        return f'computes in {precision()} if detector.runtime is "openvino" or "auto"'
    return (
        "not installed; on processors with bf16, it reduces the time of a step at perception "
        f"pixels by {1 - TIME_SHARE:.0%}: {INSTALL}"
    )


def is_installed() -> bool:
    """Return whether OpenVINO is installed, without importing it."""
    return importlib.util.find_spec("openvino") is not None


def check_installed() -> None:
    """Raise `ConfigError` if OpenVINO is not installed."""
    if not is_installed():
        raise ConfigError(
            f'runtime="openvino" needs OpenVINO, which is not installed: {INSTALL}, or choose '
            'runtime="litert".'
        )


def precision() -> str:
    """Return the precision of inference: "bf16" if the processor supports it, otherwise "f32"."""
    return "bf16" if "BF16" in _core().get_property("CPU", "OPTIMIZATION_CAPABILITIES") else "f32"


def load(path: Path, outputs: Sequence[str], bits: str | None = None) -> Network:
    """Load a .tflite file as a single-threaded function from an image to named outputs.

    Args:
        path: path of the file.
        outputs: names of the outputs.
        bits: precision, "f32" or "bf16"; None for `precision()`.
    """
    whole = _core().read_model(path)
    wanted = [out.node for name in outputs for out in whole.outputs if name in out.names]
    model = _openvino().Model(wanted, whole.get_parameters())
    one_thread = {"INFERENCE_NUM_THREADS": 1, "NUM_STREAMS": 1, "ENABLE_CPU_PINNING": False}
    settings = {**one_thread, "INFERENCE_PRECISION_HINT": bits or precision()}
    request = _core().compile_model(model, "CPU", settings).create_infer_request()
    image_in = request.get_input_tensor().data
    tensors = [request.get_output_tensor(k).data for k in range(len(outputs))]

    def run(image: Tensor) -> list[Tensor]:
        image_in[0] = image
        request.infer()
        return [np.array(tensor) for tensor in tensors]

    return run


@functools.cache
def _core() -> Any:
    """Return OpenVINO's core, which is created once per process."""
    return _openvino().Core()


def _openvino() -> Any:
    """Import OpenVINO without its telemetry.

    The telemetry would store usage counts in the home folder.
    """
    check_installed()
    sys.modules.setdefault("openvino_telemetry", None)  # type: ignore[arg-type]
    return importlib.import_module("openvino")
