"""The BlazePose networks as plain functions from an image to raw tensors, on LiteRT or OpenVINO.

Each function belongs to one thread at a time; load one per thread.
"""

import functools
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

from hrc_env.core.errors import unknown
from hrc_env.perception import litert, vino
from hrc_env.perception.litert import Network, Tensor
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
    """Which runtime `name` comes to here: "litert" or "openvino".

    Raises:
        ConfigError: no such runtime, or one that is not installed.
    """
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
    return litert.load(_pruned(path, outputs), outputs)


@functools.lru_cache(maxsize=4)
def _pruned(path: Path, outputs: tuple[str, ...]) -> bytes:
    """Every thread has an interpreter of its own; pruning takes half a second."""
    return litert.prune(path.read_bytes(), outputs)
