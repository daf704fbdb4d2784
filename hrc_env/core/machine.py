"""Cores and memory that this process may use."""

import math
import os
from pathlib import Path

CGROUP = Path("/sys/fs/cgroup")
"""Folder with the resource limits of a container."""
CORES = "HRC_ENV_CORES"
"""Name of the environment variable that limits the number of cores of a process. The package
`engines` sets it for workers."""


def n_cores() -> int:
    """Return the number of threads or processes that can compute in parallel."""
    return math.ceil(usable_cores())


def usable_cores() -> float:
    """Return the number of cores that this process may use: by affinity, container and `CORES`."""
    asked = os.environ.get(CORES, "")
    cores = float(len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else 0)
    cores = cores or float(os.cpu_count() or 1)
    quota, *period = _limit("cpu.max").split() or ["max"]
    if quota.isdigit() and period:
        cores = min(cores, int(quota) / int(period[0]))
    return min(cores, float(asked)) if asked.isdigit() and int(asked) else cores


def usable_memory_gb() -> float:
    """Return the memory that this process may use [GB]: the machine's or the container's."""
    machine_bytes = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    shares = [_limit("memory.max"), _limit("memory/memory.limit_in_bytes")]
    return min([machine_bytes, *(int(share) for share in shares if share.isdigit())]) / 1e9


def _limit(name: str) -> str:
    """Return the content of a file with a container's limit, or "" if there is none."""
    try:
        return (CGROUP / name).read_text().strip()
    except OSError:
        return ""
