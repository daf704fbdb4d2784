"""results.json: the one form in which every benchmark and experiment writes its numbers."""

import contextlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hrc_env.core.errors import HRCError
from hrc_env.core.provenance import provenance


@dataclass(frozen=True, slots=True)
class Metric:
    """A number with its spread."""

    value: float
    low: float
    """Lower end of a 95 % interval, or the smallest of the runs; see the benchmark."""
    high: float
    """Upper end, or the largest."""
    unit: str
    n: int
    """How many observations it is made of."""


def over(values: Sequence[float], unit: str) -> Metric:
    """The median of repeated measurements, with their smallest and largest."""
    return Metric(
        float(np.median(values)), float(np.min(values)), float(np.max(values)), unit, len(values)
    )


def write_results(
    path: Path, config: Mapping[str, Any], seeds: Sequence[int], metrics: Mapping[str, Metric]
) -> None:
    """Write a results file, whole or not at all."""
    content = {
        "config": dict(config),
        **provenance(),
        "seeds": list(seeds),
        "metrics": {name: asdict(metric) for name, metric in metrics.items()},
    }
    write_whole(path, json.dumps(content, indent=1))


def write_whole(path: Path, content: str) -> None:
    """Write a text file, whole or not at all (what was there stays); its folder is made."""
    draft = path.with_name(path.name + ".draft")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_text(content)
        os.replace(draft, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)
        raise HRCError(
            f"{path} cannot be written: {error.strerror}. What is finished is kept; make room, "
            "or choose another folder, and start the same command again."
        ) from error
