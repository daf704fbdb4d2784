"""results.json, the format of the results of benchmarks and experiments and their provenance."""

import contextlib
import json
import math
import os
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from hrc_env.core.errors import HRCError

PACKAGES = ("numpy", "numba", "scipy", "mujoco", "gymnasium", "stable-baselines3", "torch",
            "opencv-python-headless", "ai-edge-litert", "openvino")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Metric:
    """A number with its interval and sample size."""

    # Fields that are NaN without an interval, also in files.
    MAY_BE_NAN: ClassVar[tuple[str, ...]] = ("low", "high")

    value: float
    """Value of the metric: a mean, rate, fraction or median."""
    low: float
    """Lower end of a 95 % interval, or the smallest of several runs; NaN without an interval."""
    high: float
    """Upper end of a 95 % interval, or the largest of several runs; NaN without an interval."""
    unit: str
    """Unit of the three numbers, such as "m" or "1/min"; "1" for none."""
    n: int
    """Number of observations."""


def over(values: Sequence[float], unit: str) -> Metric:
    """Return the median of repeated measurements, with the smallest and largest as the interval."""
    return Metric(
        float(np.median(values)), float(np.min(values)), float(np.max(values)), unit, len(values)
    )


def describe_metric(metric: Metric) -> str:
    """Return a metric as text with its interval, unit and number of observations; "-" if NaN."""
    if not math.isfinite(metric.value):
        return f"- (n = {metric.n})"
    ends = f" ({metric.low:.3f} to {metric.high:.3f})" if math.isfinite(metric.low) else ""
    unit = "" if metric.unit in ("1", "share") else f" {metric.unit}"
    return f"{metric.value:.3f}{ends}{unit}, n = {metric.n}"


def provenance() -> dict[str, Any]:
    """Return the origin of a result: versions, machine, and the checkout's commit if any."""
    return {
        "hrc_env": _version("hrc_env"),
        "git": _commit(),
        "versions": versions(),
        "machine": {
            "python": platform.python_version(),
            "system": platform.platform(),
            "cores": os.cpu_count(),
        },
    }


def write_results(
    path: Path, config: Mapping[str, Any], seeds: Sequence[int], metrics: Mapping[str, Metric]
) -> None:
    """Write a results file atomically."""
    content = {
        "config": dict(config),
        **provenance(),
        "seeds": list(seeds),
        "metrics": {name: asdict(metric) for name, metric in metrics.items()},
    }
    write_whole(path, json.dumps(content, indent=1))


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file atomically and create its folder; on failure the old content is kept."""
    draft = path.with_name(path.name + ".draft")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        draft.write_bytes(content.encode() if isinstance(content, str) else content)
        os.replace(draft, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            draft.unlink(missing_ok=True)
        raise HRCError(
            f"{path} cannot be written: {error.strerror}. Finished parts are kept: free disk "
            "space, or choose another folder, and start the same command again."
        ) from error


def versions() -> dict[str, str | None]:
    """Return the versions of libraries that affect results; None for one that is not installed."""
    return {name: _version(name) for name in PACKAGES}


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def _commit() -> str | None:
    """Return the commit of the checkout, or None outside a checkout.

    It ends in "+changes" if files outside docs are modified.
    """
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return None
    git = partial(subprocess.run, cwd=root, capture_output=True, text=True, check=True)
    try:
        commit = git(["git", "rev-parse", "--short", "HEAD"]).stdout.strip()
        changes = git(["git", "status", "--porcelain", "--", ".", ":!docs"]).stdout
    except (OSError, subprocess.CalledProcessError):
        return None
    return commit + ("+changes" if changes else "")
