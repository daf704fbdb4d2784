"""The rows of the experiment: whose eyes, which cameras; and how far the head was off in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np

from hrc_env.core.skeleton import JOINT
from hrc_env.core.typing import Floats
from hrc_env.experiments.study.recording import Beliefs

HEAD = JOINT["nose"]
"""The paper's "head"; MediaPipe has no joint of that name (judgement: the nose)."""
WARM_UP_S = 1.0
"""In the first second everybody has all four cameras, and is not judged: no estimator begins a
track with one camera."""
MULTI = "multi"
"""All four cameras."""


@dataclass(frozen=True, slots=True)
class Row:
    """One pair of eyes."""

    estimator: str
    cameras: tuple[int, ...]

    @property
    def label(self) -> str:
        """`camera_1`, `camera_1+camera_3`, `multi`."""
        if len(self.cameras) == 4:
            return MULTI
        return "+".join(f"camera_{c + 1}" for c in self.cameras)

    @property
    def name(self) -> str:
        """With its estimator."""
        return f"{self.estimator}.{self.label}"


def rows_of(estimators: Sequence[str], sizes: Sequence[int] = (1, 2, 3, 4)) -> list[Row]:
    """Every estimator with every choice of so many of the four cameras."""
    return [
        Row(estimator, cameras)
        for estimator in estimators
        for size in sizes
        for cameras in combinations(range(4), size)
    ]


def head_path(beliefs: Beliefs) -> dict[str, Any]:
    """What is kept of a row: where the head was thought to be (T, 3) [m], and whether tracked."""
    return {
        "head": np.round(beliefs.mean_world[:, HEAD], 4).tolist(),
        "tracked": beliefs.tracked.astype(int).tolist(),
    }


def squared_m2(part: Mapping[str, Any], row: Mapping[str, Any], dt_s: float) -> Floats:
    """(T,) squared distance of the head from the truth, after the warm-up [m^2].

    Frames without a track count: the estimator's last word, or its prior, is its answer.
    """
    off = np.asarray(row["head"], float) - np.asarray(part["truth"], float)
    return (off**2).sum(-1)[round(WARM_UP_S / dt_s) :]
